"""Built-in object dictionaries: a full CiA 402 drive, a CiA 401 I/O node.

Source: CiA 301 v4.2.0, CiA 402-2 v4.0.0 and CiA 401-1 v3.1.0: index, type and access
of each object. Defaults that they leave open are our choice.
"""

from painter.canopen.config.device import DeviceDescription, ObjectInfo
from painter.canopen.protocol.od_types import DataType, Value, bounds

_T = DataType
VENDOR = 0x50A1
DRIVE_PRODUCT = 0x402
IO_PRODUCT = 0x401
_COUNTS_PER_S = 0x00AC0300


def standard_drive() -> DeviceDescription:
    """Returns the objects of a drive with PP, HM, IP and CSP and all options."""
    return DeviceDescription("the built-in drive", _common(DRIVE_PRODUCT) + _drive())


def standard_io() -> DeviceDescription:
    """Returns the objects of an I/O node: 8 digital in and out, one analogue each."""
    return DeviceDescription("the built-in I/O node", _common(IO_PRODUCT) + _io())


def _row(
    index: int,
    sub: int,
    kind: DataType,
    access: str,
    default: Value = 0,
    *,
    pdo: bool = False,
    low: int | None = None,
    high: int | None = None,
) -> ObjectInfo:
    if low is None and high is None and not isinstance(default, bytes):
        low, high = bounds(kind)
    name = f"{index:04X}:{sub}"
    return ObjectInfo(index, sub, name, kind, access, default, low, high, pdo)


def _common(product: int) -> list[ObjectInfo]:
    """Communication profile; PDO parameters are at their power-on values."""
    rows = [
        _row(0x1000, 0, _T.UNSIGNED32, "ro", 0x00020192 if product == 0x402 else 0x191),
        _row(0x1001, 0, _T.UNSIGNED8, "ro", pdo=True),
        _row(0x1003, 0, _T.UNSIGNED8, "rw", low=0, high=0),
        *(_row(0x1003, sub, _T.UNSIGNED32, "ro") for sub in range(1, 9)),
        _row(0x1005, 0, _T.UNSIGNED32, "rw", 0x80),
        _row(0x1006, 0, _T.UNSIGNED32, "rw"),
        _row(0x1008, 0, _T.VISIBLE_STRING, "const", b"Painter simulated node"),
        _row(0x1010, 0, _T.UNSIGNED8, "ro", 1),
        _row(0x1010, 1, _T.UNSIGNED32, "rw", 1),
        _row(0x1011, 0, _T.UNSIGNED8, "ro", 1),
        _row(0x1011, 1, _T.UNSIGNED32, "rw", 1),
        _row(0x1014, 0, _T.UNSIGNED32, "rw", 0x80),
        _row(0x1016, 0, _T.UNSIGNED8, "ro", 2),
        _row(0x1016, 1, _T.UNSIGNED32, "rw"),
        _row(0x1016, 2, _T.UNSIGNED32, "rw"),
        _row(0x1017, 0, _T.UNSIGNED16, "rw"),
        _row(0x1018, 0, _T.UNSIGNED8, "ro", 4),
        _row(0x1018, 1, _T.UNSIGNED32, "ro", VENDOR),
        _row(0x1018, 2, _T.UNSIGNED32, "ro", product),
        _row(0x1018, 3, _T.UNSIGNED32, "ro", 0x00010001),
        _row(0x1018, 4, _T.UNSIGNED32, "ro", 1),
        _row(0x1029, 0, _T.UNSIGNED8, "ro", 1),
        _row(0x1029, 1, _T.UNSIGNED8, "rw", 0, low=0, high=2),
    ]
    for n in range(2):
        for base, maps in ((0x1400, 0x1600), (0x1800, 0x1A00)):
            rows += [
                _row(base + n, 0, _T.UNSIGNED8, "ro", 5),
                _row(base + n, 1, _T.UNSIGNED32, "rw", 0x80000000),
                _row(base + n, 2, _T.UNSIGNED8, "rw", 255),
                _row(base + n, 3, _T.UNSIGNED16, "rw"),
                _row(base + n, 5, _T.UNSIGNED16, "rw"),
                _row(maps + n, 0, _T.UNSIGNED8, "rw", 0, low=0, high=8),
                *(_row(maps + n, sub, _T.UNSIGNED32, "rw") for sub in range(1, 9)),
            ]
    return rows


