"""Bus logs in candump's format: one frame a line, as `candump -L` writes them.

    (1436509052.249713) can0 185#2712A0860100 R

Source: can-utils, lib.c (sprint_canframe) and canlogserver's manual: three digits of an
11-bit identifier, eight of a 29-bit one or, with flag 20000000h, of an error frame;
`#R` marks a remote frame, `##` CAN FD; a trailing T or R means sent or received.
docs/decisions/candump.md says why python-can's reader and writer are not used.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from painter.canopen.protocol.frames import Frame
from painter.errors import InputError

# Source: Linux, include/uapi/linux/can.h, CAN_ERR_FLAG.
_ERROR_FLAG = 0x20000000
_LINE = re.compile(
    r"\((?P<time>\d+\.\d+)\) (?P<channel>\S+) (?P<id>[0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})"
    r"#(?P<rest>\S*)(?: (?P<way>[TR]))?"
)
_DATA = re.compile(r"(?:[0-9A-Fa-f]{2}){0,8}")


@dataclass(frozen=True, slots=True)
class LogRecord:
    """One line of a log.

    Attributes:
        time: Time stamp of the frame, s; in logs of the bus process since 1970 (UTC).
        frame: The frame.
        is_sent: True if the master sent it, False if the master received it, None if
            the log does not say.
    """

    time: float
    frame: Frame
    is_sent: bool | None = None


def format_record(record: LogRecord, channel: str) -> str:
    """Returns a record as a line, without the line break."""
    frame = record.frame
    if frame.is_error:
        cob_id = f"{_ERROR_FLAG | frame.cob_id:08X}"
    else:
        cob_id = f"{frame.cob_id:03X}"
    way = {True: " T", False: " R", None: ""}[record.is_sent]
    data = frame.data.hex().upper()
    return f"({record.time:017.6f}) {channel} {cob_id}#{data}{way}"


def parse_line(line: str) -> LogRecord | None:
    """Reads a line; None for an extended, remote or CAN FD frame.

    Raises:
        ValueError: The line is not in candump's format.
    """
    match = _LINE.fullmatch(line)
    if match is None:
        raise ValueError(f"expected '(time) channel id#data', got {line[:60]!r}.")
    cob_id, rest = int(match["id"], 16), match["rest"]
    is_error = len(match["id"]) == 8 and bool(cob_id & _ERROR_FLAG)
    is_extended = len(match["id"]) == 8 and not is_error
    if is_extended or rest[:1] in ("R", "#"):
        return None
    if not _DATA.fullmatch(rest):
        raise ValueError(f"expected up to 8 bytes in hex after #, got {rest[:40]!r}.")
    limit = _ERROR_FLAG - 1 if is_error else 0x7FF
    if not is_error and cob_id > limit:
        raise ValueError(f"an 11-bit identifier is at most 7FF, got {cob_id:X}.")
    frame = Frame(cob_id & limit, bytes.fromhex(rest), is_error=is_error)
    way = match["way"]
    return LogRecord(float(match["time"]), frame, None if way is None else way == "T")


def read_lines(path: Path) -> Iterator[LogRecord | None]:
    """Reads a log line by line; None for an extended, remote or CAN FD frame.

    Skips a last line without a line break: its writer was killed while writing it.

    Raises:
        InputError: The file cannot be read, or a line is not in candump's format; names
            file and line.
    """
    try:
        with path.open(encoding="ascii") as lines:
            for number, line in enumerate(lines, start=1):
                if not line.endswith("\n"):
                    return
                if line.isspace():
                    continue
                try:
                    yield parse_line(line.rstrip())
                except ValueError as error:
                    raise InputError(
                        f"{path}: line {number}: {error}", code="PNT-BUS-025"
                    ) from None
    except FileNotFoundError:
        raise InputError(f"{path}: no such log.", code="PNT-BUS-026") from None
    except UnicodeDecodeError:
        raise InputError(
            f"{path}: not a candump log: it is not text.", code="PNT-BUS-027"
        ) from None
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}.", code="PNT-BUS-028") from error


def read_log(path: Path) -> list[LogRecord]:
    """Reads a whole log: CANopen and error frames in the order of the file.

    Raises:
        InputError: As `read_lines`, or the log holds no CANopen frames.
    """
    records = [record for record in read_lines(path) if record is not None]
    if not records:
        raise InputError(f"{path}: holds no CANopen frames.", code="PNT-BUS-029")
    return records
