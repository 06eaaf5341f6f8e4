"""Timing of the bus process against simulated drives in another process.

Run `python benchmarks/bench_canopen.py`; SCHED_FIFO needs root or RLIMIT_RTPRIO, else
the loop warns and the figures are those of a plain thread. Five drives and the I/O node
at 200 Hz over a local socket, once alone and once while a process a core multiplies
matrices. Compare figures within one run only.
"""

import dataclasses
import multiprocessing
import os
import tempfile
import time
from multiprocessing.synchronize import Event
from pathlib import Path

import numpy as np

from painter.canopen.bus_config import BusConfig
from painter.canopen.bus_file import load_bus
from painter.canopen.bus_process import BusProcess, Report
from painter.canopen.feedback import Phase
from painter.canopen.realtime import use_fifo
from painter.canopen.setpoints import Setpoint
from painter.canopen.sim.server import RackServer
from painter.resources import models_path

SECONDS = 10.0
AHEAD = 0.1


def main() -> None:
    """Prints the table."""
    print(
        "SYNC lateness, us          p50    p99  p99.9  worst  overruns missing cycles"
    )
    for busy in (False, True):
        report = measure(busy=busy)
        late, counts = report.lateness, report.feedback.statistics
        assert late is not None
        figures = (late.p50, late.p99, late.p999, late.worst)
        name = "all cores busy" if busy else "alone"
        kind = "FIFO" if report.is_fifo else "plain"
        print(
            f"{name:15} {kind:6}",
            *(f"{1e6 * value:6.0f}" for value in figures),
            f"{counts.overruns:9} {counts.missing:7} {counts.cycles:6}",
        )
    print(f"worst-case bus load {100 * counts.load:.1f} % of 1 Mbit/s")


def measure(*, busy: bool) -> Report:
    """Runs bus and drives for some seconds in motion and returns the last report."""
    with tempfile.TemporaryDirectory() as folder:
        bus = load_bus(models_path("bus", "painter.bus.yaml"))
        channel = str(Path(folder) / "can")
        bus = dataclasses.replace(bus, interface="local", channel=channel)
        # Missing TPDOs are counted here: simulated drives share the cores, real do not.
        bus.timeouts = dataclasses.replace(bus.timeouts, tpdo=1.0)
        context = multiprocessing.get_context("spawn")
        done = context.Event()
        helpers = [context.Process(target=run_drives, args=(bus, done))]
        if busy:
            cores = os.cpu_count() or 1
            helpers += [
                context.Process(target=burn, args=(done,)) for _ in range(cores)
            ]
        for helper in helpers:
            helper.start()
        while not Path(channel).exists():
            time.sleep(0.01)
        try:
            return stream(bus)
        finally:
            done.set()
            for helper in helpers:
                helper.join()


def stream(bus: BusConfig) -> Report:
    """Swings all joints by 0.2 rad, pushed ahead every 20 ms, as a diagram would."""
    with BusProcess(bus) as process:
        process.start()
        while (report := process.report()) is None or (
            report.feedback.phase != Phase.ENABLED
        ):
            if report is not None and report.feedback.phase == Phase.STOPPED:
                raise SystemExit(f"no bring-up: {report.feedback.reason}")
            time.sleep(0.01)
        q0, start = report.feedback.q, time.monotonic()
        sent = start + AHEAD
        while time.monotonic() - start < SECONDS:
            points = []
            while sent < time.monotonic() + 2 * AHEAD:
                s = np.pi * (sent - start - AHEAD)
                q = q0 + 0.1 * (1.0 - np.cos(s))
                points.append(Setpoint(sent, q, np.full(5, 0.1 * np.pi * np.sin(s))))
                sent += 0.02
            process.push(points)
            time.sleep(0.02)
        report = process.report()
        assert report is not None
        if report.feedback.phase != Phase.ENABLED:
            print(f"  stopped: {report.feedback.reason}")
        return report


def run_drives(bus: BusConfig, done: Event) -> None:
    """Runs the simulated drives; like real ones, they wait for no other program."""
    use_fifo(50)
    server = RackServer(bus)
    server.run(lambda now: done.is_set())
    server.close()
    times = os.times()
    share = (times.user + times.system) / max(server.rack.now, 1e-3)
    print(f"  drives: {100 * share:.0f} % of a core, {server.slips} slips")


def burn(done: Event) -> None:
    """Keeps a core busy, as segmentation and planning do."""
    matrix = np.random.default_rng(1).random((400, 400))
    while not done.is_set():
        matrix @ matrix


if __name__ == "__main__":
    main()
