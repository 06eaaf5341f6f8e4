"""Reading scenes, good and bad."""

from pathlib import Path

import pytest

from painter.errors import InputError
from painter.scene.load import dump_scene, load_scene, named_scenes
from painter.scene.surface import height_field, is_paintable


def write(folder: Path, text: str) -> str:
    path = folder / "bad.scene.yaml"
    path.write_text(text)
    return str(path)


def test_the_named_scenes_are_there():
    assert named_scenes() == ["blank", "cubes", "obstacles", "room", "terrace"]


@pytest.mark.parametrize("name", ["blank", "cubes", "obstacles", "room", "terrace"])
def test_named_scene_suits_the_paint_cycle(name: str):
    scene = load_scene(name, 1)
    field = height_field(scene, cell=0.01)
    assert scene.name == name
    assert scene.description
    assert field.height.max() < 0.16  # The gun at 0.30 m passes over everything.
    assert is_paintable(field.kind).mean() > 0.4
    error = scene.base_error
    for offset in (error.x, error.y, error.z):
        assert 0.0 < abs(offset) <= 0.015
    for angle in (error.roll_deg, error.pitch_deg, error.yaw_deg):
        assert 0.3 <= abs(angle) <= 0.6


def test_file_reads_back_as_written(tmp_path: Path):
    scene = load_scene("terrace", 1)
    path = tmp_path / "again.scene.yaml"
    path.write_text(dump_scene(scene))
    assert load_scene(str(path), 1) == scene


def test_empty_scene_is_the_default_wall(tmp_path: Path):
    scene = load_scene(write(tmp_path, "bare:"), 1)
    assert scene.name == "bare"
    assert scene.openings == []


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: {colour: 3}", "colour is unknown; known are: name, "),
        ("a: {wall: {widht: 3.0}}", r"wall\.widht is unknown"),
        ("a: {wall: 3}", "wall must have fields, got 3"),
        ("a: 3", "expected fields below 'a', got 3"),
        ("a: {openings: [{x: left}]}", r"openings\[0\]\.x must be a number"),
        ("a: {openings: 3}", "openings must be a list, got 3"),
        ("a: {openings: [{vertical_bars: 1.5}]}", "must be a whole number, got 1.5"),
        ("a: {openings: [{width: -1.0}]}", r"width must be 0\.1 to 10 m, got -1\.0"),
        ("a: {openings: [{x: .nan}]}", r"openings\[0\]\.x must be -10 to 10 m"),
        ("a: {openings: [{x: 2.2}]}", r"\]\.x must be -0\.6 to 1\.800 m"),
        ("a: {openings: [{recess: 0.28}]}", r"thickness less frame_depth, 0\.240 m"),
        ("a: {openings: [{frame_width: 0.21}]}", r"width must be at least twice its"),
        ("a: {openings: [{}, {}]}", r"openings\[1\]\.x must be clear of openings\[0\]"),
        ("a: {openings: [{kind: gate}]}", "kind must be one of window, door"),
        ("a: {objects: [{shape: sphere}]}", "size must be 1 numbers: diameter, got"),
        ("a: {objects: [{size: [0.1, 0.1, 0.0]}]}", r"size\[2\] must be 0\.005 to 5 m"),
        ("a: {objects: [{position: [3, 1, 0]}]}", r"\[0\] must be -0\.6 to 2\.6 m"),
        ("a: {objects: [{color: [1, 2, 0]}]}", r"color\[1\] must be 0 to 1, got 2"),
        ("a: {base_error: {x: 0.2}}", r"base_error\.x must be -0\.1 to 0\.1 m"),
        ("a: {wall: {texture: wool}}", "texture must be one of none, plaster, brick"),
        ("a: {}\nb: {}", "expected one top key"),
        ("- a", "expected one top key"),
        ("a: [", "expected"),
    ],
)  # fmt: skip
def test_bad_file_is_named_in_one_line(tmp_path: Path, text: str, message: str):
    path = write(tmp_path, text)
    with pytest.raises(InputError, match=message) as caught:
        load_scene(path, 1)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)


def test_unknown_name_lists_the_known_ones():
    with pytest.raises(InputError, match="'cube' is unknown; known are: blank, cubes"):
        load_scene("cube", 1)


def test_missing_file_and_folder_are_input_errors(tmp_path: Path):
    with pytest.raises(InputError, match="no such scene file"):
        load_scene(str(tmp_path / "none.yaml"), 1)
    (tmp_path / "folder.yaml").mkdir()
    with pytest.raises(InputError, match="folder.yaml"):
        load_scene(str(tmp_path / "folder.yaml"), 1)
