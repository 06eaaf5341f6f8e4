"""`painter place` from the words on the command line to the file."""

import json

import pytest

from painter.cli.main import run


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


def test_unusable_wall_is_one_line_and_exit_2(tmp_path, capsys):
    for wall in ("5", "axb", "0x2", "1..2x2"):
        assert run(["place", "--wall", wall, "--out", str(tmp_path / "out")]) == 2
        (line,) = capsys.readouterr().err.strip().splitlines()
        assert f"--wall '{wall}'" in line
