"""The CiA 402 power state machine: states, transitions, controlwords, option codes.

Source: CiA 402-2 v4.0.0 (IEC 61800-7-201); clause and object numbers below are its.
"""

import enum


class State(enum.Enum):
    """States of a drive, clause 7.2 (figure "power drive system state machine")."""

    NOT_READY = "NOT READY TO SWITCH ON"
    SWITCH_ON_DISABLED = "SWITCH ON DISABLED"
    READY = "READY TO SWITCH ON"
    SWITCHED_ON = "SWITCHED ON"
    ENABLED = "OPERATION ENABLED"
    QUICK_STOP = "QUICK STOP ACTIVE"
    FAULT_REACTION = "FAULT REACTION ACTIVE"
    FAULT = "FAULT"


# Statusword, object 6041h: (mask, value) of each state.
STATUS_CODES = {
    State.NOT_READY: (0x4F, 0x00),
    State.SWITCH_ON_DISABLED: (0x4F, 0x40),
    State.READY: (0x6F, 0x21),
    State.SWITCHED_ON: (0x6F, 0x23),
    State.ENABLED: (0x6F, 0x27),
    State.QUICK_STOP: (0x6F, 0x07),
    State.FAULT_REACTION: (0x4F, 0x0F),
    State.FAULT: (0x4F, 0x08),
}


class Status(enum.IntFlag):
    """Bits of the statusword, object 6041h."""

    FAULT = 1 << 3
    VOLTAGE_ENABLED = 1 << 4
    QUICK_STOP = 1 << 5
    WARNING = 1 << 7
    REMOTE = 1 << 9
    TARGET_REACHED = 1 << 10
    INTERNAL_LIMIT = 1 << 11
    # Profile position: set-point acknowledge; homing: attained; IP and CSP: the drive
    # follows the command.
    MODE_12 = 1 << 12
    # Position modes: following error; homing: error.
    MODE_13 = 1 << 13


class Command(enum.IntEnum):
    """Commands as controlwords, object 6040h, table "command coding"."""

    DISABLE_VOLTAGE = 0x00
    QUICK_STOP = 0x02
    SHUTDOWN = 0x06
    SWITCH_ON = 0x07
    ENABLE_OPERATION = 0x0F
    FAULT_RESET = 0x80


# Controlword bits whose sense depends on the mode.
CONTROL_MODE_4 = 1 << 4  # PP: new set-point; HM: start; IP: enable interpolation.
CONTROL_HALT = 1 << 8

# Transitions on command: 2 to 12, 15 and 16. The drive makes 0, 1, 13, 14 by itself.
TRANSITIONS: dict[tuple[State, Command], tuple[int, State]] = {
    (State.SWITCH_ON_DISABLED, Command.SHUTDOWN): (2, State.READY),
    (State.READY, Command.SWITCH_ON): (3, State.SWITCHED_ON),
    (State.SWITCHED_ON, Command.ENABLE_OPERATION): (4, State.ENABLED),
    (State.ENABLED, Command.SWITCH_ON): (5, State.SWITCHED_ON),
    (State.SWITCHED_ON, Command.SHUTDOWN): (6, State.READY),
    (State.READY, Command.QUICK_STOP): (7, State.SWITCH_ON_DISABLED),
    (State.READY, Command.DISABLE_VOLTAGE): (7, State.SWITCH_ON_DISABLED),
    (State.ENABLED, Command.SHUTDOWN): (8, State.READY),
    (State.ENABLED, Command.DISABLE_VOLTAGE): (9, State.SWITCH_ON_DISABLED),
    (State.SWITCHED_ON, Command.QUICK_STOP): (10, State.SWITCH_ON_DISABLED),
    (State.SWITCHED_ON, Command.DISABLE_VOLTAGE): (10, State.SWITCH_ON_DISABLED),
    (State.ENABLED, Command.QUICK_STOP): (11, State.QUICK_STOP),
    (State.QUICK_STOP, Command.DISABLE_VOLTAGE): (12, State.SWITCH_ON_DISABLED),
    (State.FAULT, Command.FAULT_RESET): (15, State.SWITCH_ON_DISABLED),
    (State.QUICK_STOP, Command.ENABLE_OPERATION): (16, State.ENABLED),
}
# Transition 16 requires that the axis is held: 605Ah is 5 to 8.
HOLDING_QUICK_STOP = frozenset({5, 6, 7, 8})


def state_of(statusword: int) -> State | None:
    """Returns the state in a statusword; None if its bits match none."""
    for state, (mask, value) in STATUS_CODES.items():
        if statusword & mask == value:
            return state
    return None


def command_of(controlword: int, previous: int = 0) -> Command | None:
    """Returns the command in a controlword; None if it holds none.

    Args:
        controlword: New value of 6040h.
        previous: Previous value: fault reset is the rising edge of bit 7.
    """
    if controlword & 0x80:
        return None if previous & 0x80 else Command.FAULT_RESET
    if not controlword & 0x02:
        return Command.DISABLE_VOLTAGE
    if not controlword & 0x04:
        return Command.QUICK_STOP
    if not controlword & 0x01:
        return Command.SHUTDOWN
    return Command.ENABLE_OPERATION if controlword & 0x08 else Command.SWITCH_ON


def next_command(state: State) -> Command | None:
    """Returns the command of the next step up to OPERATION ENABLED.

    None if the drive is there already, or leaves the state by itself. In FAULT it is
    the fault reset; the caller makes its rising edge.
    """
    return {
        State.SWITCH_ON_DISABLED: Command.SHUTDOWN,
        State.READY: Command.SWITCH_ON,
        State.SWITCHED_ON: Command.ENABLE_OPERATION,
        State.QUICK_STOP: Command.DISABLE_VOLTAGE,
        State.FAULT: Command.FAULT_RESET,
    }.get(state)


class QuickStopOption(enum.IntEnum):
    """Object 605Ah: what the quick stop command does.

    1 to 4 go to SWITCH ON DISABLED when the axis has stopped (transition 12), 5 to 8
    stay in QUICK STOP ACTIVE and hold the axis.
    """

    DISABLE = 0
    SLOW_DOWN = 1
    QUICK_STOP_RAMP = 2
    CURRENT_LIMIT = 3
    VOLTAGE_LIMIT = 4
    SLOW_DOWN_AND_HOLD = 5
    QUICK_STOP_RAMP_AND_HOLD = 6
    CURRENT_LIMIT_AND_HOLD = 7
    VOLTAGE_LIMIT_AND_HOLD = 8


class StopOption(enum.IntEnum):
    """Objects 605Bh (shutdown) and 605Ch (disable operation)."""

    DISABLE = 0
    SLOW_DOWN = 1


class HaltOption(enum.IntEnum):
    """Object 605Dh: what the halt bit does; the drive stays enabled."""

    SLOW_DOWN = 1
    QUICK_STOP_RAMP = 2
    CURRENT_LIMIT = 3
    VOLTAGE_LIMIT = 4


class FaultOption(enum.IntEnum):
    """Object 605Eh: what a fault does before the drive switches off."""

    DISABLE = 0
    SLOW_DOWN = 1
    QUICK_STOP_RAMP = 2
    CURRENT_LIMIT = 3
    VOLTAGE_LIMIT = 4


class AbortOption(enum.IntEnum):
    """Object 6007h: what a drive does when it loses its master."""

    NONE = 0
    FAULT = 1
    DISABLE_VOLTAGE = 2
    QUICK_STOP = 3
