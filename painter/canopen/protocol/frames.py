"""CAN frames as values, identifiers of CANopen, transmission time of a frame.

Source: CiA 301 v4.2.0, 7.3.5 (pre-defined connection set); ISO 11898-1, 10.4 (frame
format) and 10.5 (bit stuffing).
"""

from dataclasses import dataclass

NMT_ID = 0x000
SYNC_ID = 0x080
EMCY_BASE = 0x080
TPDO_BASES = (0x180, 0x280, 0x380, 0x480)
RPDO_BASES = (0x200, 0x300, 0x400, 0x500)
SDO_TO_CLIENT = 0x580
SDO_TO_SERVER = 0x600
HEARTBEAT_BASE = 0x700

# Bit of an error frame's identifier: the controller went bus-off.
# Source: Linux, include/uapi/linux/can/error.h, CAN_ERR_BUSOFF.
ERROR_BUS_OFF = 0x40


@dataclass(frozen=True, slots=True)
class Frame:
    """One classical CAN frame with an 11-bit identifier.

    Attributes:
        cob_id: Identifier, 0 to 7FFh; of an error frame, its class bits.
        data: Up to eight bytes.
        is_error: Whether the CAN driver made it to report an error.
    """

    cob_id: int
    data: bytes = b""
    is_error: bool = False


def frame_bits(length: int) -> int:
    """Returns the maximum number of bits of a frame with `length` data bytes.

    Classical frame with 11-bit identifier and interframe space, 47 + 8 n bits, and the
    most stuff bits that the 34 + 8 n stuffed bits can need.

    Source: Nolte et al., "Probabilistic worst-case response-time analysis for the
    controller area network", 2003, eq. 2: 8 n + g + 13 + floor((g + 8 n - 1) / 4),
    g = 34.
    """
    return 47 + 8 * length + (33 + 8 * length) // 4


def frame_time(length: int, bitrate: int) -> float:
    """Returns the maximum time, s, of a frame with `length` data bytes at `bitrate`."""
    return frame_bits(length) / bitrate
