"""The sequence of a paint cycle and the state of going through it."""

import enum
from dataclasses import dataclass, field
from typing import Any, Self

from painter.systems.values import (
    CycleStatus,
    MotionCommand,
    Phase,
    StageRequest,
)
from perception.ground import FrozenValue


class Action(enum.Enum):
    """What a step of the sequence does."""

    MOVE = "plans a motion with the motion planner and follows it, if there is one"
    HOLD = "holds the arm still while the camera takes pictures"
    WORK = "requests the answer of a stage"
    REVIEW = "waits for the operator's approval"
    PAINT = "follows the paint program"


@dataclass(frozen=True)
class CycleStep:
    """One step: a phase, an action, and the goal or stage that the action names."""

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
# A wall known from an earlier run needs no LOOK and no SCAN.
KNOWN_WALL_SEQUENCE = tuple(
    step
    for step in SEQUENCE
    if step.phase not in (Phase.LOOK, Phase.SCAN) or step.action == Action.WORK
)


@dataclass(frozen=True, eq=False)
class CycleState(FrozenValue):
    """State of a `PaintCycle`.

    Attributes:
        step: Index in the cycle's sequence.
        since: When the step (or its motion) began, s.
        request: Last request to a stage.
        command: Last command to the path follower.
        moving: True once the step's motion was commanded.
        operator_number: Number of the last operator command carried out.
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
        return self.replace(status=self.status.logged(time, name, **data))

    def reporting(self, **changes: Any) -> Self:
        """Returns the state with a changed status."""
        return self.replace(status=self.status.replace(**changes))

    def in_phase(self, phase: Phase, time: float) -> Self:
        """Returns the state in a phase; a change of phase is logged."""
        if phase == self.status.phase and self.status.events:
            return self
        return self.reporting(phase=phase).logged(time, "phase", phase=phase.value)

    def requesting(self, stage: str, goal: str = "") -> Self:
        """Returns the state with a new request."""
        number = self.request.number + 1
        return self.replace(request=StageRequest(number, stage, goal))

    def with_command(self, **changes: Any) -> Self:
        """Returns the state with a changed motion command."""
        return self.replace(command=self.command.replace(**changes))
