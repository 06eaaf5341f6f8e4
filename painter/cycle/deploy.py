"""Runs one paint cycle on the robot at its bus's pace, and keeps what it leaves."""

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput
from pydrake.trajectories import PiecewisePolynomial

from painter.canopen.master.feedback import BusState, Feedback
from painter.canopen.process.robot_clock import RobotClock
from painter.canopen.process.sample_ring import Samples
from painter.config import Scenario
from painter.cycle.cycle_log import CycleLog, GunPoses
from painter.cycle.simulate import Evaluate, Watch
from painter.diagrams.hardware_station import RobotConnection
from painter.diagrams.paint_cycle import MakePaintCycle, PaintCycleDiagram
from painter.errors import BusError
from painter.planning.arm.kinematics import NQ
from painter.planning.program.remainder import Remainder
from painter.systems.values import CycleStatus, OperatorCommand, Phase
from perception.ground import FloatArray

# Time between looks at the cycle from outside, s.
WATCH_PERIOD = 0.02
# Further behind than this while the arm stands, the diagram's clock is stopped, s.
BEHIND = 0.02
# How long a stop may take until the cycle is given up, s.
STOP_TIME = 3.0
# Farther from where it is commanded to be, the gun paints what nobody planned, m.
OFF_COURSE = 0.005
_STILL = 1e-6


class Recorder:
    """What the bus measured over a cycle, and which commands it had."""

    def __init__(self, connection: RobotConnection) -> None:
        """Begins with what is measured from now on."""
        self._connection = connection
        self._last = connection.bus.now()
        self._parts: list[Samples] = []

    def take(self) -> None:
        """Takes what is new."""
        new = self._connection.bus.samples(self._last)
        if new.time.size:
            self._parts.append(new)
            self._last = float(new.time[-1])

    @property
    def last(self) -> float:
        """When the last sample was taken, s on the bus's clock."""
        return self._last

    def samples(self) -> Samples:
        """Returns all of it."""
        parts = self._parts or [self._connection.bus.samples(self._last)]
        return Samples(
            time=np.concatenate([part.time for part in parts]),
            q=np.concatenate([part.q for part in parts]),
            v=np.concatenate([part.v for part in parts]),
            trigger=np.concatenate([part.trigger for part in parts]),
        )


def DeployCycle(
    scenario: Scenario,
    connection: RobotConnection,
    *,
    remainder: Remainder | None = None,
    watch: Watch | None = None,
    interruption: Callable[[], str | None] = lambda: None,
) -> CycleLog:
    """Runs a paint cycle on a body until it is finished.

    Args:
        scenario: The job.
        connection: The robot, with its drives enabled.
        remainder: What is left to do on a wall that was seen before; None = look at
            the wall and paint all of it.
        watch: Called every WATCH_PERIOD as `SimulateCycle` does.
        interruption: Says why the arm shall stop now, or None.

    Returns:
        What the cycle left, whether it came to DONE or not; no film and no clearances,
        which only a simulator knows.

    Raises:
        BusError: The drives are not enabled.
    """
    cycle = MakePaintCycle(scenario, connection=connection, remainder=remainder)
    builder = DiagramBuilder()
    builder.AddNamedSystem("paint_cycle", cycle.diagram)
    commands = LogVectorOutput(
        cycle.diagram.GetOutputPort("arm.desired_state"), builder, connection.cycle
    )
    builder.ExportInput(cycle.diagram.GetInputPort("operator"), "operator")
    root = builder.Build()
    simulator = Simulator(root)
    context = simulator.get_mutable_context()
    said = OperatorCommand()
    root.GetInputPort("operator").FixValue(context, said)
    bus, clock, recorder = connection.bus, connection.clock, Recorder(connection)
    clock.start(bus.now())
    simulator.Initialize()
    strokes: list[tuple[float, float]] = []
    look_image, stop_by = None, np.inf
    steps, time = 0, 0.0
    while True:
        for _ in range(max(1, round(WATCH_PERIOD / connection.cycle))):
            steps += 1
            time = steps * connection.cycle
            _Advance(simulator, cycle, connection, time)
        recorder.take()
        status: CycleStatus = Evaluate(cycle, context, "cycle_status")
        strokes.append((time, status.next_stroke))
        if watch is not None:
            word = watch(time, status, Evaluate(cycle, context, "follower_status"))
            if word is not None:
                said = OperatorCommand(number=said.number + 1, word=word)
                root.GetInputPort("operator").FixValue(context, said)
        if look_image is None and status.phase == Phase.SCAN:
            look_image = Evaluate(cycle, context, "wall_camera.color_image").data.copy()
        reason = interruption()
        if reason is not None and stop_by == np.inf:
            stop_by = time + STOP_TIME
            bus.stop(reason)
        if status.finished or time > stop_by:
            break
    # What was commanded is carried out a little later.
    bus.wait_until(clock.execution(context.get_time()) + 2.0 * connection.cycle)
    recorder.take()
    log = _MakeLog(
        cycle, context, status, look_image,
        samples=recorder.samples(), clock=clock, desired=commands.FindLog(context),
    )  # fmt: skip
    return dataclasses.replace(
        log, status=_Corrected(connection, recorder, strokes, log)
    )


