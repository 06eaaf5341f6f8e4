"""Names of objects in decoded logs.

Source: CiA 301 v4.2.0, 7.5.2 (1000h to 1FFFh); CiA 402-2 v4.0.0 (603Fh to 67FFh);
CiA 401-1 v3.1.0 (6000h to 6444h). Indices that both define have the name of CiA 402,
except those that only an I/O node uses.
"""

_NAMES = {
    0x1000: "device type",
    0x1001: "error register",
    0x1003: "error history",
    0x1005: "SYNC COB-ID",
    0x1006: "SYNC period",
    0x1008: "device name",
    0x1009: "hardware version",
    0x100A: "software version",
    0x1010: "store",
    0x1011: "restore defaults",
    0x1014: "EMCY COB-ID",
    0x1016: "consumer heartbeat",
    0x1017: "producer heartbeat",
    0x1018: "identity",
    0x1029: "error behaviour",
    0x6000: "digital inputs",
    0x6007: "abort connection option",
    0x603F: "error code",
    0x6040: "controlword",
    0x6041: "statusword",
    0x605A: "quick stop option",
    0x605B: "shutdown option",
    0x605C: "disable option",
    0x605D: "halt option",
    0x605E: "fault reaction option",
    0x6060: "mode",
    0x6061: "mode displayed",
    0x6062: "position demand",
    0x6064: "position",
    0x6065: "following error window",
    0x6066: "following error time",
    0x6067: "position window",
    0x6068: "position window time",
    0x606C: "velocity",
    0x6077: "torque",
    0x607A: "target",
    0x607C: "home offset",
    0x607D: "software position limit",
    0x607F: "max profile velocity",
    0x6080: "max motor speed",
    0x6081: "profile velocity",
    0x6083: "profile acceleration",
    0x6084: "profile deceleration",
    0x6085: "quick stop deceleration",
    0x608F: "encoder resolution",
    0x6091: "gear ratio",
    0x6098: "homing method",
    0x6099: "homing speeds",
    0x609A: "homing acceleration",
    0x60A9: "velocity unit",
    0x60C1: "interpolation target",
    0x60C2: "interpolation period",
    0x60C5: "max acceleration",
    0x60F4: "following error",
    0x6200: "digital outputs",
    0x6206: "output error mode",
    0x6207: "output error value",
    0x6401: "analogue input",
    0x6411: "analogue output",
    0x6443: "analogue error mode",
    0x6444: "analogue error value",
    0x6502: "supported modes",
}
_RANGES = (
    (0x1400, 0x1600, "RPDO{} parameters"),
    (0x1600, 0x1800, "RPDO{} mapping"),
    (0x1800, 0x1A00, "TPDO{} parameters"),
    (0x1A00, 0x1C00, "TPDO{} mapping"),
)

# Objects whose values are signed; an SDO or PDO does not say so itself.
_SIGNED = frozenset(
    {0x6007, 0x6060, 0x6061, 0x6062, 0x6064, 0x606C, 0x6077, 0x607A, 0x607C, 0x607D}
    | {0x6098, 0x60C1, 0x60F4, 0x6401, 0x6411, 0x6444, *range(0x605A, 0x605F)}
)


def object_text(index: int, sub: int) -> str:
    """Returns an object as "6040h controlword" or "607Dh:1 software position limit"."""
    address = f"{index:04X}h:{sub}" if sub else f"{index:04X}h"
    name = _NAMES.get(index)
    for first, end, text in _RANGES:
        if first <= index < end:
            name = text.format(index - first + 1)
    return f"{address} {name}" if name else address


def object_value(index: int, data: bytes) -> int:
    """Returns the integer value of an object's bytes."""
    return int.from_bytes(data, "little", signed=index in _SIGNED)
