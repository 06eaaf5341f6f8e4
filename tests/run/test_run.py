"""A run folder as a notebook reads it."""

import json

import numpy as np
import pytest

from painter.errors import InputError
from painter.run.page.report import finish_run
from painter.run.run import Run


@pytest.fixture
def run(full_folder):
    finish_run(full_folder, time=113.0, result="DONE", wall_clock=90.0)
    return Run(full_folder.path)


def test_what_the_run_left_is_there(run, full_folder):
    assert run.is_complete
    assert run.figures == json.loads((full_folder.path / "report.json").read_text())
    assert run.scenario["scene"] == "cubes"
    assert run.map.shape[0] == 3
    assert run.segmentation.wall_mask.shape == run.truth.wall_mask.shape
    assert run.executed.q.shape == (run.executed.time.size, 5)
    assert run.film.thickness.ndim == 2


def test_strokes_are_a_row_each(run):
    pytest.importorskip("pandas")
    table = run.strokes()
    assert len(table) == run.figures["stroke_count"]
    # Strokes are straight: the length is the distance of the ends.
    ends = np.hypot(table.end_x - table.start_x, table.end_y - table.start_y)
    np.testing.assert_allclose(table.length, ends)


def test_events_are_a_row_each_in_order_of_time(run, full_folder):
    pytest.importorskip("pandas")
    table = run.events()
    assert len(table) == len(full_folder.events())
    assert {"time", "phase", "event"} <= set(table.columns)


def test_a_run_that_broke_off_has_what_it_left(started_folder):
    dut = Run(started_folder.path)
    assert not dut.is_complete
    assert dut.figures == {}
    assert dut.segmentation is None and dut.program is None and dut.film is None
    assert "incomplete" in repr(dut)


def test_a_damaged_report_is_named(run):
    (run.path / "report.json").write_text("{")
    with pytest.raises(InputError, match=r"report\.json"):
        _ = Run(run.path).figures


def test_a_folder_that_is_no_run_is_refused(tmp_path):
    with pytest.raises(InputError, match="not a run folder"):
        Run(tmp_path)