def _drive() -> list[ObjectInfo]:
    most = (1 << 31) - 1
    i8, i16, i32 = _T.INTEGER8, _T.INTEGER16, _T.INTEGER32
    u8, u16, u32 = _T.UNSIGNED8, _T.UNSIGNED16, _T.UNSIGNED32
    return [
        _row(0x6007, 0, i16, "rw", 1, low=0, high=3),
        _row(0x603F, 0, u16, "ro", pdo=True),
        _row(0x6040, 0, u16, "rw", pdo=True),
        _row(0x6041, 0, u16, "ro", pdo=True),
        _row(0x605A, 0, i16, "rw", 2, low=0, high=8),
        _row(0x605B, 0, i16, "rw", 0, low=0, high=1),
        _row(0x605C, 0, i16, "rw", 1, low=0, high=1),
        _row(0x605D, 0, i16, "rw", 1, low=1, high=4),
        _row(0x605E, 0, i16, "rw", 2, low=0, high=4),
        _row(0x6060, 0, i8, "rw", pdo=True),
        _row(0x6061, 0, i8, "ro", pdo=True),
        _row(0x6062, 0, i32, "ro", pdo=True),
        _row(0x6064, 0, i32, "ro", pdo=True),
        _row(0x6065, 0, u32, "rw", 2000),
        _row(0x6066, 0, u16, "rw", 10),
        _row(0x6067, 0, u32, "rw", 100),
        _row(0x6068, 0, u16, "rw", 10),
        _row(0x606C, 0, i32, "ro", pdo=True),
        _row(0x6077, 0, i16, "ro", pdo=True),
        _row(0x607A, 0, i32, "rw", pdo=True),
        _row(0x607C, 0, i32, "rw"),
        _row(0x607D, 0, u8, "const", 2),
        _row(0x607D, 1, i32, "rw", -most),
        _row(0x607D, 2, i32, "rw", most),
        _row(0x607F, 0, u32, "rw", most),
        _row(0x6080, 0, u32, "rw", 6000, low=1, high=20000),
        _row(0x6081, 0, u32, "rw", 10000, pdo=True),
        _row(0x6083, 0, u32, "rw", 100000),
        _row(0x6084, 0, u32, "rw", 100000),
        _row(0x6085, 0, u32, "rw", 1000000, low=1, high=most),
        _row(0x608F, 0, u8, "const", 2),
        _row(0x608F, 1, u32, "rw", 4096, low=1, high=most),
        _row(0x608F, 2, u32, "rw", 1, low=1, high=most),
        _row(0x6098, 0, i8, "rw", 0, low=-128, high=37),
        _row(0x6099, 0, u8, "const", 2),
        _row(0x6099, 1, u32, "rw", 1000),
        _row(0x6099, 2, u32, "rw", 100),
        _row(0x609A, 0, u32, "rw", 100000),
        _row(0x60A9, 0, u32, "ro", _COUNTS_PER_S),
        _row(0x60C0, 0, i16, "rw"),
        _row(0x60C1, 0, u8, "const", 1),
        _row(0x60C1, 1, i32, "rw", pdo=True),
        _row(0x60C2, 0, u8, "const", 2),
        _row(0x60C2, 1, u8, "rw", 1, low=1, high=255),
        _row(0x60C2, 2, i8, "rw", -3, low=-128, high=63),
        _row(0x60C5, 0, u32, "rw", most),
        _row(0x60F4, 0, i32, "ro", pdo=True),
        _row(0x6502, 0, u32, "ro", 0xE1),
    ]


def _io() -> list[ObjectInfo]:
    i16, u8 = _T.INTEGER16, _T.UNSIGNED8
    return [
        _row(0x6000, 0, u8, "ro", 1),
        _row(0x6000, 1, u8, "ro", 1, pdo=True),
        _row(0x6200, 0, u8, "ro", 1),
        _row(0x6200, 1, u8, "rw", pdo=True),
        _row(0x6206, 0, u8, "ro", 1),
        _row(0x6206, 1, u8, "rw", 0xFF),
        _row(0x6207, 0, u8, "ro", 1),
        _row(0x6207, 1, u8, "rw", 0),
        _row(0x6401, 0, u8, "ro", 1),
        _row(0x6401, 1, i16, "ro", pdo=True),
        _row(0x6411, 0, u8, "ro", 1),
        _row(0x6411, 1, i16, "rw", pdo=True),
        _row(0x6443, 0, u8, "ro", 1),
        _row(0x6443, 1, u8, "rw", 1),
        _row(0x6444, 0, u8, "ro", 1),
        _row(0x6444, 1, _T.INTEGER32, "rw", 0),
    ]
