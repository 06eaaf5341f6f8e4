"""Every fault while the robot paints at 0.5 m/s: it stops, closes the gun, says why.

Brain, station, master, frames, drives and the arm's plant run in simulated time. The
tip is where forward kinematics puts it for the plant's true joints.
"""

from dataclasses import dataclass, field

import numpy as np
import pytest

from painter.canopen.master.feedback import BusState
from painter.canopen.sim.faults import Fault
from painter.cycle.deploy import DeployCycle
from painter.cycle.true_wall import true_segmentation
from painter.planning.program.program import strokes_from
from painter.planning.program.remainder import Remainder
from painter.planning.spray_path import Stroke
from painter.robot.robot_model import MakeRobotModel
from painter.systems.values import Phase
from tests.hil import Loop, small_scenario

SPEED = 0.5
CYCLE = 0.005
TRAVEL = 0.020
# When the second stroke has been sprayed for so long, the fault happens, s.
INTO_STROKE = 0.4

pytestmark = [pytest.mark.slow, pytest.mark.timeout(1800)]


class ProgramKilledError(Exception):
    """Stands for the end of the process that the diagram runs in."""


@dataclass
class Witness:
    """Looks at the truth every millisecond and makes the fault happen.

    Attributes:
        strike: Called once, in the middle of the second stroke.
        time: s.
        p_WG: Tip, m.
        struck: When the fault happened, s.
        stopped: When the master, if there still is one, knew of it, s.
        closed: When the valve closed for the last time, s.
    """

    strike: object
    kinematics: object
    time: list = field(default_factory=list)
    q: list = field(default_factory=list)
    struck: float | None = None
    stopped: float | None = None
    opened: list = field(default_factory=list)
    closed: float = 0.0
    was_open: bool = False

    def __call__(self, loop):
        now = loop.rack.now
        is_open = loop.trigger > 0.0
        if is_open != self.was_open:
            if is_open:
                self.opened.append(now)
            else:
                self.closed = now
            self.was_open = is_open
        self.time.append(now)
        self.q.append(loop.load.state[:5])
        if self.struck is None:
            second = len(self.opened) == 2 and now >= self.opened[1] + INTO_STROKE
            if second:
                self.struck = now
                self.strike(loop)
        elif self.stopped is None:
            master = loop.bus.master
            self.stopped = now if master is not None and master.reason else None

    def tips(self):
        _, p_WG = self.kinematics.gun_poses(np.array(self.q))
        return np.array(self.time), p_WG


def job():
    """Three strokes on a wall that is known, 0.5 m long."""
    scenario = small_scenario("raster.cut_in=false")
    ends = [(0.05, 0.55), (0.55, 0.05), (0.05, 0.55)]
    strokes = tuple(
        Stroke(
            start_T=np.array([x, start]),
            end_T=np.array([x, end]),
            speed=SPEED,
            kind="body",
            column=column,
        )
        for column, (x, (start, end)) in enumerate(
            zip((0.2, 0.35, 0.5), ends, strict=True)
        )
    )
    return scenario, Remainder(true_segmentation(scenario), strokes)


def paint(strike, *, on_watch=lambda loop: None, interruption=lambda: None):
    """Paints until the fault has ended the cycle; returns loop, witness and log."""
    scenario, remainder = job()
    loop = Loop(scenario, world=False).bring_up()
    witness = Witness(strike, MakeRobotModel(scenario).kinematics)
    loop.observers.append(witness)
    log = None
    try:
        log = DeployCycle(
            scenario,
            loop.connection(),
            remainder=remainder,
            watch=lambda *args: on_watch(loop),
            interruption=interruption,
        )
    except ProgramKilledError:
        # What BusLoop does when the pipe of the diagram's side ends.
        loop.bus.stop("the program that commands the arm has ended.")
    loop.bus.wait_until(loop.bus.now() + 1.5)
    return loop, witness, log


