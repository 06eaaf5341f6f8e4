"""What the bus tells the rest of the program, and how it fared."""

import enum
from dataclasses import dataclass

from perception.ground import FloatArray


class BusState(enum.StrEnum):
    """What the bus as a whole does."""

    DOWN = "down"  # Not started, or switched off.
    STARTING = "starting"  # Bring-up, enabling or homing runs.
    ENABLED = "enabled"  # All drives enabled; setpoints are followed.
    STOPPED = "stopped"  # A reason is latched; acknowledge() starts again.


@dataclass(frozen=True)
class AxisStatus:
    """One drive.

    Attributes:
        name: Axis name.
        state: CiA 402 state as text; "UNKNOWN" before the first statusword.
        code: Emergency code that has not ended; 0 for none.
        following_error: Of the axis, rad.
        statusword: 6041h.
    """

    name: str
    state: str
    code: int
    following_error: float
    statusword: int


@dataclass(frozen=True)
class Statistics:
    """How the cyclic loop fared since it began.

    Attributes:
        cycles: SYNCs sent.
        overruns: Cycles that were skipped because one came too late.
        missing: TPDOs that did not come before the next SYNC.
        retries: SDO requests that were sent again.
        foreign: Frames that no node of the bus file sends.
        malformed: Frames of its nodes that fit no service: of a wrong length, or
            answers that nobody asked for.
        load: Worst-case share of the bus that the frames of the last second take.
    """

    cycles: int = 0
    overruns: int = 0
    missing: int = 0
    retries: int = 0
    foreign: int = 0
    malformed: int = 0
    load: float = 0.0


@dataclass(frozen=True)
class Feedback:
    """State of the arm at one cycle.

    Attributes:
        time: Clock of the bus, s.
        bus_state: What the bus does.
        reason: Why it stopped; empty while it did not.
        stopped_at: When it stopped, s; 0 while it did not.
        q: (5,) measured joint positions, rad.
        v: (5,) measured joint speeds, rad/s.
        q_commanded: (5,) rad, as sent to the drives.
        trigger: As sent to the gun, 0 to 1.
        axes: The drives.
        is_chain_closed: E-stop chain.
        pressure: Pump, Pa.
        buffered: Setpoints held.
        statistics: How the loop fared.
    """

    time: float
    bus_state: BusState
    reason: str
    stopped_at: float
    q: FloatArray
    v: FloatArray
    q_commanded: FloatArray
    trigger: float
    axes: tuple[AxisStatus, ...]
    is_chain_closed: bool
    pressure: float
    buffered: int
    statistics: Statistics
