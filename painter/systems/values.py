"""Frozen values that the brain's systems hand to one another."""

import enum
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np

from painter.planning.spray_path import Motion
from perception.ground import FloatArray, FrozenValue

UP_W: FloatArray = np.array([0.0, 0.0, 1.0])
"""Against gravity: the robot stands on a level floor, and W's z is up."""
UP_W.flags.writeable = False


class Phase(enum.Enum):
    """Phases of the paint cycle, in their order; the last three come from any."""

    HOME = "HOME"
    LOOK = "LOOK"
    SCAN = "SCAN"
    SEGMENT = "SEGMENT"
    PLAN = "PLAN"
    REVIEW = "REVIEW"
    PAINT = "PAINT"
    RETRACT = "RETRACT"
    DONE = "DONE"
    PAUSED = "PAUSED"
    FAULT = "FAULT"
    ABORTED = "ABORTED"


@dataclass(frozen=True)
class Fault(FrozenValue):
    """Why a cycle cannot go on.

    Attributes:
        cause: In one line.
        code: Stable name of the fault, "PNT-AREA-NNN".
    """

    cause: str
    code: str


@dataclass(frozen=True, eq=False)
class DriveStatus(FrozenValue):
    """One drive. `following_error` in rad; `fault_code` 0 = none (CiA 402, 603Fh)."""

    state: str = "OPERATION ENABLED"
    fault_code: int = 0
    following_error: float = 0.0


@dataclass(frozen=True, eq=False)
class ArmStatus(FrozenValue):
    """State of the arm's five drives, base yaw first.

    Attributes:
        drives: State of each.
        stopped: Why the body has stopped the arm by itself, or None.
    """

    drives: tuple[DriveStatus, ...] = field(
        default_factory=lambda: (DriveStatus(),) * 5
    )
    stopped: Fault | None = None

    @property
    def fault(self) -> Fault | None:
        """Why the body stopped, or else the first drive that failed, or None."""
        if self.stopped is not None:
            return self.stopped
        for number, drive in enumerate(self.drives, start=1):
            if drive.fault_code or drive.state != "OPERATION ENABLED":
                cause = (
                    f"drive {number}: {drive.state}, fault code "
                    f"0x{drive.fault_code:04X}"
                )
                return Fault(cause, code="PNT-CYCLE-014")
        return None


@dataclass(frozen=True, eq=False)
class CameraStatus(FrozenValue):
    """State of the depth camera.

    Attributes:
        state: "starting", "streaming", "missing" (it is being opened again) or "lost".
        problem: Why there are no pictures, in a line; empty while there are.
        pictures: Images so far.
        dropped: Images that were repeated or came too late.
    """

    state: str = "streaming"
    problem: str = ""
    pictures: int = 0
    dropped: int = 0

    @property
    def fault(self) -> str | None:
        """Says why the camera cannot be used, or None."""
        return self.problem or None


@dataclass(frozen=True, eq=False)
class StageRequest(FrozenValue):
    """Requests work of a stage, which answers each `number` once.

    Attributes:
        number: Counts up over the cycle; 0 = no request yet.
        stage: Name of the stage ("wall_finder", "wall_segmenter", ...).
        goal: What to do, where the stage can do more than one thing.
    """

    number: int = 0
    stage: str = ""
    goal: str = ""


@dataclass(frozen=True, eq=False)
class StageResult(FrozenValue):
    """Answer of a stage to the request of the same number.

    Attributes:
        number: Of the request; 0 = nothing done yet.
        value: The result, or None where it failed.
        error: One line saying why it failed, or None.
        code: Stable name of that error, or None.
        warning: One line saying what a person should check, or None.
        compute_time: Wall-clock time of the work, s; a log entry, never a decision.
    """

    number: int = 0
    value: Any = None
    error: str | None = None
    code: str | None = None
    warning: str | None = None
    compute_time: float = 0.0


@dataclass(frozen=True, eq=False)
class MotionCommand(FrozenValue):
    """Commands the path follower.

    Attributes:
        number: Counts up with every new motion; 0 = hold where the arm is.
        motion: Motion to follow from its beginning once `number` is new.
        rate: Commanded rate of time along the motion: 1 = as planned, 0 = stand still.
        spray: False keeps the gun closed, whatever the motion says.
    """

    number: int = 0
    motion: Motion | None = None
    rate: float = 1.0
    spray: bool = True


@dataclass(frozen=True, eq=False)
class OperatorCommand(FrozenValue):
    """A command of the operator: "approve", "pause", "resume" or "abort".

    `number` counts up with every command; 0 = none yet.
    """

    number: int = 0
    command: str = ""


@dataclass(frozen=True, eq=False)
class FollowerStatus(FrozenValue):
    """Where the path follower is.

    Attributes:
        number: Of the motion being followed; 0 = none yet.
        position: Path time, s.
        duration: Of the whole motion, s.
        rate: Path time per time: 1 = as planned, 0 = standing.
        spraying: Whether the gun is open at that point of the motion.
        strokes_done: Strokes done, with the share of the one in progress.
    """

    number: int = 0
    position: float = 0.0
    duration: float = 0.0
    rate: float = 0.0
    spraying: bool = False
    strokes_done: float = 0.0

    @property
    def done(self) -> bool:
        """True once the motion is at its end."""
        return self.number > 0 and self.position >= self.duration


@dataclass(frozen=True, eq=False)
class CycleStatus(FrozenValue):
    """State of the paint cycle, as it reports it.

    Attributes:
        phase: Present phase.
        cause: Why the cycle is in FAULT or ABORTED, else "".
        code: Stable name of that cause, else "".
        finished: True once nothing more will happen.
        next_stroke: Number of the stroke, from 1, at which a paused or stopped job
            continues; its fraction is the share that is done. 0 = painting has not
            begun.
        events: What happened so far: (time s, name, data) each.
    """

    phase: Phase = Phase.HOME
    cause: str = ""
    code: str = ""
    finished: bool = False
    next_stroke: float = 0.0
    events: tuple[tuple[float, str, dict[str, Any]], ...] = ()

    def logged(self, time: float, name: str, **data: Any) -> Self:
        """Returns the status with one more event."""
        return self.replace(events=(*self.events, (time, name, data)))

    def aborted(self, fault: Fault, time: float) -> Self:
        """Returns the status of a cycle that was interrupted."""
        status = self.replace(
            phase=Phase.ABORTED, cause=fault.cause, code=fault.code, finished=True
        )
        return status.logged(time, "phase", phase=Phase.ABORTED.value)

    def stop_data(self) -> dict[str, Any]:
        """Returns what the event "stopped" says: why, and the stroke to continue at."""
        data: dict[str, Any] = {"cause": self.cause, "code": self.code}
        return data | ({"next_stroke": self.next_stroke} if self.next_stroke else {})
