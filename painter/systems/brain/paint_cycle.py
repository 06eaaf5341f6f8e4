"""The sequence of a paint cycle: phases, operator, faults."""

from collections.abc import Sequence

from pydrake.systems.framework import (
    Context,
    EventStatus,
    State,
)

from painter.planning.spray_path import Motion
from painter.systems.cycle_state import SEQUENCE, Action, CycleState, CycleStep
from painter.systems.ports import DeclareInputs, EvalAs
from painter.systems.stage import STAGES
from painter.systems.value_system import ValueSystem
from painter.systems.values import (
    ArmStatus,
    Fault,
    FollowerStatus,
    MotionCommand,
    OperatorCommand,
    Phase,
    StageResult,
)

PLANNER = "motion_planner"


class PaintCycle(ValueSystem):
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
        camera_enabled: (1,) 1 while pictures are to be fused.
        cycle_status: CycleStatus.

    A failed stage, a stage's answer of another type, a drive fault or the time limit
    ends the cycle in FAULT: the gun closes and the arm stops on its path. "abort" does
    the same and then retracts. "pause" waits for the end of the stroke in progress.
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
            look_time: How long the arm holds still for the first pictures, s.
            time_limit: A cycle that lasts longer is a fault, s.
            sequence: Steps of the cycle, the last one the retreat from the wall.
        """
        super().__init__()
        self._unattended = unattended
        self._look_time = look_time
        self._time_limit = time_limit
        self._sequence = tuple(sequence)
        # Inputs.
        self._ports = DeclareInputs(
            self,
            {
                "arm_status": ArmStatus(),
                "follower_status": FollowerStatus(),
                **dict.fromkeys(STAGES, StageResult()),
                "operator": OperatorCommand(),
            },
        )
        # State.
        self.DeclareValue(CycleState())
        # Outputs.
        self.DeclareValueOutput("request", lambda now: now.request)
        self.DeclareValueOutput("motion_command", lambda now: now.command)
        self.DeclareValueVector("camera_enabled", 1, self._CameraEnabled)
        self.DeclareValueOutput("cycle_status", lambda now: now.status)
        # Events.
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._UpdateCycle)

    def _CameraEnabled(self, now: CycleState) -> list[bool]:
        step = self._sequence[now.step]
        looking = step.action == Action.HOLD or (
            step.phase in (Phase.LOOK, Phase.SCAN) and now.moving
        )
        return [looking and now.status.phase == step.phase]

    def _UpdateCycle(self, context: Context, state: State) -> EventStatus:
        before: CycleState = self.GetValue(context)
        if before.status.finished:
            return EventStatus.DidNothing()
        after = self._Next(context, before)
        if after is before:
            return EventStatus.DidNothing()
        return self.SetValue(state, after)

    def _Next(self, context: Context, now: CycleState) -> CycleState:
        """Returns the state after one decision."""
        time = context.get_time()
        follower = EvalAs(self._ports["follower_status"], context, FollowerStatus)
        if now.status.phase in (Phase.FAULT, Phase.ABORTED):
            return self._NextStopped(context, now, follower)
        now = self._CountStrokes(now, follower)
        fault = EvalAs(self._ports["arm_status"], context, ArmStatus).fault
        if fault is None and time > self._time_limit:
            cause = f"cycle not done after {self._time_limit:g} s"
            fault = Fault(cause, code="PNT-CYCLE-015")
        if fault is not None:
            return self._Stopped(now, Phase.FAULT, fault, time)
        now = self._NextOperator(context, now, time)
        if now.status.phase == Phase.ABORTED:
            return now
        if now.pausing:
            return self._NextPaused(now, follower, time)
        return self._NextStep(context, now, follower)

    def _CountStrokes(self, now: CycleState, follower: FollowerStatus) -> CycleState:
        """Records the stroke at which the job would continue if it stopped now."""
        painting = self._sequence[now.step].action == Action.PAINT and now.moving
        if not painting or follower.number != now.command.number:
            return now
        number = 1.0 + follower.strokes_done
        if number == now.status.next_stroke:
            return now
        return now.reporting(next_stroke=number)

    def _NextOperator(
        self, context: Context, now: CycleState, time: float
    ) -> CycleState:
        if not self._ports["operator"].HasValue(context):
            return now
        operator = EvalAs(self._ports["operator"], context, OperatorCommand)
        if operator.number == now.operator_number:
            return now
        command = operator.command
        now = now.replace(operator_number=operator.number)
        now = now.logged(time, "operator", command=command)
        step = self._sequence[now.step]
        if command == "abort":
            fault = Fault("aborted by the operator", code="PNT-CYCLE-016")
            return self._Stopped(now, Phase.ABORTED, fault, time)
        if command == "pause":
            return now.replace(pausing=True)
        if command == "resume" and now.pausing:
            now = now.replace(pausing=False).with_command(rate=1.0)
            return now.in_phase(step.phase, time)
        if command == "approve" and step.action == Action.REVIEW:
            return self._Entered(now, now.step + 1, time)
        return now.logged(time, "refused", command=command)

    def _NextPaused(
        self, now: CycleState, follower: FollowerStatus, time: float
    ) -> CycleState:
        # The stroke in progress ends first: a stop inside it would show in the film.
        if now.command.rate != 0.0 and not (now.moving and follower.spraying):
            now = now.with_command(rate=0.0)
        if now.command.rate == 0.0:
            now = now.in_phase(Phase.PAUSED, time)
        return now

    def _Stopped(
        self, now: CycleState, phase: Phase, fault: Fault, time: float
    ) -> CycleState:
        now = now.with_command(rate=0.0, spray=False).replace(moving=False, since=time)
        now = now.reporting(cause=fault.cause, code=fault.code)
        now = now.in_phase(phase, time)
        return now.logged(time, "stopped", **now.status.stop_data())

    def _NextStopped(
        self, context: Context, now: CycleState, follower: FollowerStatus
    ) -> CycleState:
        """Waits until the arm stands; after "abort" retracts it as well."""
        finished = now.reporting(finished=True)
        if now.moving:
            return finished if self._Arrived(now, follower) else now
        standing = follower.rate == 0.0 or follower.done or follower.number == 0
        if not standing:
            return now
        if now.status.phase == Phase.FAULT:
            return finished
        last = len(self._sequence) - 1
        if now.step != last or now.request.goal != "retract":
            return now.replace(step=last).requesting(PLANNER, "retract")
        result = self._Result(context, PLANNER)
        if result.number != now.request.number:
            return now
        if self._Failure(PLANNER, result) is not None:
            return finished
        return self._Moving(now, result.value, context.get_time(), spray=False)

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
        if step.action == Action.PAINT:
            program = self._Result(context, "spray_path_planner").value
            return self._Moving(now, program.motion, time, spray=True)
        stage = PLANNER if step.action == Action.MOVE else step.name
        result = self._Result(context, stage)
        if result.number != now.request.number:
            return now
        failure = self._Failure(stage, result)
        if failure is not None:
            return self._Stopped(now, Phase.FAULT, failure, time)
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
            return self._Moving(now, result.value, time, spray=False)
        return self._Entered(now, now.step + 1, time)

    def _Entered(self, now: CycleState, index: int, time: float) -> CycleState:
        """Returns the state at the beginning of a step, or at the end of all."""
        if index == len(self._sequence):
            return now.in_phase(Phase.DONE, time).reporting(finished=True)
        step = self._sequence[index]
        now = now.replace(step=index, since=time, moving=False).in_phase(
            step.phase, time
        )
        if step.action == Action.MOVE:
            return now.requesting(PLANNER, step.name)
        if step.action == Action.WORK:
            return now.requesting(step.name)
        if step.action == Action.REVIEW and self._unattended:
            return self._Entered(now, index + 1, time)
        return now

    def _Moving(
        self, now: CycleState, motion: Motion, time: float, *, spray: bool
    ) -> CycleState:
        command = MotionCommand(
            number=now.command.number + 1, motion=motion, rate=1.0, spray=spray
        )
        return now.replace(command=command, moving=True, since=time)

    def _Arrived(self, now: CycleState, follower: FollowerStatus) -> bool:
        return follower.number == now.command.number and follower.done

    def _Result(self, context: Context, stage: str) -> StageResult:
        return EvalAs(self._ports[stage], context, StageResult)

    def _Failure(self, stage: str, result: StageResult) -> Fault | None:
        """Returns why a result cannot be used, or None."""
        if result.error is not None:
            return Fault(
                f"{stage}: {result.error}", code=result.code or "PNT-CYCLE-017"
            )
        answer = STAGES[stage].answer
        if isinstance(result.value, answer):
            return None
        expected = " or ".join(kind.__name__ for kind in answer)
        return Fault(
            f"{stage} returned {type(result.value).__name__}, expected {expected}",
            code="PNT-CYCLE-018",
        )
