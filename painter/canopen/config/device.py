"""Device descriptions: object dictionaries from EDS and DCF files, or built in."""

import enum
import logging
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import canopen
from canopen.objectdictionary import ODVariable

from painter.canopen.protocol.od_types import DataType, Value
from painter.errors import InputError

_LOGGER = logging.getLogger(__name__)


class Mode(enum.IntEnum):
    """Modes of operation in use.

    Source: CiA 402-2 v4.0.0, object 6060h; bit (value - 1) of 6502h.
    """

    PROFILE_POSITION = 1
    HOMING = 6
    INTERPOLATED_POSITION = 7
    CYCLIC_SYNC_POSITION = 8


@dataclass(frozen=True)
class ObjectInfo:
    """One entry of an object dictionary.

    Attributes:
        index: Index, 0 to FFFFh.
        sub: Sub-index, 0 to FFh.
        name: Its name in the file.
        data_type: Encoding of its value.
        access: "ro", "wo", "rw" or "const".
        default: Value after power-on; None if the file gives none.
        low: Lower limit; None if the file gives none.
        high: Upper limit; None if the file gives none.
        mappable: Whether it may be mapped into a PDO.
    """

    index: int
    sub: int
    name: str
    data_type: DataType
    access: str
    default: Value | None = None
    low: Value | None = None
    high: Value | None = None
    mappable: bool = False


class DeviceDescription:
    """The object dictionary of a device type.

    Attributes:
        source: Where it comes from, for messages.
        objects: All entries, by index and sub-index.
    """

    def __init__(self, source: str, objects: Iterable[ObjectInfo]) -> None:
        """Creates the description.

        Args:
            source: Where it comes from, for messages.
            objects: All entries.
        """
        self.source = source
        self.objects: Mapping[tuple[int, int], ObjectInfo] = {
            (info.index, info.sub): info for info in objects
        }

    def find(self, index: int, sub: int = 0) -> ObjectInfo | None:
        """Returns an entry, or None if the device has no such object."""
        return self.objects.get((index, sub))

    def is_writable(self, index: int, sub: int = 0) -> bool:
        """Whether the entry exists and may be written."""
        info = self.find(index, sub)
        return info is not None and info.access in ("rw", "wo")

    def modes(self) -> frozenset[Mode] | None:
        """Supported modes by 6502h; None if the file gives no value."""
        info = self.find(0x6502)
        if info is None or not isinstance(info.default, int):
            return None
        return modes_of(info.default)


def modes_of(supported: int) -> frozenset[Mode]:
    """Returns the modes whose bits are set in a value of 6502h."""
    return frozenset(mode for mode in Mode if supported >> (mode - 1) & 1)


def read_device(path: Path, node_id: int) -> DeviceDescription:
    """Reads an EDS or DCF; values of a DCF override defaults.

    Args:
        path: The file.
        node_id: Value of `$NODEID`.

    Returns:
        The description.

    Raises:
        InputError: There is no such file, or it cannot be parsed.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such EDS or DCF file.", code="PNT-BUSFILE-004")
    try:
        dictionary = canopen.import_od(str(path), node_id=node_id)
    except Exception as error:  # The INI parser raises many kinds.
        text = " ".join(str(error).split())
        raise InputError(
            f"{path}: not an EDS or DCF file: {text}", code="PNT-BUSFILE-005"
        ) from error
    infos = []
    for entry in dictionary.values():
        parts = [entry] if isinstance(entry, ODVariable) else list(entry.values())
        for variable in parts:
            info = _info(variable)
            if info is None:
                _LOGGER.warning(
                    "%s: %04Xh:%d has unknown data type %s; left out.",
                    path,
                    variable.index,
                    variable.subindex,
                    variable.data_type,
                )
                continue
            infos.append(info)
    if not infos:
        raise InputError(f"{path}: holds no objects.", code="PNT-BUSFILE-006")
    return DeviceDescription(str(path), infos)


def _info(variable: Any) -> ObjectInfo | None:
    if variable.data_type not in DataType.__members__.values():
        return None
    access = variable.access_type.lower()
    default = variable.default if variable.value is None else variable.value
    if isinstance(default, str):
        default = default.encode()
    return ObjectInfo(
        index=variable.index,
        sub=variable.subindex,
        name=variable.name,
        data_type=DataType(variable.data_type),
        # "rww" and "rwr" restrict PDO mapping; SDO access is "rw".
        access="rw" if access.startswith("rw") else access,
        default=default,
        low=variable.min,
        high=variable.max,
        mappable=bool(variable.pdo_mappable),
    )
