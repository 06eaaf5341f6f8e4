"""Decoded frames: the frames are written by hand from CiA 301 and 402."""

import pytest

from painter.canopen.analysis.decoder import Decoder
from painter.canopen.analysis.kinds import Kind
from painter.canopen.analysis.log_summary import LogSummary
from painter.canopen.analysis.value_text import (
    controlword_text,
    mode_text,
    statusword_text,
)
from painter.canopen.config.bus_file import load_bus
from painter.canopen.config.device import Mode
from painter.canopen.protocol.frames import Frame, frame_time
from painter.canopen.wire.candump import LogRecord
from painter.resources import models_path


@pytest.fixture
def decoder():
    return Decoder(load_bus(models_path("bus", "painter.bus.yaml")))


def sdo(command, index, sub, value):
    head = bytes([command]) + index.to_bytes(2, "little") + bytes([sub])
    return head + value.to_bytes(4, "little", signed=value < 0)


@pytest.mark.parametrize(
    ("cob_id", "data", "kind", "node", "text"),
    [
        # CiA 301, 7.2.8.2.1 (NMT), 7.2.8.3.2 (heartbeat), 7.2.7 (EMCY).
        (0x000, [129, 3], Kind.NMT, "elbow_pitch", "reset node"),
        (0x000, [1, 0], Kind.NMT, "", "start"),
        (0x080, [], Kind.SYNC, "", ""),
        (0x705, [0], Kind.HEARTBEAT, "wrist_right", "boot-up"),
        (0x706, [127], Kind.HEARTBEAT, "io", "PRE-OPERATIONAL"),
        (0x77F, [5], Kind.HEARTBEAT, "master", "OPERATIONAL"),
        (
            0x083,
            [0x11, 0x86, 0x21, 0, 0, 0, 0, 0],
            Kind.EMCY,
            "elbow_pitch",
            "8611h following error, error register 21h",
        ),
        # Mapped by the bus file's configuration: 6040h and 607Ah, 6041h and 6064h.
        (
            0x201,
            [0x0F, 0x00, 0x00, 0x00, 0x00, 0x00],
            Kind.RPDO,
            "base_yaw",
            "controlword 000Fh ENABLE OPERATION; target 0 (0.00000 rad)",
        ),
        (
            0x181,
            [0x37, 0x12, 0x00, 0x20, 0x03, 0x00],
            Kind.TPDO,
            "base_yaw",
            # 204800 counts of 65536 x 100 a turn are 1/32 turn.
            "statusword 1237h OPERATION ENABLED, follows; position 204800 "
            "(0.19635 rad)",
        ),
        (
            0x206,
            [1, 0xFF, 0x3F],
            Kind.RPDO,
            "io",
            "digital outputs 00000001 (gun OPEN); analogue output 16383 (50.0 % flow)",
        ),
        (
            0x186,
            [0xFE, 100, 0],
            Kind.TPDO,
            "io",
            "digital inputs 11111110 (e-stop chain OPEN); analogue input 100 "
            "(100000 Pa)",
        ),
        (0x181, [0x37], Kind.TPDO, "base_yaw", "1 bytes, 6 are mapped: 37"),
        (0x7E5, [1], Kind.OTHER, "", "7E5h 01"),
        (0x301, [1], Kind.OTHER, "", "301h 01"),
    ],
)
def test_frames_are_decoded(decoder, cob_id, data, kind, node, text):
    found = decoder.decode(Frame(cob_id, bytes(data)))
    assert (found.kind, found.node, found.text) == (kind, node, text)


@pytest.mark.parametrize(
    ("request_frame", "answer", "text"),
    [
        (
            (0x2F, 0x6060, 0, 8),
            (0x60, 0x6060, 0, 0),
            "6060h mode := 8 CYCLIC SYNC POSITION",
        ),
        (
            (0x2B, 0x605A, 0, 9),
            (0x80, 0x605A, 0, 0x06090031),
            "605Ah quick stop option: aborted, 06090031h Value of parameter written "
            "too high",
        ),
        (
            (0x40, 0x6041, 0, 0),
            (0x4B, 0x6041, 0, 0x0218),
            "6041h statusword = 0218h FAULT",
        ),
        (
            (0x40, 0x607D, 1, 0),
            (0x43, 0x607D, 1, -5),
            "607Dh:1 software position limit = -5",
        ),
        (
            (0x40, 0x1008, 0, 0),
            (0x41, 0x1008, 0, 22),
            "1008h device name: 22 bytes follow",
        ),
    ],
)
def test_sdo_answers_are_decoded(decoder, request_frame, answer, text):
    asked = decoder.decode(Frame(0x601, sdo(*request_frame)))
    assert not asked.is_news
    found = decoder.decode(Frame(0x581, sdo(*answer)))
    assert (found.kind, found.node, found.text) == (Kind.SDO, "base_yaw", text)


