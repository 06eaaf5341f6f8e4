"""Timing of the bus process against simulated drives in another process.

Run `python -m benchmarks.speed.canopen_timing`; SCHED_FIFO needs root or RLIMIT_RTPRIO,
else the loop warns and the figures are those of a plain thread. Five drives and the I/O
node at 200 Hz over a local socket, once alone and once while another process segments a
wall of 500,000 points and plans its strokes repeatedly. Compare figures within one run
only: before each measurement a loop that only waits shows how late the computer itself
is; on a virtual machine that comes from its host.
"""

import dataclasses
import multiprocessing
import os
import tempfile
import time
from multiprocessing.synchronize import Event
from pathlib import Path

import numpy as np

from painter.canopen.config.bus_config import BusConfig
from painter.canopen.config.bus_file import load_bus
from painter.canopen.master.feedback import BusState
from painter.canopen.master.setpoints import Setpoint
from painter.canopen.process.bus_process import BusProcess, Report
from painter.canopen.process.realtime import Ticker, lock_memory, stay_awake, use_fifo
from painter.canopen.protocol.frames import SYNC_ID
from painter.canopen.sim.server import RackServer
from painter.canopen.wire.candump import read_log
from painter.config import load_scenario
from painter.cycle.true_wall import true_segmentation
from painter.resources import models_path
from painter.robot.planners import MakeProgramPlanner
from perception.segmentation import segment_wall
from perception.synthetic.furnished_wall import TILE, furnished_wall
from perception.values import SurfaceMap

SECONDS = 20.0
POINTS = 500_000
PERIOD = 0.005
AHEAD = 0.1


def main() -> None:
    """Prints the table."""
    print(
        "SYNC lateness, us          p50    p99  p99.9  worst  overruns missing cycles"
    )
    with tempfile.TemporaryDirectory() as folder:
        for busy in (False, True):
            print_bare()
            log = Path(folder) / "bus.log"
            print_row(measure(busy=busy, log=log), log, busy=busy)


def print_bare() -> None:
    """Prints the lateness of a loop that only waits, in a process of its own."""
    context = multiprocessing.get_context("spawn")
    process = context.Process(target=wait_only)
    process.start()
    process.join()


def wait_only() -> None:
    """Waits for ticks as the bus process does, and prints their lateness."""
    kind = "FIFO" if use_fifo() else "plain"
    lock_memory()
    ticker = Ticker(PERIOD)
    with stay_awake():
        for _ in range(round(0.5 * SECONDS / PERIOD)):
            time.sleep(ticker.remaining())
            ticker.tick()
            ticker.wait_until_due()
    late = ticker.lateness()
    print(
        f"{'bare loop':15} {kind:6}",
        *(f"{1e6 * v:6.0f}" for v in (late.p50, late.p99, late.p999, late.worst)),
        f"{ticker.overruns:9}",
        flush=True,
    )


def print_row(report: Report, log: Path, *, busy: bool) -> None:
    """Prints the figures of a run: by the loop, and by the log of sent frames."""
    late, counts = report.lateness, report.feedback.statistics
    assert late is not None
    name = "segmenting" if busy else "alone"
    kind = "FIFO" if report.is_fifo else "plain"
    figures = (late.p50, late.p99, late.p999, late.worst)
    print(
        f"{name:15} {kind:6}",
        *(f"{1e6 * value:6.0f}" for value in figures),
        f"{counts.overruns:9} {counts.missing:7} {counts.cycles:6}",
        f" load {100 * counts.load:.1f} %",
        flush=True,
    )
    print(f"{'':8} by the log   ", *(f"{1e6 * v:6.0f}" for v in lateness_of(log)))


def lateness_of(log: Path) -> tuple[float, ...]:
    """Returns p50, p99, p99.9 and maximum lateness of sent SYNCs, s.

    The reference is a grid of periods at the first percentile of the SYNCs; the first
    second is left out.
    """
    times = [r.time for r in read_log(log) if r.frame.cob_id == SYNC_ID]
    sent = np.array(times) - times[0]
    sent = sent[sent > 1.0]
    # Lateness of up to three quarters of a period above the median is unambiguous.
    usual = np.median(sent % PERIOD)
    late = (sent - usual + PERIOD / 4.0) % PERIOD
    late -= np.percentile(late, 1)
    late[late < -PERIOD / 8.0] += PERIOD
    late = np.maximum(late, 0.0)
    return (*np.percentile(late, (50, 99, 99.9)), float(late.max()))


def measure(*, busy: bool, log: Path) -> Report:
    """Runs bus and drives for some seconds in motion and returns the last report.

    Args:
        busy: Whether another process segments and plans beside them.
        log: Gets all frames, as on the robot.
    """
    with tempfile.TemporaryDirectory() as folder:
        bus = load_bus(models_path("bus", "painter.bus.yaml"))
        channel = str(Path(folder) / "can")
        bus = dataclasses.replace(bus, interface="local", channel=channel)
        # Late frames are counted and must not end the run: simulated drives share the
        # cores, real ones do not.
        bus.timeouts = dataclasses.replace(bus.timeouts, tpdo=1.0, rpdo_cycles=200)
        bus.io = dataclasses.replace(bus.io, deadline=1.0)
        context = multiprocessing.get_context("spawn")
        done = context.Event()
        working = context.Event()
        helpers = [context.Process(target=run_drives, args=(bus, done))]
        if busy:
            helpers.append(context.Process(target=work, args=(working, done)))
        for helper in helpers:
            helper.start()
        while not Path(channel).exists():
            time.sleep(0.01)
        if busy:
            working.wait()
        try:
            return stream(bus, log)
        finally:
            done.set()
            for helper in helpers:
                helper.join()


def stream(bus: BusConfig, log: Path) -> Report:
    """Swings all joints by 0.2 rad, pushed ahead every 20 ms, as a diagram would."""
    with BusProcess(bus, log=log) as process:
        process.start()
        while (report := process.report()) is None or (
            report.feedback.bus_state != BusState.ENABLED
        ):
            if report is not None and report.feedback.bus_state == BusState.STOPPED:
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
        if report.feedback.bus_state != BusState.ENABLED:
            print(f"  stopped: {report.feedback.reason}")
        return report


def run_drives(bus: BusConfig, done: Event) -> None:
    """Runs the simulated drives under SCHED_FIFO: real ones wait for no program."""
    use_fifo(50)
    server = RackServer(bus)
    server.run(lambda now: done.is_set())
    server.close()
    times = os.times()
    share = (times.user + times.system) / max(server.rack.now, 1e-3)
    print(f"  drives: {100 * share:.0f} % of a core, {server.slips} slips")


def work(working: Event, done: Event) -> None:
    """Segments and plans, as the diagram does beside the bus; prints how often."""
    wall = furnished_wall(POINTS, seed=1)
    scenario = load_scenario("cubes")
    planner, truth = MakeProgramPlanner(scenario), true_segmentation(scenario)
    home = np.deg2rad(scenario.motion.home_deg)
    working.set()
    count, start = 0, time.monotonic()
    while not done.is_set():
        segment_wall(
            SurfaceMap.of_points(wall.p_CQs),
            wall.X_CT,
            TILE,
            config=scenario.segmentation,
            seed=1,
        )
        planner.program(planner.strokes(truth), truth, home)
        count += 1
    seconds = (time.monotonic() - start) / count
    print(f"  beside it: {count} times segmented and planned, {seconds:.1f} s each")


if __name__ == "__main__":
    main()
