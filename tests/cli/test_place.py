"""`painter place` from the words on the command line to the file."""

import json

import pytest

from painter.cli.main import run
from painter.scene.load import load_scene


def test_wall_becomes_stations_before_which_the_arm_reaches_all(tmp_path, capsys):
    out = tmp_path / "out"
    assert run(["place", "--wall", "5x2", "--out", str(out), "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)
    document = json.loads((out / "stations.json").read_text())
    assert summary["stations"] == len(document["stations"]) == 3
    assert summary["spray_share"] == 1.0
    assert 0.8 <= summary["distance"] <= 1.4
    tiles = [station["tile"] for station in document["stations"]]
    assert sum(tile[2] for tile in tiles) == pytest.approx(5.0)
    assert [tile[3] for tile in tiles] == pytest.approx([2.0] * 3)


def test_stations_of_a_scene_leave_its_door_and_window(tmp_path, capsys):
    out = tmp_path / "out"
    assert run(["place", "--scene", "terrace", "--out", str(out), "--json"]) == 0
    bare = json.loads(capsys.readouterr().out)
    document = json.loads((out / "stations.json").read_text())
    scene = load_scene("terrace", 1)
    tiles = [station["tile"] for station in document["stations"]]
    assert bare["stations"] == len(tiles)
    for opening in scene.openings:
        x = opening.x - scene.wall.x + opening.width / 2.0
        y = opening.y - scene.wall.y + opening.height / 2.0
        for station, tile in zip(document["stations"], tiles, strict=True):
            for x0, y0, _, y1, _ in station["strokes"]:
                over = abs(tile[0] + x0 - x) < 0.1
                assert not (over and tile[1] + y0 < y < tile[1] + y1)


def test_zones_that_cannot_be_name_option_value_and_bound(tmp_path, capsys):
    out = ["--out", str(tmp_path / "out")]
    for words, text in (
        (["--exclude", "1,2,3"], "--exclude '1,2,3': expected two or more pairs"),
        (["--exclude", "1,1,9,2", "--wall", "5x2"], "x must be 0 to 5 m, got 9.0"),
        (["--include", "1,1,1,2"], "corners: area must be > 0 m²"),
        (["--scene", "terrace", "--wall", "5x2"], "only one of them"),
    ):
        assert run(["place", *words, *out]) == 2
        (line,) = capsys.readouterr().err.strip().splitlines()
        assert text in line


def test_unusable_wall_is_one_line_and_exit_2(tmp_path, capsys):
    for wall in ("5", "axb", "0x2", "1..2x2"):
        assert run(["place", "--wall", wall, "--out", str(tmp_path / "out")]) == 2
        (line,) = capsys.readouterr().err.strip().splitlines()
        assert f"--wall '{wall}'" in line