def test_a_mapping_written_in_the_log_counts_from_there(decoder):
    for request_data in (
        sdo(0x23, 0x1800, 1, 0x80000181),
        sdo(0x2F, 0x1A00, 0, 0),
        sdo(0x23, 0x1A00, 1, 0x60640020),
        sdo(0x2F, 0x1A00, 0, 1),
        sdo(0x23, 0x1800, 1, 0x1A5),
    ):
        decoder.decode(Frame(0x601, request_data))
        decoder.decode(Frame(0x581, b"\x60" + request_data[1:4] + bytes(4)))
    moved = decoder.decode(Frame(0x1A5, bytes([0, 0, 1, 0])))
    assert moved.text == "position 65536 (0.06283 rad)"  # A hundredth of a turn.
    assert decoder.decode(Frame(0x181, bytes(6))).kind == Kind.OTHER


def test_what_was_aborted_does_not_count(decoder):
    decoder.decode(Frame(0x601, sdo(0x23, 0x1800, 1, 0x80000181)))
    decoder.decode(Frame(0x581, sdo(0x80, 0x1800, 1, 0x08000022)))
    assert decoder.decode(Frame(0x181, bytes(6))).kind == Kind.TPDO


def test_only_changes_are_news(decoder):
    def is_news(word, position):
        data = word.to_bytes(2, "little") + position.to_bytes(4, "little")
        return decoder.decode(Frame(0x182, data)).is_news

    assert is_news(0x0237, 0)
    assert not is_news(0x0237, 1000)
    assert is_news(0x0218, 1000)
    assert not decoder.decode(Frame(0x080)).is_news


# CiA 402-2, statusword and controlword coding; bits 10 to 13 by mode.
@pytest.mark.parametrize(
    ("word", "mode", "text"),
    [
        (0x0000, None, "NOT READY TO SWITCH ON"),
        (0x0040, None, "SWITCH ON DISABLED"),
        (0x0021, None, "READY TO SWITCH ON"),
        (0x0023, None, "SWITCHED ON"),
        (0x0027, None, "OPERATION ENABLED"),
        (0x0007, None, "QUICK STOP ACTIVE"),
        (0x000F, None, "FAULT REACTION ACTIVE"),
        (0x0088, None, "FAULT, warning"),
        (0x1427, Mode.HOMING, "OPERATION ENABLED, target reached, homing attained"),
        (0x2027, Mode.HOMING, "OPERATION ENABLED, homing error"),
        (0x2827, 8, "OPERATION ENABLED, internal limit, following error"),
        (0x1027, Mode.PROFILE_POSITION, "OPERATION ENABLED, set-point taken"),
        (0x1027, 3, "OPERATION ENABLED, bit 12"),
    ],
)
def test_statuswords(word, mode, text):
    assert statusword_text(word, mode) == text


@pytest.mark.parametrize(
    ("word", "mode", "text"),
    [
        (0x0000, None, "DISABLE VOLTAGE"),
        (0x0002, None, "QUICK STOP"),
        (0x0006, None, "SHUTDOWN"),
        (0x0007, None, "SWITCH ON"),
        (0x000F, None, "ENABLE OPERATION"),
        (0x0080, None, "FAULT RESET"),
        (0x001F, Mode.HOMING, "ENABLE OPERATION, start homing"),
        (0x001F, 7, "ENABLE OPERATION, interpolate"),
        (0x011F, 1, "ENABLE OPERATION, new set-point, halt"),
        (0x001F, None, "ENABLE OPERATION, bit 4"),
    ],
)
def test_controlwords(word, mode, text):
    assert controlword_text(word, mode) == text


def test_unknown_modes_are_named_as_such():
    assert mode_text(6) == "HOMING"
    assert mode_text(-3) == "not used here"


def test_error_frames_are_decoded(decoder):
    # Linux, include/uapi/linux/can/error.h.
    found = decoder.decode(Frame(0x44, bytes(8), is_error=True))
    assert found.text == "controller problem, bus-off"


def test_the_summary_counts_time_and_trouble(decoder):
    dut = LogSummary(1_000_000)

    def add(time, cob_id, data=b"", is_error=False):
        frame = Frame(cob_id, bytes(data), is_error=is_error)
        dut.add(LogRecord(time, frame), decoder.decode(frame))

    for i in range(401):
        add(10.0 + 0.005 * i + (0.001 if i == 200 else 0.0), 0x080)
    add(11.5, 0x083, [0x11, 0x86, 0x21, 0, 0, 0, 0, 0])
    add(11.6, 0x40, bytes(8), is_error=True)
    found = dut.figures()
    assert found["frames"] == 403
    assert found["duration_s"] == pytest.approx(2.0)
    assert found["sync_period_s"] == pytest.approx(0.005)
    assert found["sync_gap_worst_s"] == pytest.approx(0.006)
    busy = 401 * frame_time(0, 1_000_000) + frame_time(8, 1_000_000)
    assert found["bus_load"] == pytest.approx(busy / 2.0)
    assert found["errors"] == [
        "11.500000 elbow_pitch emcy 8611h following error, error register 21h",
        "11.600000  error bus-off",
    ]
