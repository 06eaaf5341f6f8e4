"""Follows an arm motion: desired joint state and gun trigger over time."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from pydrake.common.value import Value
from pydrake.systems.framework import (
    BasicVector,
    Context,
    EventStatus,
    State,
)

from painter.errors import MotionLimitError
from painter.planning.arm.kinematics import NQ
from painter.planning.spray_path import Motion
from painter.systems.ports import EvalAs
from painter.systems.value_system import ValueSystem
from painter.systems.values import FollowerStatus, MotionCommand
from perception.ground import FloatArray, FrozenValue

# Largest gap between the arm and the start of a motion; 1 mrad is 2 mm at full
# reach, rad.
START_TOLERANCE = 1e-3


@dataclass(frozen=True, eq=False)
class PathClock(FrozenValue):
    """Time along a motion as a function of the diagram's time.

    The rate of path time ramps linearly: stopping and starting anywhere on a motion
    keeps joint speeds continuous and accelerations near the planned ones.

    Attributes:
        start: Diagram time at which the ramp begins, s.
        origin: Path time there, s.
        rate: Rate there (1 = as planned, 0 = standing, -1 = backing up).
        target: Rate after the ramp.
        ramp: Time of a change of rate by 1, s.
    """

    start: float = 0.0
    origin: float = 0.0
    rate: float = 0.0
    target: float = 0.0
    ramp: float = 0.3

    def at(self, time: float) -> tuple[float, float]:
        """Returns path time (s) and rate at a diagram time (s)."""
        span = abs(self.target - self.rate) * self.ramp
        elapsed = time - self.start
        if elapsed >= span:
            mean = 0.5 * (self.rate + self.target)
            return self.origin + mean * span + self.target * (
                elapsed - span
            ), self.target
        slope = (self.target - self.rate) / span
        rate = self.rate + slope * elapsed
        return self.origin + 0.5 * (self.rate + rate) * elapsed, rate

    def turned_to(self, target: float, time: float) -> Self:
        """Returns the clock that changes to another rate from `time` (s) on."""
        origin, rate = self.at(time)
        return self.replace(start=time, origin=origin, rate=rate, target=target)


@dataclass(frozen=True, eq=False)
class FollowerState(FrozenValue):
    """State of a `PathFollower`.

    Attributes:
        number: Of the motion being followed; 0 = none yet.
        motion: That motion, or None.
        clock: Path time along it.
        sprayed_to: Path time up to which the motion is sprayed, s.
        q_hold: (5,) rad, held without a motion.
    """

    number: int
    motion: Motion | None
    clock: PathClock
    sprayed_to: float
    q_hold: FloatArray


class PathFollower(ValueSystem):
    """Turns a motion command into the arm's desired state and the gun's trigger.

    .. pydrake_system::

        name: PathFollower
        input_ports:
        - motion_command
        - state
        output_ports:
        - desired_state
        - trigger
        - status

    Ports:
        motion_command: MotionCommand.
        state: (10,) measured q, v; rad, rad/s. Read once, at the start, and held.
        desired_state: (10,) q, v; rad, rad/s.
        trigger: (1,) 0 to 1 of the nominal flow. Open only at the planned speed: at any
            other the film would be thicker.
        status: FollowerStatus.

    A motion stopped in a stroke resumes like a cut on a machine tool: the arm backs up
    along its path, and the gun opens again where it closed, at full speed.
    """

    def __init__(self, *, period: float, ramp: float = 0.3) -> None:
        """Creates the follower.

        Args:
            period: Time between checks for a new command, s.
            ramp: Time from planned speed to standstill, s.

        Raises:
            ValueError: A time is not positive.
        """
        super().__init__()
        if not (period > 0.0 and ramp > 0.0):
            raise ValueError(
                f"period and ramp must be > 0 s, got {period!r}, {ramp!r}."
            )
        # Inputs.
        self._command_port = self.DeclareAbstractInputPort(
            "motion_command", Value(MotionCommand())
        )
        self._state_port = self.DeclareVectorInputPort("state", 2 * NQ)
        # State.
        clock = PathClock(ramp=ramp)
        empty = FollowerState(0, None, clock, 0.0, np.zeros(NQ))
        self.DeclareValue(empty)
        # Outputs.
        time_and_state = self.value_tickets | {self.time_ticket()}
        self.DeclareVectorOutputPort(
            "desired_state", 2 * NQ, self._CalcDesiredState, time_and_state
        )
        self.DeclareVectorOutputPort(
            "trigger",
            1,
            self._CalcTrigger,
            time_and_state | {self._command_port.ticket()},
        )
        self.DeclareAbstractOutputPort(
            "status", lambda: Value(FollowerStatus()), self._CalcStatus, time_and_state
        )
        # Events.
        self.DeclareInitializationUnrestrictedUpdateEvent(self._UpdateHold)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._UpdateMotion)

    def _UpdateHold(self, context: Context, state: State) -> EventStatus:
        q = self._state_port.Eval(context)[:NQ]
        return self.SetValue(state, self.GetValue(context).replace(q_hold=q.copy()))

    def _UpdateMotion(self, context: Context, state: State) -> EventStatus:
        command = EvalAs(self._command_port, context, MotionCommand)
        now: FollowerState = self.GetValue(context)
        time = context.get_time()
        if command.number != now.number and command.motion is not None:
            self._CheckStart(context, command.motion)
            # A motion starts at rest, so its time may run at full rate at once.
            clock = now.clock.replace(start=time, origin=0.0, rate=1.0, target=1.0)
            return self.SetValue(
                state,
                FollowerState(command.number, command.motion, clock, 0.0, now.q_hold),
            )
        if now.motion is None:
            return EventStatus.DidNothing()
        clock, motion = now.clock, now.motion
        position, rate = clock.at(time)
        if position >= motion.duration:
            return EventStatus.DidNothing()
        if command.rate == 0.0 and clock.target != 0.0:
            done = position if clock.rate == clock.target == 1.0 else now.sprayed_to
            now = now.replace(sprayed_to=max(now.sprayed_to, done))
            return self.SetValue(state, now.replace(clock=clock.turned_to(0.0, time)))
        if command.rate == 1.0 and clock.target != 1.0 and rate == clock.target:
            # Reach full rate before the point where the gun closed.
            run_up = 0.5 * clock.ramp + 0.1
            missed = motion.sprays_within(now.sprayed_to, position + run_up)
            back = missed and position > max(now.sprayed_to - run_up, clock.ramp)
            target = -1.0 if back else 1.0
            if target != clock.target:
                clock = clock.turned_to(target, time)
                return self.SetValue(state, now.replace(clock=clock))
        return EventStatus.DidNothing()

    def _CheckStart(self, context: Context, motion: Motion) -> None:
        q_v = self.GetOutputPort("desired_state").Eval(context)
        jump = np.abs(motion.q[0] - q_v[:NQ])
        if jump.max() > START_TOLERANCE or np.abs(q_v[NQ:]).max() > START_TOLERANCE:
            name = self.GetSystemPathname()
            raise MotionLimitError(
                f"{name}: a motion starts {jump.max():.4f} rad from "
                f"the arm (joint {jump.argmax() + 1}, speed "
                f"{np.abs(q_v[NQ:]).max():.4f} rad/s); bound {START_TOLERANCE} rad.",
                code="PNT-CYCLE-005",
            )

    def _CalcDesiredState(self, context: Context, output: BasicVector) -> None:
        now: FollowerState = self.GetValue(context)
        if now.motion is None:
            output.SetFromVector(np.concatenate([now.q_hold, np.zeros(NQ)]))
            return
        position, rate = now.clock.at(context.get_time())
        inside = min(max(position, 0.0), now.motion.duration)
        trajectory = now.motion.trajectory
        q = trajectory.value(inside).ravel()
        v = trajectory.EvalDerivative(inside, 1).ravel() * rate
        output.SetFromVector(np.concatenate([q, v]))

    def _CalcTrigger(self, context: Context, output: BasicVector) -> None:
        now: FollowerState = self.GetValue(context)
        command = EvalAs(self._command_port, context, MotionCommand)
        opened = 0.0
        if now.motion is not None and command.spray and command.number == now.number:
            position, rate = now.clock.at(context.get_time())
            if rate == 1.0 and position >= now.sprayed_to:
                opened = now.motion.trigger(position)
        output.SetAtIndex(0, opened)

    def _CalcStatus(self, context: Context, output: Value) -> None:
        now: FollowerState = self.GetValue(context)
        if now.motion is None:
            output.set_value(FollowerStatus())
            return
        position, rate = now.clock.at(context.get_time())
        output.set_value(
            FollowerStatus(
                number=now.number,
                position=position,
                duration=now.motion.duration,
                rate=rate,
                spraying=bool(now.motion.trigger(position)),
                strokes_done=now.motion.strokes_done(max(position, now.sprayed_to)),
            )
        )
