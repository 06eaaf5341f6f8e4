"""`painter plan` from the words on the command line to the files."""

import json

import numpy as np
import pytest
from PIL import Image
from pydrake.math import RigidTransform

from painter.cli.main import run
from painter.planning.config import TileConfig
from painter.planning.program.store import load_program
from painter.planning.tile import nominal_tile_pose
from perception.io.segmentations import save_segmentation
from perception.values import WallSegmentation


def segmentation(path, X_WT):
    mask = np.ones((200, 200), dtype=bool)
    mask[80:160, 60:140] = False
    content = WallSegmentation(
        labels=np.where(mask, 1, 2).astype(np.uint16),
        depth=np.where(mask, 0.0, -0.1).astype(np.float32),
        wall_mask=mask,
        X_WT=X_WT,
        cell=0.01,
    )
    save_segmentation(path, content)
    return str(path)


@pytest.fixture
def wall(tmp_path):
    return segmentation(tmp_path / "wall.npz", nominal_tile_pose(TileConfig()))


def test_folder_holds_the_program(wall, tmp_path, capsys):
    out = tmp_path / "out"
    words = ["plan", wall, "--out", str(out), "--set", "raster.speed=0.5", "--json"]
    assert run(words) == 0
    names = {path.name for path in out.iterdir()}
    assert names == {"program.json", "trajectory.npz", "program.png", "film.png"}
    program = load_program(out)
    assert {stroke.speed for stroke in program.strokes} == {0.5}
    summary = json.loads(capsys.readouterr().out)
    assert summary["strokes"] == len(program.strokes)
    assert summary["duration"] == pytest.approx(program.motion.duration)
    picture = np.array(Image.open(out / "program.png").convert("RGB"))
    assert min(picture.shape[:2]) > 400
    assert picture.std() > 10.0  # There is something on it.


def test_wall_out_of_reach_leaves_nothing_behind(tmp_path, capsys):
    far = segmentation(tmp_path / "far.npz", RigidTransform([0.0, 0.0, 5.0]))
    assert run(["plan", far, "--out", str(tmp_path / "out")]) == 1
    error = capsys.readouterr().err.strip().splitlines()[-1]
    assert "out of reach" in error
    assert "the arm has 1.57 m" in error
    assert [path.name for path in tmp_path.iterdir()] == ["far.npz"]


def test_recorded_wall_can_be_planned_where_the_scenario_expects_it(tmp_path):
    recorded = segmentation(tmp_path / "cloud.npz", RigidTransform())
    out = tmp_path / "out"
    assert run(["plan", recorded, "--expected-wall", "--out", str(out)]) == 0
    expected = nominal_tile_pose(TileConfig())
    assert load_program(out).X_WT.IsNearlyEqualTo(expected, 1e-12)


def test_unusable_input_is_one_line_and_exit_2(wall, tmp_path, capsys):
    out = str(tmp_path / "out")
    for words, text in (
        ([str(tmp_path / "none.npz")], "none.npz: no such file"),
        ([wall, "--scenario", "nowhere"], "'nowhere' is unknown"),
        ([wall, "--set", "raster.sped=1"], "sped"),
    ):
        assert run(["plan", *words, "--out", out]) == 2
        (line,) = capsys.readouterr().err.strip().splitlines()
        assert text in line


def strokes_of(folder):
    return load_program(folder).strokes


def test_mark_is_painted_anew_and_nothing_else(wall, tmp_path, capsys):
    out = tmp_path / "out"
    words = ["plan", wall, "--mark", "0.2,1.6,0.4,1.8", "--json"]
    assert run([*words, "--out", str(out)]) == 0
    # The film as predicted counts what is there already.
    predicted = json.loads(capsys.readouterr().out)["predicted"]
    assert predicted["coverage"] > 0.99
    assert predicted["keepout_paint"] == 0.0
    strokes = strokes_of(out)
    assert strokes
    assert {stroke.kind for stroke in strokes} == {"touch_up"}
    ends = np.array([[stroke.start_T, stroke.end_T] for stroke in strokes])
    # Strokes lap over the rim of the mark by a part of their narrow fan.
    np.testing.assert_array_less([0.17, 1.57], ends.min(axis=(0, 1)))
    np.testing.assert_array_less(ends.max(axis=(0, 1)), [0.43, 1.83])


def test_zones_of_the_operator_are_kept(wall, tmp_path, capsys):
    out = tmp_path / "out"
    words = ["--include", "0,0,1,2", "--exclude", "0,1,1,2", "--json"]
    assert run(["plan", wall, *words, "--out", str(out)]) == 0
    ends = np.array([[s.start_T, s.end_T] for s in strokes_of(out)])
    assert ends[..., 0].max() < 1.0
    assert ends[..., 1].max() < 1.05
    # What is left out by the operator does not count as bare.
    predicted = json.loads(capsys.readouterr().out)["predicted"]
    assert predicted["coverage"] > 0.9


def test_job_goes_on_from_a_stroke(wall, tmp_path):
    for name, words in (("all", []), ("rest", ["--from-stroke", "4.5"])):
        assert run(["plan", wall, *words, "--out", str(tmp_path / name)]) == 0
    whole, rest = strokes_of(tmp_path / "all"), strokes_of(tmp_path / "rest")
    assert len(rest) == len(whole) - 3
    # In an order of its own; the fourth stroke's second half is among them.
    half = pytest.approx(whole[3].length / 2.0)
    assert any(
        stroke.length == half and stroke.start_T[0] == whole[3].start_T[0]
        for stroke in rest
    )


def test_options_that_do_not_fit_are_refused(wall, tmp_path, capsys):
    out = str(tmp_path / "out")
    for words, text in (
        (["--mark", "1,2,3"], "--mark '1,2,3'"),
        (["--exclude", "0,0,3,1"], "--exclude '0,0,3,1'.corners: x must be 0 to 2 m"),
        (["--from-stroke", "500"], "from_stroke must be 1 to"),
        (["--touch-up", str(tmp_path)], "film.npz: no such file"),
        (["--touch-up", "x", "--mark", "0,0,1,1"], "only one of them"),
    ):
        assert run(["plan", wall, *words, "--out", out]) == 2
        assert text in capsys.readouterr().err.strip().splitlines()[-1]
