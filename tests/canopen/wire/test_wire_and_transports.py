import uuid

import can
import pytest

from painter.canopen.protocol.frames import Frame, frame_bits, frame_time
from painter.canopen.sim.server import LocalHub
from painter.canopen.sim.wire import Wire
from painter.canopen.wire.transports import (
    LocalTransport,
    PythonCanTransport,
    TransportError,
    unpack_frame,
)


@pytest.mark.parametrize(
    ("length", "bits"), [(0, 55), (1, 65), (2, 75), (4, 95), (6, 115), (8, 135)]
)
def test_worst_case_bits(length, bits):
    # Nolte et al., 2003, eq. 2; 8 bytes: the 135 bits that are often quoted.
    assert frame_bits(length) == bits


def test_the_lowest_identifier_wins_and_frames_do_not_overlap():
    wire, got = Wire(1_000_000), []
    wire.attach(lambda frame, now: got.append((frame.cob_id, now)))
    send = wire.attach(lambda frame, now: None)
    send(Frame(0x300, bytes(8)), 0.0)
    send(Frame(0x200, bytes(8)), 10e-6)
    send(Frame(0x100, b""), 20e-6)
    wire.advance(1.0)
    # The first was alone and is not interrupted; then 100h beats 200h.
    assert [cob_id for cob_id, _ in got] == [0x300, 0x100, 0x200]
    ends = [time for _, time in got]
    assert ends == pytest.approx([135e-6, 190e-6, 325e-6])
    assert wire.busy_time == pytest.approx(325e-6)


def test_a_slower_wire_takes_longer():
    assert frame_time(8, 500_000) == pytest.approx(270e-6)


def test_frames_pass_a_python_can_interface():
    channel = uuid.uuid4().hex
    dut = PythonCanTransport("virtual", channel, 1_000_000)
    with can.Bus(interface="virtual", channel=channel) as other:
        dut.send(Frame(0x123, b"abc"))
        message = other.recv(1.0)
        assert (message.arbitration_id, bytes(message.data)) == (0x123, b"abc")
        # Extended and remote frames are not CANopen's.
        other.send(can.Message(arbitration_id=0x12345, is_extended_id=True))
        other.send(can.Message(arbitration_id=1, is_extended_id=False, dlc=1,
                               is_remote_frame=True))  # fmt: skip
        other.send(can.Message(arbitration_id=0x40, is_error_frame=True,
                               is_extended_id=False))  # fmt: skip
        other.send(can.Message(arbitration_id=5, data=b"x", is_extended_id=False))
        frames = dut.receive(1.0)
        assert frames[-1] == Frame(5, b"x")
        assert [frame.is_error for frame in frames] == [True, False]
    dut.close()
    with pytest.raises(TransportError, match="closed"):
        dut.send(Frame(1))


def test_an_interface_that_is_not_there_is_named():
    with pytest.raises(TransportError, match="no_such_thing can7"):
        PythonCanTransport("no_such_thing", "can7", 1_000_000)


def test_local_sockets_join_all_who_connect(tmp_path):
    path = str(tmp_path / "bus")
    with pytest.raises(TransportError, match="local"):
        LocalTransport(path)
    hub = LocalHub(path)
    a, b = LocalTransport(path), LocalTransport(path)
    hub.receive(0.1)
    hub.receive(0.1)
    a.send(Frame(0x701, b"\5"))
    assert hub.receive(1.0) == [Frame(0x701, b"\5")]
    assert b.receive(1.0) == [Frame(0x701, b"\5")]
    assert a.receive(0.0) == []
    hub.send(Frame(0x80))
    assert a.receive(1.0) == b.receive(1.0) == [Frame(0x80)]
    b.close()
    hub.receive(0.1)
    hub.close()
    with pytest.raises(TransportError, match="closed"):
        a.receive(1.0)
    with pytest.raises(TransportError):
        a.reopen()


@pytest.mark.parametrize("packet", [b"", b"x" * 15, b"\xff" * 16])
def test_malformed_packets_are_no_frames(packet):
    assert unpack_frame(packet) is None
