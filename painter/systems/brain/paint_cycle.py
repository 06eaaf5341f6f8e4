"""The sequence of a paint cycle: phases, operator, faults."""

import enum
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Self

from pydrake.common.value import Value
from pydrake.systems.framework import (
    BasicVector,
    Context,
    EventStatus,
    LeafSystem,
    State,
)

from painter.systems.ports import EvalAs
from painter.systems.values import (
    ArmStatus,
    CycleStatus,
    FollowerStatus,
    MotionCommand,
    OperatorCommand,
    Phase,
    StageRequest,
    StageResult,
)
from perception.ground import FrozenValue


class Action(enum.Enum):
    """What a step of the sequence does."""

    MOVE = "plans a motion with the motion planner and follows it, if there is one"
    HOLD = "stands still while the camera looks"
    WORK = "asks a stage for its result"
    REVIEW = "waits for the operator's approval"
    PAINT = "follows the paint program"


@dataclass(frozen=True)
class CycleStep:
    """One step: in a phase, an action, and the goal or stage that it names."""

    phase: Phase
    action: Action
    name: str = ""


SEQUENCE = (
    CycleStep(Phase.HOME, Action.MOVE, "home"),
    CycleStep(Phase.LOOK, Action.MOVE, "look"),
    CycleStep(Phase.LOOK, Action.HOLD),
    CycleStep(Phase.LOOK, Action.WORK, "wall_finder"),
    CycleStep(Phase.SCAN, Action.MOVE, "scan"),
    CycleStep(Phase.SCAN, Action.MOVE, "more looks"),
    CycleStep(Phase.SEGMENT, Action.WORK, "wall_segmenter"),
    CycleStep(Phase.PLAN, Action.WORK, "spray_path_planner"),
    CycleStep(Phase.REVIEW, Action.REVIEW),
    CycleStep(Phase.PAINT, Action.PAINT),
    CycleStep(Phase.RETRACT, Action.MOVE, "retract"),
)
# Where the wall is known from before, nothing is looked at.
KNOWN_WALL_SEQUENCE = tuple(
    step
    for step in SEQUENCE
    if step.phase not in (Phase.LOOK, Phase.SCAN) or step.action == Action.WORK
)
PLANNER = "motion_planner"
STAGES = (PLANNER, "wall_finder", "wall_segmenter", "spray_path_planner")


@dataclass(frozen=True, eq=False)
class CycleState(FrozenValue):
    """State of a `PaintCycle`.

    Attributes:
        step: Index in the cycle's sequence.
        since: When the step (or its motion) began, s.
        request: Last request to a stage.
        command: Last command to the path follower.
        moving: True once the step's motion was commanded.
        operator_number: Last operator command acted on.
        pausing: True from the operator's "pause" until "resume".
        status: What the cycle reports.
    """

    step: int = 0
    since: float = 0.0
    request: StageRequest = field(default_factory=StageRequest)
    command: MotionCommand = field(default_factory=MotionCommand)
    moving: bool = False
    operator_number: int = 0
    pausing: bool = False
    status: CycleStatus = field(default_factory=CycleStatus)

    def logged(self, time: float, name: str, **data: Any) -> Self:
        """Returns the state with one more event."""
        events = (*self.status.events, (time, name, data))
        return self.replace(status=self.status.replace(events=events))

    def in_phase(self, phase: Phase, time: float) -> Self:
        """Returns the state in a phase; a change of phase is logged."""
        if phase == self.status.phase and self.status.events:
            return self
        status = self.status.replace(phase=phase)
        return self.replace(status=status).logged(time, "phase", phase=phase.value)

    def asking(self, stage: str, goal: str = "") -> Self:
        """Returns the state with a new request."""
        number = self.request.number + 1
        return self.replace(request=StageRequest(number, stage, goal))

    def with_command(self, **changes: Any) -> Self:
        """Returns the state with a changed motion command."""
        return self.replace(command=self.command.replace(**changes))


