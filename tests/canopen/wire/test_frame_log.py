"""The log of the bus process: it never waits, and all frames are written."""

import os
import time
from multiprocessing import Pipe

import pytest

from painter.canopen.protocol.frames import Frame
from painter.canopen.wire.candump import read_log
from painter.canopen.wire.frame_log import FrameLogger, TappedTransport
from painter.errors import InputError


class Loop:
    """A transport that returns the frames it sends."""

    def __init__(self):
        self.frames = []

    def send(self, frame):
        self.frames.append(frame)

    def receive(self, timeout):
        frames, self.frames = self.frames, []
        return frames

    def reopen(self):
        pass

    def close(self):
        pass


def test_frames_of_both_ways_are_written_in_order(tmp_path):
    path = tmp_path / "bus.log"
    logger = FrameLogger(path, "can 0")
    dut = TappedTransport(Loop(), logger.pipe)
    error = Frame(0x40, bytes(8), is_error=True)
    before = time.time()
    for i in range(500):
        dut.send(Frame(0x200 + i % 5, bytes([i % 256] * (i % 9))))
        assert len(dut.receive(0.0)) == 1
    dut.send(error)
    dut.receive(0.001)
    dut.close()
    logger.close()
    records = read_log(path)
    assert len(records) == 1002
    assert [record.is_sent for record in records] == [True, False] * 501
    for i in range(500):
        wanted = Frame(0x200 + i % 5, bytes([i % 256] * (i % 9)))
        assert records[2 * i].frame == records[2 * i + 1].frame == wanted
    assert records[-1].frame == error
    times = [record.time for record in records]
    assert times == sorted(times)
    assert before - 0.1 <= times[0] <= times[-1] <= time.time() + 0.1
    assert "can_0" in path.read_text()


def test_a_writer_that_does_not_read_never_delays_the_bus():
    read, write = Pipe(duplex=False)
    dut = TappedTransport(Loop(), write)
    start = time.monotonic()
    for _ in range(20_000):
        dut.send(Frame(0x80))
        dut.receive(0.001)
    assert time.monotonic() - start < 60.0  # It does not hang.
    # Far fewer than 40,000 records of 24 bytes fit into the pipe.
    os.set_blocking(read.fileno(), False)
    size = 0
    while True:
        try:
            size += len(os.read(read.fileno(), 1 << 20))
        except BlockingIOError:
            break
    assert 0 < size < 20_000 * 24
    # The next write holds the number of lost frames; one more was pending.
    dut.receive(0.001)
    marker, rest = os.read(read.fileno(), 24), os.read(read.fileno(), 1 << 20)
    assert marker[12] == 0xFF
    lost = int.from_bytes(marker[8:12], "little")
    assert lost + (size + len(rest)) // 24 == 40_000


def test_a_dead_writer_does_not_end_the_bus():
    read, write = Pipe(duplex=False)
    dut = TappedTransport(Loop(), write)
    read.close()
    dut.send(Frame(0x80))
    assert dut.receive(0.001) == [Frame(0x80)]


def test_a_log_that_cannot_be_written_is_rejected_at_once(tmp_path):
    with pytest.raises(InputError, match="bus.log"):
        FrameLogger(tmp_path / "none" / "bus.log", "can0")