def check_stop(loop, witness, *, knows_within, closes_within):
    """Arm stopped within TRAVEL of detection, gun closed, and nothing moves after."""
    assert witness.struck is not None, "the second stroke was not come to"
    detected = witness.struck if witness.stopped is None else witness.stopped
    assert detected - witness.struck <= knows_within
    assert not witness.was_open
    assert witness.closed - detected <= closes_within + 1e-9
    time, p_WG = witness.tips()
    before = (time > witness.struck - 0.1) & (time <= witness.struck)
    speed = np.linalg.norm(np.diff(p_WG[before], axis=0), axis=1) / 1e-3
    assert np.median(speed) == pytest.approx(SPEED, rel=0.05)
    after = p_WG[time >= detected]
    travel = np.linalg.norm(after - after[0], axis=1).max()
    assert travel <= TRAVEL
    last = p_WG[time >= time[-1] - 0.5]
    assert np.ptp(last, axis=0).max() < 1e-4
    print(
        f"known after {1e3 * (detected - witness.struck):.0f} ms, gun closed after "
        f"{1e3 * (witness.closed - detected):.0f} ms, travel {1e3 * travel:.1f} mm"
    )


def true_stroke_number(witness, remainder, moment):
    """Number of the stroke and share at which the tip truly was at a moment, s."""
    time, p_WG = witness.tips()
    tip = p_WG[np.searchsorted(time, moment)]
    y = (remainder.segmentation.X_WT.inverse() @ tip)[1]
    stroke = remainder.strokes[1]
    start, end = stroke.start_T[1], stroke.end_T[1]
    return 2.0 + (y - start) / (end - start)


def acknowledge(loop):
    """Acknowledges the stop; returns what the bring-up came to."""
    loop.bus.acknowledge()
    while (report := loop.bus.report().feedback).bus_state == BusState.STARTING:
        loop.bus.wait_until(loop.bus.now() + 0.05)
    return report


def go_on(loop, log):
    """Ends the fault, acknowledges, and does the rest of the job from there."""
    loop.rack.clear()
    loop.unplugged = False
    loop.bus.wait_until(loop.bus.now() + 0.5)
    assert loop.bus.report().feedback.bus_state == BusState.STOPPED
    report = acknowledge(loop)
    assert report.bus_state == BusState.ENABLED, report.reason
    scenario, remainder = job()
    rest = strokes_from(remainder.strokes, log.status.next_stroke)
    assert len(rest) == 2
    left = DeployCycle(
        scenario, loop.connection(), remainder=Remainder(remainder.segmentation, rest)
    )
    assert left.status.phase == Phase.DONE, left.status.cause


# Fault, axis, cause, within which time it is known, within which the gun closes.
FAULTS = [
    (Fault.EMCY, "elbow_pitch", "elbow_pitch: EMCY 3220h", 0.005, CYCLE),
    # 0.05 rad at 0.9 rad/s of the shoulder, and the 10 ms that it must last.
    (Fault.FOLLOWING_ERROR, "shoulder_pitch", "8611h, following error", 0.15, CYCLE),
    (Fault.HEARTBEAT_LOST, "wrist_left", "wrist_left: no TPDO", 0.03, CYCLE),
    (Fault.NODE_RESET, "shoulder_pitch", "unexpected boot-up", 0.03, CYCLE),
    (Fault.TPDO_SILENT, "wrist_right", "wrist_right: no TPDO", 0.03, CYCLE),
    (Fault.ESTOP, "base_yaw", "e-stop: the chain is open", 0.01, CYCLE),
    # Nothing can be sent any more: the I/O node closes a cycle after the last word.
    (Fault.BUS_OFF, "base_yaw", "bus-off", 0.005, CYCLE),
    (Fault.INTERFACE_DOWN, "base_yaw", "interface is down", 0.005, CYCLE),
]


@pytest.mark.parametrize(("fault", "axis", "cause", "known", "closed"), FAULTS)
def test_a_fault_while_painting(fault, axis, cause, known, closed):
    loop, witness, log = paint(lambda loop: loop.rack.inject(fault, axis))
    check_stop(loop, witness, knows_within=known, closes_within=closed)
    assert log.status.phase == Phase.FAULT
    assert cause in log.status.cause
    assert log.status.code == "PNT-CYCLE-020"
    _, remainder = job()
    # A blocked axis leads the gun astray long before the drive's window is full.
    is_astray = fault == Fault.FOLLOWING_ERROR
    until = witness.struck if is_astray else witness.closed
    true_number = true_stroke_number(witness, remainder, until)
    # A centimetre and a half of the stroke for what is noticed late and the valve's own
    # edge, and OFF_COURSE.
    assert log.status.next_stroke == pytest.approx(true_number, abs=0.03 + 0.01)
    go_on(loop, log)


