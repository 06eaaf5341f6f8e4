"""Basic data types of CANopen: encoding and bounds.

Source: CiA 301 v4.2.0, 7.1.6 (encoding) and table 44 (codes).
"""

import enum
import struct

from canopen.objectdictionary import ODVariable


class DataType(enum.IntEnum):
    """Data types of the objects that drives and I/O nodes have."""

    BOOLEAN = 0x01
    INTEGER8 = 0x02
    INTEGER16 = 0x03
    INTEGER32 = 0x04
    UNSIGNED8 = 0x05
    UNSIGNED16 = 0x06
    UNSIGNED32 = 0x07
    REAL32 = 0x08
    VISIBLE_STRING = 0x09
    OCTET_STRING = 0x0A
    UNICODE_STRING = 0x0B
    DOMAIN = 0x0F
    REAL64 = 0x11
    INTEGER64 = 0x15
    UNSIGNED64 = 0x1B


# Encoders of all types but strings and domains, which are bytes.
_STRUCTS: dict[int, struct.Struct] = ODVariable.STRUCT_TYPES

Value = int | float | bytes


def size_of(data_type: DataType) -> int | None:
    """Returns the size in bytes; None for strings and domains, which vary."""
    layout = _STRUCTS.get(data_type)
    return None if layout is None else layout.size


def bounds(data_type: DataType) -> tuple[int, int]:
    """Returns the minimum and maximum of an integer type.

    Raises:
        ValueError: The type is not an integer type.
    """
    size = size_of(data_type)
    if size is None or data_type in (DataType.REAL32, DataType.REAL64):
        raise ValueError(f"{data_type.name} has no integer bounds.")
    if data_type == DataType.BOOLEAN:
        return 0, 1
    bits = 8 * size
    if data_type.name.startswith("INTEGER"):
        return -(1 << (bits - 1)), (1 << (bits - 1)) - 1
    return 0, (1 << bits) - 1


def pack(data_type: DataType, value: Value) -> bytes:
    """Encodes a value, little endian.

    Raises:
        ValueError: The value does not fit the type; names both.
    """
    layout = _STRUCTS.get(data_type)
    if layout is None:
        if not isinstance(value, bytes):
            raise ValueError(f"{data_type.name} takes bytes, got {value!r}.")
        return value
    try:
        return layout.pack(value)
    except struct.error:
        raise ValueError(f"{value!r} does not fit {data_type.name}.") from None


def unpack(data_type: DataType, data: bytes) -> Value:
    """Decodes a value.

    Raises:
        ValueError: The number of bytes does not fit the type; names both lengths.
    """
    layout = _STRUCTS.get(data_type)
    if layout is None:
        return data
    if len(data) != layout.size:
        raise ValueError(
            f"{data_type.name} takes {layout.size} bytes, got {len(data)}."
        )
    value: int | float = layout.unpack(data)[0]
    return int(value) if data_type == DataType.BOOLEAN else value
