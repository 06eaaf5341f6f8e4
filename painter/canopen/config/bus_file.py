"""Reads bus files and checks that each drive supports what the file configures."""

from pathlib import Path

import yaml

from painter.canopen.config.bus_config import BusConfig, DriveConfig, HomingKind
from painter.canopen.config.device import DeviceDescription, Mode
from painter.canopen.config.units import AXES, VelocityUnit
from painter.errors import InputError
from painter.typed_yaml import load_yaml, read_typed


def load_bus(path: Path) -> BusConfig:
    """Reads a bus file, and the EDS files it names.

    Args:
        path: A YAML file with the fields of `BusConfig`.

    Returns:
        The bus, checked.

    Raises:
        InputError: The file cannot be read, a field is unknown, missing or out of
            range, or a drive does not support it; names file and field.
    """
    try:
        data = load_yaml(path.read_text())
        if isinstance(data, dict) and "path" in data:
            raise ValueError("path is unknown: the reader sets it.")
        bus = read_typed(BusConfig, data)
        bus.path = str(path)
        bus.validate()
    except FileNotFoundError:
        raise InputError(f"{path}: no such bus file.", code="PNT-BUSFILE-001") from None
    except (OSError, UnicodeDecodeError, yaml.YAMLError, ValueError) as error:
        raise InputError(
            f"{path}: {' '.join(str(error).split())}", code="PNT-BUSFILE-002"
        ) from error
    for name in AXES:
        problem = mode_problem(bus.drives[name], bus.device(name))
        if problem:
            raise InputError(f"{path}: drives.{name}.{problem}", code="PNT-BUSFILE-003")
    return bus


def choose_mode(device: DeviceDescription) -> Mode | None:
    """Returns the mode in which positions are streamed: CSP, else IP, else None.

    A device description without a value for 6502h counts as supporting CSP.
    """
    modes = device.modes()
    if modes is None or Mode.CYCLIC_SYNC_POSITION in modes:
        return Mode.CYCLIC_SYNC_POSITION
    if Mode.INTERPOLATED_POSITION in modes and device.find(0x60C1, 1):
        return Mode.INTERPOLATED_POSITION
    return None


def mode_problem(drive: DriveConfig, device: DeviceDescription) -> str | None:
    """Returns why a device cannot be used as configured, or None.

    The text begins with the field of the bus file in question.
    """
    if choose_mode(device) is None:
        return f"eds: {device.source} has neither CSP nor IP mode (6502h)."
    if drive.homing.kind == HomingKind.DRIVE:
        modes = device.modes()
        if modes is not None and Mode.HOMING not in modes:
            return f"homing.kind: {device.source} has no homing mode (6502h)."
        if not device.is_writable(0x6098):
            return f"homing.method: {device.source} has no writable 6098h."
    for field, sub in (("vendor", 1), ("product", 2)):
        wanted = getattr(drive.identity, field)
        info = device.find(0x1018, sub)
        found = info.default if info else None
        if wanted and isinstance(found, int) and found and found != wanted:
            return f"identity.{field} is {wanted:X}h, {found:X}h in {device.source}."
    # Source: CiA 402-2 v4.0.0, 60A9h: unit in bits 16 to 23 (B4h revolutions), time
    # base in bits 8 to 15 (47h minute).
    info = device.find(0x60A9)
    if info is not None and isinstance(info.default, int):
        is_rpm = info.default >> 8 & 0xFFFF == 0xB447
        if is_rpm != (drive.velocity_unit == VelocityUnit.RPM):
            unit = "rpm" if is_rpm else "not rpm"
            return (
                f"velocity_unit is {drive.velocity_unit}, but 60A9h of "
                f"{device.source} is {info.default:08X}h, {unit}."
            )
    return None
