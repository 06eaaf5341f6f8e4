import logging
import os
import subprocess
import sys

import pytest

from painter import timebase
from painter.canopen.process import realtime


@pytest.fixture
def clock(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(timebase.time, "monotonic", lambda: now[0])
    return now


def test_ticks_are_one_period_apart(clock):
    dut = realtime.Ticker(0.005)
    # Awake half a millisecond before the tick.
    assert dut.remaining() == pytest.approx(0.0045)
    clock[0] = 100.0051
    due, skipped = dut.tick()
    assert (due, skipped) == (pytest.approx(100.005), 0)
    dut.wait_until_due()
    assert dut.lateness().worst == pytest.approx(1e-4)
    assert dut.remaining() == pytest.approx(0.0044)


def test_ticks_whose_time_has_passed_are_counted_and_skipped(clock):
    dut = realtime.Ticker(0.005)
    clock[0] = 100.0171  # Due at 5; 10 and 15 ms have passed too.
    assert dut.remaining() == 0.0
    due, skipped = dut.tick()
    assert skipped == 2
    assert due == pytest.approx(100.015)
    assert dut.overruns == 2
    assert dut.remaining() == pytest.approx(0.0024)


def test_at_half_the_rate_a_period_takes_the_machine_twice_as_long(clock):
    dut = realtime.Ticker(0.005, timebase.TimeBase(0.5))
    assert dut.remaining() == pytest.approx(0.0095)
    clock[0] = 100.0102
    assert dut.tick() == (pytest.approx(50.005), 0)
    dut.wait_until_due()
    # Lateness is in machine time.
    assert dut.lateness().worst == pytest.approx(2e-4)


def test_an_early_loop_waits_for_the_due_time(monkeypatch):
    now = [100.0]

    def run_on():  # Each look at the clock takes 10 us.
        now[0] += 1e-5
        return now[0]

    monkeypatch.setattr(timebase.time, "monotonic", run_on)
    dut = realtime.Ticker(0.005)
    due = dut.due
    now[0] = due - 0.0004
    assert dut.tick() == (due, 0)
    dut.wait_until_due()
    assert due <= now[0] <= due + 1.5e-5
    assert 0.0 <= dut.lateness().worst <= 1.5e-5


def test_percentiles_are_those_of_the_lateness(clock):
    dut = realtime.Ticker(1.0)
    for i in range(100):
        clock[0] = 101.0 + i + i * 1e-3
        dut.tick()
        dut.wait_until_due()
    late = dut.lateness()
    assert late.count == 100
    assert late.p50 == pytest.approx(49.5e-3)
    assert late.worst == pytest.approx(99e-3)


def test_memory_that_may_not_be_locked_is_no_error():
    # In a process of its own, which may lock nothing.
    code = (
        "import os, resource; "
        "from painter.canopen.process.realtime import lock_memory; "
        "resource.setrlimit(resource.RLIMIT_MEMLOCK, (0, 0)); os.setuid(65534); "
        "raise SystemExit(3 if lock_memory() else 4)"
    )
    if os.getuid() != 0:
        code = code.replace("os.setuid(65534); ", "")
    assert subprocess.run([sys.executable, "-c", code]).returncode == 4


def test_without_the_right_to_fifo_there_is_a_warning(monkeypatch, caplog):
    def deny(*args):
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "sched_setscheduler", deny)
    with caplog.at_level(logging.WARNING):
        assert not realtime.use_fifo()
    assert "no SCHED_FIFO" in caplog.text


def test_processors_are_asked_to_stay_awake_for_as_long_as_it_matters(
    monkeypatch, tmp_path
):
    file = tmp_path / "cpu_dma_latency"
    monkeypatch.setattr(realtime, "WAKE_UP_LATENCY", str(file))
    with realtime.stay_awake() as is_awake:
        assert not is_awake  # No such file: as on a machine that is not Linux.
    file.write_bytes(b"")
    open_before = len(os.listdir("/proc/self/fd"))
    with realtime.stay_awake() as is_awake:
        assert is_awake
        assert file.read_bytes() == b"\0\0\0\0"
        assert len(os.listdir("/proc/self/fd")) == open_before + 1
    assert len(os.listdir("/proc/self/fd")) == open_before


def test_a_niceness_that_may_not_be_had_is_no_error(monkeypatch):
    asked = []

    def deny(*args):
        asked.append(args)
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(os, "setpriority", deny)
    realtime.set_niceness(-18)
    assert asked == [(os.PRIO_PROCESS, 0, -18)]
