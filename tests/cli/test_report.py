"""`painter report`: exit codes and one line for what cannot be read."""

import json

import pytest

from painter.cli.main import run
from painter.config import Scenario, dump_scenario
from painter.run.folder.folder import RunFolder


@pytest.fixture
def folder(tmp_path):
    folder = RunFolder.create(tmp_path / "run", dump_scenario(Scenario(name="cubes")))
    folder.log(0.0, "phase", phase="HOME")
    folder.log(4.0, "phase", phase="DONE")
    folder.log(4.0, "ended", result="DONE", wall_clock_s=2.0)
    folder.complete()
    return folder.path


def test_rebuilds_the_report(folder, capsys):
    assert run(["report", str(folder)]) == 0
    assert "4.0 s" in capsys.readouterr().out
    assert (folder / "report.html").is_file()
    assert json.loads((folder / "report.json").read_text())["motion_time_s"] == 4.0


def test_json_is_alone_on_stdout(folder, capsys):
    assert run(["report", str(folder), "--json"]) == 0
    out = capsys.readouterr().out
    assert json.loads(out) == json.loads((folder / "report.json").read_text())


def test_other_folders_are_wrong_use(tmp_path, capsys):
    assert run(["report", str(tmp_path / "missing")]) == 2
    assert run(["report", str(tmp_path)]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2
    assert "no such folder" in lines[0]
    assert "not a run folder" in lines[1]


def test_unreadable_file_is_named(folder, capsys):
    (folder / "film.npz").write_bytes(b"cut short")
    (folder / "events.jsonl").write_text("nothing\n")
    assert run(["report", str(folder)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "events.jsonl:1" in line
