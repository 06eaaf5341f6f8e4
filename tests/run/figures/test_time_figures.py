"""Figures of time, from event logs written by hand."""

import pytest

from painter.run.figures.time_figures import (
    computing_phases,
    phase_times,
    time_figures,
    timing_figures,
)


def phase(time, name):
    return {"time": time, "phase": name}


def stage(time, name, compute):
    return {"time": time, "event": "stage", "stage": name, "compute_s": compute}


LOG = [
    phase(0.0, "HOME"),
    phase(2.0, "LOOK"),
    stage(3.0, "wall_finder", 0.5),
    phase(3.0, "PAINT"),
    phase(13.0, "PAUSED"),
    phase(15.0, "PAINT"),
    stage(16.0, "motion_planner", 0.25),
    phase(20.0, "DONE"),
    {"time": 20.5, "event": "ended", "result": "DONE", "wall_clock_s": 10.0},
]


def test_time_in_phases_adds_up_to_the_motion_time():
    figures = time_figures(LOG)
    assert figures["motion_time_s"] == 20.0
    assert figures["phase_time_s"] == {
        "HOME": 2.0,
        "LOOK": 1.0,
        "PAINT": 15.0,
        "PAUSED": 2.0,
        "DONE": 0.0,
    }


def test_cycle_time_is_motion_and_computing():
    figures = timing_figures(LOG)
    assert figures["compute_time_s"] == pytest.approx(0.75)
    assert figures["cycle_time_s"] == pytest.approx(20.75)
    assert figures["realtime_factor"] == pytest.approx(2.0)
    assert figures["compute_time_by_stage_s"] == {
        "wall_finder": 0.5,
        "motion_planner": 0.25,
    }


def test_computing_belongs_to_the_phase_in_which_it_was_logged():
    assert [name for name, _ in computing_phases(LOG)] == ["LOOK", "PAINT"]


def test_log_that_breaks_off_counts_to_its_end():
    collision = {"time": 1.0, "event": "collision"}
    broken = [*LOG[:3], collision]
    assert phase_times(broken) == {"HOME": 2.0, "LOOK": 1.0}
    assert time_figures(broken)["motion_time_s"] == 3.0
    assert timing_figures(broken)["wall_clock_s"] is None


def test_empty_log_has_no_times():
    assert time_figures([]) == {"motion_time_s": None, "phase_time_s": {}}
    assert timing_figures([])["cycle_time_s"] is None
