"""State of the bus and of the arm, and statistics of the cyclic loop."""

import enum
from dataclasses import dataclass

from perception.ground import FloatArray


class BusState(enum.StrEnum):
    """State of the bus as a whole."""

    DOWN = "down"  # Not started, or switched off.
    STARTING = "starting"  # Bring-up, enabling or homing runs.
    ENABLED = "enabled"  # All drives enabled; setpoints are followed.
    STOPPED = "stopped"  # A reason is latched until acknowledge().


@dataclass(frozen=True)
class AxisStatus:
    """One drive.

    Attributes:
        name: Axis name.
        state: CiA 402 state as text; "UNKNOWN" before the first statusword.
        code: Active emergency code; 0 for none.
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
    """Counts of the cyclic loop since it began.

    Attributes:
        cycles: SYNCs sent.
        overruns: Cycles skipped because one was too late.
        missing: TPDOs not received before the next SYNC.
        retries: SDO requests sent again.
        foreign: Frames that no node of the bus file sends.
        malformed: Frames of its nodes that fit no service: of a wrong length, or
            answers without a request.
        load: Worst-case bus load of the last second, 0 to 1.
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
        bus_state: State of the bus.
        reason: Why the arm was stopped; empty if it was not.
        stopped_at: When it was stopped, s; 0 if it was not.
        q: (5,) measured joint positions, rad.
        v: (5,) measured joint speeds, rad/s.
        q_commanded: (5,) rad, as sent to the drives.
        trigger: As sent to the gun, 0 to 1.
        axes: The drives.
        is_chain_closed: Whether the e-stop chain is closed.
        pressure: Of the pump, Pa.
        buffered: Number of setpoints held.
        statistics: Counts of the loop.
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
