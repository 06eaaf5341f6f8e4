"""Values of objects as text in the terms of CiA 301, 401 and 402."""

from painter.canopen.analysis.object_names import TEXTS, object_text, object_value
from painter.canopen.config.bus_config import BusConfig
from painter.canopen.config.device import Mode
from painter.canopen.config.units import AxisUnits
from painter.canopen.protocol.cia402 import (
    CONTROL_HALT,
    CONTROL_MODE_4,
    Status,
    command_of,
    state_of,
)

_STATUS_FLAGS = (
    (Status.WARNING, "warning"),
    (Status.TARGET_REACHED, "target reached"),
    (Status.INTERNAL_LIMIT, "internal limit"),
)
_ANGLES = frozenset({0x6062, 0x6064, 0x607A, 0x60C1})
_MAPPINGS = frozenset({*range(0x1600, 0x1800), *range(0x1A00, 0x1C00)})


def controlword_text(word: int, mode: int | None = None) -> str:
    """Returns a controlword as its command and other bits.

    Args:
        word: Value of 6040h.
        mode: Value of 6060h; None if unknown.
    """
    command = command_of(word)
    parts = ["no command" if command is None else command.name.replace("_", " ")]
    if word & CONTROL_MODE_4:
        parts.append(TEXTS["control_bit_4"].get(mode, "bit 4"))
    if word & CONTROL_HALT:
        parts.append("halt")
    return ", ".join(parts)


def statusword_text(word: int, mode: int | None = None) -> str:
    """Returns a statusword as its state and flags.

    Args:
        word: Value of 6041h.
        mode: Value of 6060h; None if unknown.
    """
    state = state_of(word)
    parts = ["no known state" if state is None else state.value]
    parts += [text for bit, text in _STATUS_FLAGS if word & bit]
    if word & Status.MODE_12:
        parts.append(TEXTS["status_bit_12"].get(mode, "bit 12"))
    if word & Status.MODE_13:
        is_homing = mode == Mode.HOMING
        parts.append("homing error" if is_homing else "following error")
    return ", ".join(parts)


def mode_text(mode: int) -> str:
    """Returns a mode of operation by name."""
    is_known = mode in list(Mode)
    return Mode(mode).name.replace("_", " ") if is_known else "not used here"


class ValueFormatter:
    """Formats values of the objects of one node.

    Attributes:
        mode: Value of 6060h; None if unknown.
    """

    def __init__(self, bus: BusConfig, units: AxisUnits | None) -> None:
        """Creates the formatter of a node.

        Args:
            bus: The bus file.
            units: Of the drive; None for the I/O node.
        """
        self._io = bus.io
        self._units = units
        self.mode: int | None = None

    def text(self, index: int, sub: int, data: bytes) -> str:
        """Returns the value of an object as text."""
        value = object_value(index, data)
        if index == 0x6040:
            return f"{value:04X}h {controlword_text(value, self.mode)}"
        if index == 0x6041:
            return f"{value:04X}h {statusword_text(value, self.mode)}"
        if index in (0x6060, 0x6061):
            return f"{value} {mode_text(value)}"
        if index in _MAPPINGS and sub:
            what = object_text(value >> 16, value >> 8 & 0xFF)
            return f"{value:08X}h ({what}, {value & 0xFF} bit)"
        if index < 0x2000 and len(data) == 4:
            return f"{value:08X}h"
        if self._units is None:
            return self._io_text(index, value)
        if index in _ANGLES:
            return f"{value} ({self._units.angle(value):.5f} rad)"
        if index == 0x606C:
            return f"{value} ({self._units.speed(value):.4f} rad/s)"
        if index == 0x60F4:
            return f"{value} ({value / self._units.counts_per_rad:.5f} rad)"
        return str(value)

    def _io_text(self, index: int, value: int) -> str:
        if index == 0x6000:
            chain = "closed" if value >> self._io.estop_bit & 1 else "OPEN"
            return f"{value:08b} (e-stop chain {chain})"
        if index == 0x6200:
            valve = "OPEN" if value >> self._io.valve_bit & 1 else "closed"
            return f"{value:08b} (gun {valve})"
        if index == 0x6401:
            return f"{value} ({value * self._io.pressure_scale:g} Pa)"
        if index == 0x6411:
            return f"{value} ({100.0 * value / self._io.flow_full_scale:.1f} % flow)"
        return str(value)