def _Advance(
    simulator: Simulator,
    cycle: PaintCycleDiagram,
    connection: RobotConnection,
    time: float,
) -> None:
    """Goes on to a time, one bus cycle on, when the robot's clock comes to it.

    Where the arm stood before, its clock stops for what took long: the first commands
    of a motion that was planned meanwhile are still ahead of their time.
    """
    stood = _Stands(cycle, simulator.get_context())
    connection.bus.wait_until(connection.clock.due(time))
    simulator.AdvanceTo(time)
    now = connection.bus.now()
    if stood and now - connection.clock.due(time) > BEHIND:
        connection.clock.hold(time, now)


def _Stands(cycle: PaintCycleDiagram, context: Context) -> bool:
    """Whether nothing moves and nothing sprays, as far as commands go."""
    desired = Evaluate(cycle, context, "arm.desired_state")
    trigger = Evaluate(cycle, context, "gun.trigger")
    return bool(np.abs(desired[NQ:]).max() < _STILL and trigger[0] == 0.0)


def _Corrected(
    connection: RobotConnection,
    recorder: Recorder,
    strokes: list[tuple[float, float]],
    log: CycleLog,
) -> CycleStatus:
    """Returns the status with the stroke that the arm, not the diagram, came to.

    Commands wait on the bus; those after a stop are never carried out, and those before
    it in vain once the gun was off its course.
    """
    status, stopped_at = log.status, recorder.last
    try:
        report = connection.bus.report()
        feedback: Feedback | None = None if report is None else report.feedback
    except BusError:
        feedback = None
    if feedback is not None:
        if feedback.bus_state == BusState.ENABLED:
            return status
        stopped_at = feedback.stopped_at
    stop = connection.clock.diagram_time(stopped_at)
    done = on_course_until(log, stop) - connection.clock.ahead
    times, numbers = np.array(strokes).T
    number = float(np.interp(done, times, numbers))
    if status.next_stroke == 0.0 or number == status.next_stroke:
        return status
    data = {"cause": status.cause, "next_stroke": max(number, 1.0)}
    return status.replace(
        next_stroke=data["next_stroke"],
        events=(*status.events, (log.end_time, "stopped", data)),
    )


def on_course_until(log: CycleLog, stop: float) -> float:
    """Returns until when the gun was where it was commanded to be, s.

    Args:
        log: Of a cycle that was stopped.
        stop: When the stop was known, s; that time if the gun was on its course then.
    """
    error = (log.X_WG - log.X_WG_desired)[log.time <= stop, :3, 3]
    astray = np.linalg.norm(error, axis=1) > OFF_COURSE
    if not astray.size or not astray[-1]:
        return stop
    before = np.flatnonzero(~astray)
    return float(log.time[before[-1]]) if before.size else float(log.time[0])


def _MakeLog(
    cycle: PaintCycleDiagram,
    context: Context,
    status: CycleStatus,
    look_image: Any,
    *,
    samples: Samples,
    clock: RobotClock,
    desired: Any,
) -> CycleLog:
    kinematics = cycle.robot.kinematics
    time = robot_times(samples.time, clock)
    kept = np.isfinite(time)
    stamps = executions(desired.sample_times(), clock)
    spline = PiecewisePolynomial.CubicHermite(
        stamps, desired.data()[:NQ], desired.data()[NQ:]
    )
    inside = np.clip(samples.time[kept], stamps[0], stamps[-1])
    return CycleLog(
        status=status,
        end_time=context.get_time(),
        time=time[kept],
        q=samples.q[kept],
        v=samples.v[kept],
        trigger=samples.trigger[kept],
        X_WG=GunPoses(kinematics, samples.q[kept]),
        X_WG_desired=GunPoses(kinematics, spline.vector_values(inside).T),
        clearance_time=np.zeros(0),
        clearance=np.zeros(0),
        floor_clearance=np.zeros(0),
        surface_map=Evaluate(cycle, context, "surface_map"),
        segmentation=Evaluate(cycle, context, "segmentation").value,
        program=Evaluate(cycle, context, "program").value,
        film=None,
        look_image=look_image,
    )


def robot_times(bus_times: FloatArray, clock: RobotClock) -> FloatArray:
    """Returns the robot's times, s, of moments on the bus's clock.

    Args:
        bus_times: (n,) s, increasing.
        clock: Of the cycle.

    Returns:
        (n,) s; NaN while the robot's clock stood still, and before it ran.
    """
    times = np.full(bus_times.shape, np.nan)
    starts = np.array([start for start, _ in clock.stops])
    for k, (start, offset) in enumerate(clock.stops):
        end = starts[k + 1] if k + 1 < starts.size else np.inf
        here = bus_times - offset
        inside = (here >= start) & (here < end)
        times[inside] = here[inside]
    return times


def executions(times: FloatArray, clock: RobotClock) -> FloatArray:
    """Returns when commands of the diagram's times (n,), s, were carried out, s."""
    starts, offsets = np.array(clock.stops).T
    index = np.searchsorted(starts, times, side="right") - 1
    return times + offsets[np.maximum(index, 0)] + clock.ahead