def test_the_interface_is_down_for_a_moment_while_painting():
    def blink(loop):
        loop.rack.inject(Fault.INTERFACE_DOWN)
        up = loop.rack.now + 0.3
        loop.observers.append(
            lambda loop: vars(loop.rack.transport).update(is_down=loop.rack.now < up)
        )

    loop, witness, log = paint(blink)
    check_stop(loop, witness, knows_within=0.005, closes_within=CYCLE)
    assert "interface is down" in log.status.cause
    # The bus is back, and the arm stays where it is until somebody says so.
    assert not loop.bus.master.is_lost
    assert not witness.was_open
    loop.observers.pop()
    go_on(loop, log)


# What a bring-up must refuse is only seen in one: the drive reboots while painting.
REFUSED = [
    (Fault.SDO_ABORT, "607Dh:1"),
    (Fault.WRONG_IDENTITY, "wrong device"),
    (Fault.WRONG_UNIT, "608Fh"),
]


@pytest.mark.parametrize(("fault", "cause"), REFUSED)
def test_a_drive_that_is_another_after_a_reset_while_painting(fault, cause):
    def exchange(loop):
        loop.rack.inject(fault, "elbow_pitch")
        loop.rack.inject(Fault.NODE_RESET, "elbow_pitch")

    loop, witness, log = paint(exchange)
    check_stop(loop, witness, knows_within=0.03, closes_within=CYCLE)
    assert "elbow_pitch: unexpected boot-up" in log.status.cause
    before = witness.q[-1]
    report = acknowledge(loop)
    assert report.bus_state == BusState.STOPPED
    assert "elbow_pitch" in report.reason
    assert cause in report.reason
    assert not witness.was_open
    assert np.abs(witness.q[-1] - before).max() < 1e-3
    go_on(loop, log)


def test_a_killed_bus_process_while_painting():
    loop, witness, log = paint(lambda loop: loop.bus.kill())
    check_stop(loop, witness, knows_within=0.0, closes_within=CYCLE)
    assert log.status.phase == Phase.FAULT
    assert "the bus process has ended" in log.status.cause
    _, remainder = job()
    true_number = true_stroke_number(witness, remainder, witness.closed)
    assert log.status.next_stroke == pytest.approx(true_number, abs=0.03)


def test_a_killed_diagram_while_painting():
    struck = []

    def die(loop):
        if struck:
            raise ProgramKilledError

    loop, witness, log = paint(struck.append, on_watch=die)
    # Between two looks of the test's; the bus looks at the pipe each cycle.
    check_stop(loop, witness, knows_within=0.025, closes_within=CYCLE)
    assert log is None
    assert (
        "the program that commands the arm has ended"
        in loop.bus.report().feedback.reason
    )


def test_an_interruption_while_painting():
    struck = []
    loop, witness, log = paint(
        struck.append, interruption=lambda: "Ctrl-C" if struck else None
    )
    # Between two observations of the cycle.
    check_stop(loop, witness, knows_within=0.025, closes_within=CYCLE)
    assert (log.status.phase, log.status.cause) == (Phase.ABORTED, "Ctrl-C")
    assert log.status.code == "PNT-CYCLE-021"
    assert log.status.events[-1][2] == {"phase": "ABORTED"}
    go_on(loop, log)


def test_an_unplugged_camera_while_painting():
    def unplug(loop):
        loop.unplugged = True

    loop, witness, log = paint(unplug)
    check_stop(loop, witness, knows_within=0.1, closes_within=CYCLE)
    assert log.status.phase == Phase.FAULT
    assert "camera: it was unplugged" in log.status.cause
    assert log.status.code == "PNT-CYCLE-019"
    go_on(loop, log)


def test_a_stopped_job_goes_on_where_the_gun_closed():
    _, witness, log = paint(lambda loop: loop.rack.inject(Fault.ESTOP))
    scenario, remainder = job()
    rest = strokes_from(remainder.strokes, log.status.next_stroke)
    assert len(rest) == 2
    loop = Loop(scenario, world=False).bring_up()
    after = Witness(lambda loop: None, witness.kinematics)
    loop.observers.append(after)
    left = DeployCycle(
        scenario,
        loop.connection(),
        remainder=Remainder(remainder.segmentation, rest),
    )
    assert left.status.phase == Phase.DONE
    X_TW = remainder.segmentation.X_WT.inverse()
    ends = []
    for look, moment in ((witness, witness.closed), (after, after.opened[0])):
        time, p_WG = look.tips()
        ends.append((X_TW @ p_WG[np.searchsorted(time, moment)])[1])
    # Seam between what was painted before and what is painted now, along the wall.
    assert abs(ends[0] - ends[1]) < 0.015