class PaintCycle(LeafSystem):
    """Leads the robot through the phases of one paint cycle.

    .. pydrake_system::

        name: PaintCycle
        input_ports:
        - arm_status
        - follower_status
        - motion_planner
        - wall_finder
        - wall_segmenter
        - spray_path_planner
        - operator
        output_ports:
        - request
        - motion_command
        - camera_enabled
        - cycle_status

    Ports:
        arm_status: ArmStatus of the station; a drive that is not operational is a
            fault.
        follower_status: FollowerStatus.
        motion_planner, wall_finder, wall_segmenter, spray_path_planner: StageResult.
        operator: OperatorCommand; may be left unconnected.
        request: StageRequest to the four stages.
        motion_command: MotionCommand to the path follower.
        camera_enabled: (1,) 1 while pictures are wanted.
        cycle_status: CycleStatus.

    A failed stage, a drive fault or the time limit ends the cycle in FAULT: the gun
    closes and the arm comes to a stand on its path. "abort" does the same and then
    retracts. "pause" lets a stroke that is being sprayed end first.
    """

    def __init__(
        self,
        *,
        unattended: bool,
        period: float,
        look_time: float,
        time_limit: float,
        sequence: Sequence[CycleStep] = SEQUENCE,
    ) -> None:
        """Creates the cycle.

        Args:
            unattended: True skips the operator's approval.
            period: Time between decisions, s.
            look_time: How long the arm stands still for first sight, s.
            time_limit: A cycle that lasts longer is a fault, s.
            sequence: Steps of the cycle, the last one the retreat from the wall.
        """
        super().__init__()
        self._unattended = unattended
        self._look_time = look_time
        self._time_limit = time_limit
        self._sequence = tuple(sequence)
        # Inputs.
        self._status_port = self.DeclareAbstractInputPort(
            "arm_status", Value(ArmStatus())
        )
        self._follower_port = self.DeclareAbstractInputPort(
            "follower_status", Value(FollowerStatus())
        )
        self._stage_ports = {
            stage: self.DeclareAbstractInputPort(stage, Value(StageResult()))
            for stage in STAGES
        }
        self._operator_port = self.DeclareAbstractInputPort(
            "operator", Value(OperatorCommand())
        )
        # State.
        self._state_index = self.DeclareAbstractState(Value(CycleState()))
        # Outputs.
        ticket = {self.abstract_state_ticket(self._state_index)}
        for name, value, calc in (
            ("request", StageRequest(), self._CalcRequest),
            ("motion_command", MotionCommand(), self._CalcMotionCommand),
        ):
            self.DeclareAbstractOutputPort(name, lambda v=value: Value(v), calc, ticket)
        self.DeclareVectorOutputPort(
            "camera_enabled", 1, self._CalcCameraEnabled, ticket
        )
        self.DeclareAbstractOutputPort(
            "cycle_status", lambda: Value(CycleStatus()), self._CalcStatus, ticket
        )
        # Events.
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._UpdateCycle)

    def _GetState(self, context: Context) -> CycleState:
        return context.get_abstract_state(int(self._state_index)).get_value()

    def _CalcRequest(self, context: Context, output: Value) -> None:
        output.set_value(self._GetState(context).request)

    def _CalcMotionCommand(self, context: Context, output: Value) -> None:
        output.set_value(self._GetState(context).command)

    def _CalcCameraEnabled(self, context: Context, output: BasicVector) -> None:
        now = self._GetState(context)
        step = self._sequence[now.step]
        looking = step.action == Action.HOLD or (
            step.phase in (Phase.LOOK, Phase.SCAN) and now.moving
        )
        output.SetAtIndex(0, float(looking and now.status.phase == step.phase))

    def _CalcStatus(self, context: Context, output: Value) -> None:
        output.set_value(self._GetState(context).status)

    def _UpdateCycle(self, context: Context, state: State) -> EventStatus:
        before = self._GetState(context)
        if before.status.finished:
            return EventStatus.DidNothing()
        after = self._Next(context, before)
        if after is before:
            return EventStatus.DidNothing()
        state.get_mutable_abstract_state(int(self._state_index)).set_value(after)
        return EventStatus.Succeeded()

    def _Next(self, context: Context, now: CycleState) -> CycleState:
        """Returns the state after one decision."""
        time = context.get_time()
        follower = EvalAs(self._follower_port, context, FollowerStatus)
        phase = now.status.phase
        if phase in (Phase.FAULT, Phase.ABORTED):
            return self._NextStopped(context, now, follower)
        now = self._CountStrokes(now, follower)
        fault = EvalAs(self._status_port, context, ArmStatus).fault
        if fault is None and time > self._time_limit:
            fault = f"cycle not done after {self._time_limit:g} s"
        if fault is not None:
            return self._Stopped(now, Phase.FAULT, fault, time)
        now = self._NextOperator(context, now, time)
        if now.status.phase == Phase.ABORTED:
            return now
        if now.pausing:
            return self._NextPaused(now, follower, time)
        return self._NextStep(context, now, follower)

    def _CountStrokes(self, now: CycleState, follower: FollowerStatus) -> CycleState:
        """Keeps with which stroke the job would go on; the gun closes at once."""
        painting = self._sequence[now.step].action == Action.PAINT and now.moving
        if not painting or follower.number != now.command.number:
            return now
        number = 1.0 + follower.strokes_done
        if number == now.status.next_stroke:
            return now
        return now.replace(status=now.status.replace(next_stroke=number))

    def _NextOperator(
        self, context: Context, now: CycleState, time: float
    ) -> CycleState:
        if not self._operator_port.HasValue(context):
            return now
        command = EvalAs(self._operator_port, context, OperatorCommand)
        if command.number == now.operator_number:
            return now
        now = now.replace(operator_number=command.number)
        now = now.logged(time, "operator", word=command.word)
        step = self._sequence[now.step]
        if command.word == "abort":
            return self._Stopped(now, Phase.ABORTED, "aborted by the operator", time)
        if command.word == "pause":
            return now.replace(pausing=True)
        if command.word == "resume" and now.pausing:
            now = now.replace(pausing=False).with_command(rate=1.0)
            return now.in_phase(step.phase, time)
        if command.word == "approve" and step.action == Action.REVIEW:
            return self._Entered(now, now.step + 1, time)
        return now.logged(time, "refused", word=command.word)

    def _NextPaused(
        self, now: CycleState, follower: FollowerStatus, time: float
    ) -> CycleState:
        # A stroke that is being sprayed ends first: a stop inside it would show.
        if now.command.rate != 0.0 and not (now.moving and follower.spraying):
            now = now.with_command(rate=0.0)
        if now.command.rate == 0.0:
            now = now.in_phase(Phase.PAUSED, time)
        return now

    def _Stopped(
        self, now: CycleState, phase: Phase, cause: str, time: float
    ) -> CycleState:
        now = now.with_command(rate=0.0, spray=False).replace(moving=False, since=time)
        now = now.replace(status=now.status.replace(cause=cause))
        at = now.status.next_stroke
        data = {"cause": cause} | ({"next_stroke": at} if at else {})
        return now.in_phase(phase, time).logged(time, "stopped", **data)

    def _NextStopped(
        self, context: Context, now: CycleState, follower: FollowerStatus
    ) -> CycleState:
        """Waits until the arm stands; after "abort" retracts it as well."""
        finished = now.replace(status=now.status.replace(finished=True))
        if now.moving:
            return finished if self._Arrived(now, follower) else now
        standing = follower.rate == 0.0 or follower.done or follower.number == 0
        if not standing:
            return now
        if now.status.phase == Phase.FAULT:
            return finished
        last = len(self._sequence) - 1
        if now.step != last or now.request.goal != "retract":
            return now.replace(step=last).asking(PLANNER, "retract")
        result = self._Result(context, PLANNER)
        if result.number != now.request.number:
            return now
        if result.error is not None:
            return finished
        return self._Moving(now, result, context.get_time(), spray=False)

    def _NextStep(
        self, context: Context, now: CycleState, follower: FollowerStatus
    ) -> CycleState:
        time = context.get_time()
        step = self._sequence[now.step]
        if now.request.number == 0:
            return self._Entered(now, 0, time)
        if step.action == Action.REVIEW:
            return now
        if step.action == Action.HOLD:
            held = time - now.since >= self._look_time
            return self._Entered(now, now.step + 1, time) if held else now
        if now.moving:
            arrived = self._Arrived(now, follower)
            return self._Entered(now, now.step + 1, time) if arrived else now
        stage = PLANNER if step.action == Action.MOVE else step.name
        if step.action == Action.PAINT:
            program = self._Result(context, "spray_path_planner").value
            result = StageResult(number=now.request.number, value=program.motion)
            return self._Moving(now, result, time, spray=True)
        result = self._Result(context, stage)
        if result.number != now.request.number:
            return now
        if result.error is not None:
            return self._Stopped(now, Phase.FAULT, f"{stage}: {result.error}", time)
        now = now.logged(
            time,
            "stage",
            stage=stage,
            goal=now.request.goal,
            compute_s=result.compute_time,
        )
        if result.warning is not None:
            now = now.logged(time, "warning", stage=stage, warning=result.warning)
        if step.action == Action.MOVE and result.value is not None:
            return self._Moving(now, result, time, spray=False)
        return self._Entered(now, now.step + 1, time)

    def _Entered(self, now: CycleState, index: int, time: float) -> CycleState:
        """Returns the state at the beginning of a step, or at the end of all."""
        if index == len(self._sequence):
            now = now.in_phase(Phase.DONE, time)
            return now.replace(status=now.status.replace(finished=True))
        step = self._sequence[index]
        now = now.replace(step=index, since=time, moving=False).in_phase(
            step.phase, time
        )
        if step.action == Action.MOVE:
            return now.asking(PLANNER, step.name)
        if step.action == Action.WORK:
            return now.asking(step.name)
        if step.action == Action.REVIEW and self._unattended:
            return self._Entered(now, index + 1, time)
        return now

    def _Moving(
        self, now: CycleState, result: StageResult, time: float, *, spray: bool
    ) -> CycleState:
        command = MotionCommand(
            number=now.command.number + 1, motion=result.value, rate=1.0, spray=spray
        )
        return now.replace(command=command, moving=True, since=time)

    def _Arrived(self, now: CycleState, follower: FollowerStatus) -> bool:
        return follower.number == now.command.number and follower.done

    def _Result(self, context: Context, stage: str) -> StageResult:
        return EvalAs(self._stage_ports[stage], context, StageResult)
