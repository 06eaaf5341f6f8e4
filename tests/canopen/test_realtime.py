import logging
import os

import pytest

from painter.canopen import realtime


@pytest.fixture
def clock(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(realtime.time, "monotonic", lambda: now[0])
    return now


def test_ticks_come_one_period_apart(clock):
    dut = realtime.Ticker(0.005)
    assert dut.remaining() == pytest.approx(0.005)
    clock[0] = 100.0051
    due, skipped = dut.tick()
    assert (due, skipped) == (pytest.approx(100.005), 0)
    dut.note()
    assert dut.lateness().worst == pytest.approx(1e-4)
    assert dut.remaining() == pytest.approx(0.0049)


def test_ticks_whose_time_has_passed_are_counted_and_skipped(clock):
    dut = realtime.Ticker(0.005)
    clock[0] = 100.0171  # Due at 5; 10 and 15 ms have passed too.
    assert dut.remaining() == 0.0
    due, skipped = dut.tick()
    assert skipped == 2
    assert due == pytest.approx(100.015)
    assert dut.overruns == 2
    assert dut.remaining() == pytest.approx(0.0029)


def test_percentiles_are_those_of_the_lateness(clock):
    dut = realtime.Ticker(1.0)
    for i in range(100):
        clock[0] = 101.0 + i + i * 1e-3
        dut.tick()
        dut.note()
    late = dut.lateness()
    assert late.count == 100
    assert late.p50 == pytest.approx(49.5e-3)
    assert late.worst == pytest.approx(99e-3)


def test_without_the_right_to_fifo_there_is_a_warning(monkeypatch, caplog):
    def refuse(*args):
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    with caplog.at_level(logging.WARNING):
        assert not realtime.use_fifo()
    assert "no SCHED_FIFO" in caplog.text
