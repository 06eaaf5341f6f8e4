"""Logs in candump's format: lines of can-utils' manual, and python-can as a peer."""

import can
import pytest

from painter.canopen.protocol.frames import Frame
from painter.canopen.wire.candump import (
    LogRecord,
    format_record,
    parse_line,
    read_log,
)
from painter.errors import InputError


def test_a_line_of_the_manual_is_read():
    # can-utils, canplayer(1): (timestamp) device frame.
    record = parse_line("(1436509052.249713) vcan0 044#2A366C2B")
    assert record == LogRecord(1436509052.249713, Frame(0x44, b"\x2a\x36\x6c\x2b"))


@pytest.mark.parametrize(
    "line",
    [
        "(0000000012.345678) can0 080#",
        "(1436509052.249713) can0 585#8040600022000006 R",
        "(1436509052.249713) can0 20000040#0000000000000000 R",
        "(1436509052.249713) can0 000#0105 T",
    ],
)
def test_lines_survive_reading_and_writing(line):
    record = parse_line(line)
    assert format_record(record, "can0") == line


def test_error_frames_keep_their_class():
    frame = parse_line("(1.000000) can0 20000040#00").frame
    assert frame == Frame(0x40, b"\0", is_error=True)


@pytest.mark.parametrize(
    "line",
    [
        "(1.0) can0 00012345#00",  # 29-bit identifier.
        "(1.0) can0 123#R",  # Remote frame.
        "(1.0) can0 123#R8",
        "(1.0) can0 123##100112233",  # CAN FD.
    ],
)
def test_frames_of_other_kinds_are_left_out(line):
    assert parse_line(line) is None


@pytest.mark.parametrize(
    ("line", "text"),
    [
        ("", "expected"),
        ("no log", "expected"),
        ("(1.0) can0 12#00", "expected"),
        ("(1.0) can0 123#0", "up to 8 bytes"),
        ("(1.0) can0 123#0G", "up to 8 bytes"),
        ("(1.0) can0 123#" + "00" * 9, "up to 8 bytes"),
        ("(1.0) can0 800#00", "at most 7FF"),
        ("(1.0) can0 123#00 X", "expected"),
        ("(nan) can0 123#00", "expected"),
    ],
)
def test_malformed_lines_are_named(tmp_path, line, text):
    path = tmp_path / "bad.log"
    path.write_text(f"(1.0) can0 080#\n{line}x\n" if not line else f"{line}\n")
    with pytest.raises(InputError, match=rf"bad.log: line [12]: .*{text}"):
        read_log(path)


def test_unusable_files_are_named(tmp_path):
    with pytest.raises(InputError, match="no such log"):
        read_log(tmp_path / "none.log")
    for name, content in (("empty", b""), ("other", b"(1.0) can0 12345678#00\n")):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(InputError, match=f"{name}: holds no"):
            read_log(tmp_path / name)
    (tmp_path / "binary").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="binary: not a candump log"):
        read_log(tmp_path / "binary")
    with pytest.raises(InputError, match="directory"):
        read_log(tmp_path)


def test_a_line_that_was_cut_off_is_left_out(tmp_path):
    path = tmp_path / "cut.log"
    path.write_text("(1.0) can0 080#\n(2.0) can0 185#00112")
    assert [record.time for record in read_log(path)] == [1.0]


def test_python_can_reads_what_we_write_and_the_other_way(tmp_path):
    records = [
        LogRecord(1700000000.5, Frame(0x185, bytes(range(6))), False),
        LogRecord(1700000000.505, Frame(0x080), True),
        LogRecord(1700000000.51, Frame(0x80, bytes(8), is_error=True), False),
    ]
    ours = tmp_path / "ours.log"
    ours.write_text("".join(format_record(r, "can0") + "\n" for r in records))
    with can.LogReader(ours) as reader:
        messages = list(reader)
    assert [message.timestamp for message in messages] == [r.time for r in records]
    assert [bytes(message.data) for message in messages[:2]] == [
        bytes(range(6)),
        b"",
    ]
    assert [message.is_rx for message in messages[:2]] == [True, False]
    assert messages[2].is_error_frame
    theirs = tmp_path / "theirs.log"
    with can.CanutilsLogWriter(theirs) as writer:
        for message in messages[:2]:
            writer.on_message_received(message)
    found = read_log(theirs)
    assert [record.frame for record in found] == [r.frame for r in records[:2]]
