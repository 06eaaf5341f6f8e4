"""A simulated job by its function and by its command; cut short by a time limit."""

import json

import numpy as np
import pytest

import painter
from painter.cli.main import run

# The cycle ends in FAULT, since no scan fits into its time: no whole cycle is needed.
SHORT = ["cycle.time_limit=0.5", "raster.coats=1"]
WORDS = [word for override in SHORT for word in ("--set", override)]


def test_without_a_folder_the_log_is_returned():
    log = painter.simulate("blank", overrides=SHORT)
    assert log.status.phase.value == "FAULT"
    assert 0.0 < log.end_time < 1.5  # The arm comes to rest first.
    assert log.q.shape == (log.time.size, 5)
    assert np.isfinite(log.X_WG).all()


def test_with_a_folder_the_run_is_returned(tmp_path):
    found = painter.simulate("blank", tmp_path / "run", overrides=SHORT)
    assert found.path == tmp_path / "run"
    assert not found.is_complete
    assert found.figures["result"] == "FAULT"
    assert "0.5" in found.figures["cause"]
    assert found.executed.q.shape[1] == 5
    assert painter.Run(found.path).figures == found.figures


def test_overrides_need_a_name_or_a_file():
    with pytest.raises(painter.PainterError, match="overrides: only for a scenario"):
        painter.simulate(painter.Scenario(), overrides=SHORT)


def test_the_command_prints_its_figures_and_fails(tmp_path, capsys):
    words = ["simulate", "blank", *WORDS, "--no-replay", "--json"]
    assert run([*words, "--out", str(tmp_path / "run")]) == 1
    out, err = capsys.readouterr()
    figures = json.loads(out)
    assert figures == json.loads((tmp_path / "run" / "report.json").read_text())
    (line,) = err.splitlines()
    assert line == f"painter: error: FAULT: {figures['cause']} [{figures['code']}]"


def test_an_unknown_scene_is_an_error_object_and_no_folder(tmp_path, capsys):
    words = ["simulate", "blank", "--set", "scene=nowhere", "--json"]
    assert run([*words, "--out", str(tmp_path / "run")]) == 2
    error = json.loads(capsys.readouterr().out)["error"]
    assert error["exit_status"] == 2
    assert "nowhere" in error["message"]
    assert not (tmp_path / "run").exists()
