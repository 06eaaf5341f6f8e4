"""Runs one paint cycle on the robot at its bus's pace, and keeps its log."""

from collections.abc import Callable
from typing import Unpack

import numpy as np
from pydrake.trajectories import PiecewisePolynomial

from painter.canopen.master.feedback import BusState
from painter.config import Scenario
from painter.cycle.bus_record import Recorder, executions, robot_times
from painter.cycle.cycle_log import CycleLog, GunPoses
from painter.cycle.running_cycle import RunningCycle, Watch
from painter.diagrams.brain import OwnSystems
from painter.diagrams.hardware_station import RobotConnection
from painter.diagrams.paint_cycle import MakePaintCycle
from painter.errors import BusError
from painter.planning.arm.kinematics import NQ
from painter.planning.program.remainder import Remainder
from painter.systems.values import CycleStatus, Fault, Phase

# Time between observations of the cycle, s.
WATCH_PERIOD = 0.02
# If the diagram is further behind than this while the arm stands, its clock stops, s.
BEHIND = 0.02
# Time that a stop may take before the cycle is abandoned, s.
STOP_TIME = 3.0
# With a larger error of its position, the gun paints what was not planned, m.
OFF_COURSE = 0.005
_STILL = 1e-6


def DeployCycle(
    scenario: Scenario,
    connection: RobotConnection,
    *,
    remainder: Remainder | None = None,
    watch: Watch | None = None,
    interruption: Callable[[], str | None] = lambda: None,
    **own: Unpack[OwnSystems],
) -> CycleLog:
    """Runs a paint cycle on a robot until it is finished.

    Args:
        scenario: The job.
        connection: The robot, with its drives enabled.
        remainder: Strokes left to paint on a wall known from an earlier run; None =
            scan the wall and paint all of it.
        watch: Called every WATCH_PERIOD as `SimulateCycle` does.
        interruption: Returns why to stop the arm now, or None; the cycle then ends in
            ABORTED.
        own: Systems of one's own; see `MakePaintCycle`.

    Returns:
        The log of the cycle, whether it reached DONE or not; without film and
        clearances, which only a simulator knows.

    Raises:
        BusError: The drives are not enabled.
    """
    cycle = MakePaintCycle(scenario, connection=connection, remainder=remainder, **own)
    run = RunningCycle(
        cycle, logged={"arm.desired_state": connection.cycle}, watch=watch
    )
    bus, clock, recorder = connection.bus, connection.clock, Recorder(connection.bus)
    clock.start(bus.now())
    run.simulator.Initialize()
    strokes: list[tuple[float, float]] = []
    interrupted, stop_by = None, np.inf
    steps = 0
    while True:
        for _ in range(max(1, round(WATCH_PERIOD / connection.cycle))):
            steps += 1
            _Advance(run, connection, steps * connection.cycle)
        recorder.take()
        status = run.observe()
        strokes.append((run.time, status.next_stroke))
        if interrupted is None:
            interrupted = interruption()
            if interrupted is not None:
                stop_by = run.time + STOP_TIME
                bus.stop(interrupted)
        if status.finished or run.time > stop_by:
            break
    # The last commands are executed a little later.
    bus.wait_until(clock.execution(run.time) + 2.0 * connection.cycle)
    recorder.take()
    log = _Log(run, connection, recorder)
    status = _Corrected(connection, recorder, strokes, log)
    if interrupted is not None and status.phase != Phase.DONE:
        fault = Fault(interrupted, code="PNT-CYCLE-021")
        status = status.aborted(fault, log.end_time)
    return log.replace(status=status)


def _Advance(run: RunningCycle, connection: RobotConnection, time: float) -> None:
    """Advances to a time, one bus cycle on, when the robot's clock reaches it.

    If the arm stood before, its clock stops for a long computation: the first commands
    of the motion planned in it are then still ahead of their time of execution.
    """
    stood = _Stands(run)
    bus, clock = connection.bus, connection.clock
    bus.wait_until(clock.due(time))
    run.simulator.AdvanceTo(time)
    now = bus.now()
    if stood and now - clock.due(time) > BEHIND:
        clock.hold(time, now)


def _Stands(run: RunningCycle) -> bool:
    """Returns whether the arm is commanded to stand with the gun closed."""
    speed = run.evaluate("arm.desired_state")[NQ:]
    return bool(np.abs(speed).max() < _STILL and run.evaluate("gun.trigger")[0] == 0.0)


def _Corrected(
    connection: RobotConnection,
    recorder: Recorder,
    strokes: list[tuple[float, float]],
    log: CycleLog,
) -> CycleStatus:
    """Returns the status with the stroke that the arm, not the diagram, came to.

    Commands wait on the bus: those after a stop are never executed, and those before it
    paint in vain once the gun is off its course.
    """
    status, stopped_at = log.status, recorder.last
    try:
        report = connection.bus.report()
    except BusError:
        report = None
    if report is not None:
        if report.feedback.bus_state == BusState.ENABLED:
            return status
        stopped_at = report.feedback.stopped_at
    stop = connection.clock.diagram_time(stopped_at)
    done = on_course_until(log, stop) - connection.clock.ahead
    times, numbers = np.array(strokes).T
    number = float(np.interp(done, times, numbers))
    if status.next_stroke == 0.0 or number == status.next_stroke:
        return status
    status = status.replace(next_stroke=max(number, 1.0))
    return status.logged(log.end_time, "stopped", **status.stop_data())


def on_course_until(log: CycleLog, stop: float) -> float:
    """Returns until when the gun followed its commands, s.

    Args:
        log: Of a cycle that was stopped.
        stop: When the stop was known, s; the answer if the gun was on its course then.
    """
    error = (log.X_WG - log.X_WG_desired)[log.time <= stop, :3, 3]
    astray = np.linalg.norm(error, axis=1) > OFF_COURSE
    if not astray.size or not astray[-1]:
        return stop
    before = np.flatnonzero(~astray)
    return float(log.time[before[-1]]) if before.size else float(log.time[0])


def _Log(
    run: RunningCycle,
    connection: RobotConnection,
    recorder: Recorder,
) -> CycleLog:
    kinematics = run.cycle.robot.kinematics
    samples, clock = recorder.samples(), connection.clock
    desired = run.vector_log("arm.desired_state")
    time = robot_times(samples.time, clock)
    kept = np.isfinite(time)
    stamps = executions(desired.sample_times(), clock)
    spline = PiecewisePolynomial.CubicHermite(
        stamps, desired.data()[:NQ], desired.data()[NQ:]
    )
    inside = np.clip(samples.time[kept], stamps[0], stamps[-1])
    return run.cycle_log(
        time=time[kept],
        q=samples.q[kept],
        v=samples.v[kept],
        trigger=samples.trigger[kept],
        X_WG=GunPoses(kinematics, samples.q[kept]),
        X_WG_desired=GunPoses(kinematics, spline.vector_values(inside).T),
        clearance_time=np.zeros(0),
        clearance=np.zeros(0),
        floor_clearance=np.zeros(0),
        film=None,
    )
