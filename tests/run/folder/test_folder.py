"""Run folders: what they refuse, what they keep, and that nothing looks complete."""

import json
import struct

import numpy as np
import open3d as o3d
import pytest

from painter.errors import InputError
from painter.run.folder import folder as files
from painter.run.folder.folder import RunFolder, rounded

SCENARIO = "cubes:\n  scene: cubes\n  random_seed: 1\n"


def test_new_folder_is_incomplete_until_completed(tmp_path):
    dut = RunFolder.create(tmp_path / "deep" / "run", SCENARIO)
    assert not dut.is_complete
    assert (dut.path / "INCOMPLETE").is_file()
    assert dut.scenario() == {"scene": "cubes", "random_seed": 1}
    dut.complete()
    assert RunFolder.open(dut.path).is_complete


def test_folder_with_other_things_is_refused_and_kept(tmp_path):
    (tmp_path / "thesis.txt").write_text("all I have")
    with pytest.raises(InputError, match="not empty and not a run folder"):
        RunFolder.create(tmp_path, SCENARIO)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.txt"]


def test_file_in_place_of_the_folder_is_refused(tmp_path):
    (tmp_path / "run").write_text("")
    with pytest.raises(InputError, match="a file of that name"):
        RunFolder.create(tmp_path / "run", SCENARIO)


def test_earlier_run_is_replaced_but_not_what_a_user_added(tmp_path, film):
    dut = RunFolder.create(tmp_path, SCENARIO)
    dut.save_film(film)
    dut.complete()
    (tmp_path / "notes.txt").write_text("mine")
    again = RunFolder.create(tmp_path, SCENARIO)
    assert not again.is_complete
    assert again.film() is None
    assert (tmp_path / "notes.txt").read_text() == "mine"


@pytest.mark.parametrize("name", ["missing", ""])
def test_only_run_folders_open(tmp_path, name):
    with pytest.raises(InputError, match="no such folder|not a run folder"):
        RunFolder.open(tmp_path / name)


def test_events_are_lines_as_the_design_says(tmp_path):
    dut = RunFolder.create(tmp_path, SCENARIO)
    dut.log(0.0, "phase", phase="HOME")
    dut.log(0.1 + 0.2, "stage", stage="wall_finder", compute_s=np.float64(0.5))
    lines = (tmp_path / "events.jsonl").read_text().splitlines()
    assert json.loads(lines[0]) == {"time": 0.0, "phase": "HOME"}
    assert dut.events()[1] == {
        "time": 0.3,
        "event": "stage",
        "stage": "wall_finder",
        "compute_s": 0.5,
    }


def test_line_cut_short_by_a_killed_run_is_left_out(tmp_path):
    dut = RunFolder.create(tmp_path, SCENARIO)
    dut.log(0.0, "phase", phase="HOME")
    with (tmp_path / "events.jsonl").open("a") as file:
        file.write('{"time": 1.0, "ph')
    assert dut.events() == [{"time": 0.0, "phase": "HOME"}]
    dut.complete()
    with pytest.raises(InputError, match=r"events\.jsonl:2"):
        dut.events()


def test_map_reads_back_here_and_in_open3d(tmp_path, surface_map):
    dut = RunFolder.create(tmp_path, SCENARIO)
    dut.save_map(surface_map)
    # Single precision: 2.4e-7 m at 2 m.
    np.testing.assert_allclose(dut.map_points(), surface_map.p_WQs, atol=3e-7)
    cloud = o3d.io.read_point_cloud(str(tmp_path / "map.ply"))
    np.testing.assert_allclose(cloud.points, surface_map.p_WQs.T, atol=3e-7)
    np.testing.assert_allclose(cloud.normals, surface_map.normals_W.T, atol=1e-7)


def test_maps_of_earlier_runs_are_read(tmp_path):
    # As runs have written them since map.ply is part of the run folder.
    names = ("x", "y", "z", "nx", "ny", "nz")
    properties = "".join(f"property float {name}\n" for name in names)
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        "comment Painter map: points and normals in the world frame W, m\n"
        f"element vertex 2\n{properties}end_header\n"
    )
    points = struct.pack("<12f", 1.5, -0.25, 2, -1, 0, 0, 1.25, 0.5, 0.75, -1, 0, 0)
    dut = RunFolder.create(tmp_path, SCENARIO)
    (tmp_path / "map.ply").write_bytes(header.encode() + points)
    np.testing.assert_array_equal(
        dut.map_points(), [[1.5, 1.25], [-0.25, 0.5], [2.0, 0.75]]
    )


def test_values_read_back_as_written(full_folder, segmentation, truth, executed, film):
    read = full_folder.segmentation()
    np.testing.assert_array_equal(read.labels, segmentation.labels)
    np.testing.assert_array_equal(read.wall_mask, segmentation.wall_mask)
    assert read.X_WT.IsExactlyEqualTo(segmentation.X_WT)
    np.testing.assert_array_equal(full_folder.executed().X_WG, executed.X_WG)
    np.testing.assert_array_equal(full_folder.film().truth_keepout, film.truth_keepout)
    # Single precision.
    np.testing.assert_allclose(full_folder.film().thickness, film.thickness, rtol=1e-6)
    assert full_folder.film().landed == film.landed
    assert full_folder.truth().source == truth.source
    assert len(full_folder.program().strokes) == 23


def test_no_draft_stays_behind(full_folder):
    assert not list(full_folder.path.glob(".*"))


@pytest.mark.parametrize(
    ("name", "read"),
    [
        (files.MAP, RunFolder.map_points),
        (files.SEGMENTATION, RunFolder.segmentation),
        (files.PROGRAM, RunFolder.program),
        (files.EXECUTED, RunFolder.executed),
        (files.FILM, RunFolder.film),
        (files.TRUTH, RunFolder.truth),
    ],
)
@pytest.mark.parametrize("keep", [0, 0.6])
def test_file_cut_short_is_named(full_folder, name, read, keep):
    path = full_folder.path / name
    whole = path.read_bytes()
    path.write_bytes(whole[: int(keep * len(whole))] if keep else b"\x00\xff")
    with pytest.raises(InputError, match=name):
        read(full_folder)


@pytest.mark.parametrize("text", ["", "- cubes\n", "a: 1\nb: 2\n", "cubes: [\n"])
def test_scenario_file_of_another_form_is_named(tmp_path, text):
    dut = RunFolder.create(tmp_path, text)
    with pytest.raises(InputError, match=r"scenario\.yaml"):
        dut.scenario()


def test_numbers_have_six_digits():
    assert rounded({"a": [1.23456789e-5, 3], "b": None, "c": True}) == {
        "a": [1.23457e-5, 3],
        "b": None,
        "c": True,
    }
