"""Logs the frames of the bus without delaying the bus.

`TappedTransport` wraps a transport and copies all frames into a pipe; a process of its
own writes them as text. The bus process never waits: a full pipe drops frames of the
log, and the writer reports how many. When the bus process dies, the log holds all that
passed before.
"""

import contextlib
import fcntl
import logging
import multiprocessing
import os
import signal
import struct
import time
from multiprocessing.connection import Connection
from pathlib import Path

from painter.canopen.protocol.frames import Frame
from painter.canopen.wire.candump import LogRecord, format_record
from painter.canopen.wire.transports import CanTransport
from painter.errors import InputError
from painter.timebase import TimeBase

_LOGGER = logging.getLogger(__name__)
# Time, identifier with two flags, length, data. With length _LOST, the identifier is
# the number of frames that the pipe did not take.
_RECORD = struct.Struct("<dIB3x8s")
_SENT, _ERROR, _LOST = 1 << 31, 1 << 30, 0xFF
# Whole records in an atomic write to a pipe (POSIX: PIPE_BUF, 4096 here).
_MOST_AT_ONCE = _RECORD.size * (4096 // _RECORD.size)
_PIPE_SIZE = 1 << 20
_READ_AT_ONCE = 1 << 20
_FLUSH_EVERY = 0.5
_END_TIME = 60.0  # s; generous, for a busy machine.


class TappedTransport:
    """A transport that copies its frames into a pipe."""

    def __init__(
        self, transport: CanTransport, pipe: Connection, clock: TimeBase | None = None
    ) -> None:
        """Wraps a transport.

        Args:
            transport: Of the bus.
            pipe: Write end to a `FrameLogger`.
            clock: Of the run; None = the machine's.
        """
        self._transport = transport
        self._pipe = pipe
        os.set_blocking(pipe.fileno(), False)
        # Wall-clock time that does not jump when the clock is set.
        self._clock = clock or TimeBase()
        self._offset = time.time() - self._clock.now()
        self._pending = bytearray()
        self._lost = 0

    def send(self, frame: Frame) -> None:
        """Sends a frame; raises TransportError when the transport fails."""
        self._transport.send(frame)
        self._note(frame, _SENT)

    def receive(self, timeout: float) -> list[Frame]:
        """Returns received frames; raises TransportError when the transport fails."""
        if timeout > 0.0 or len(self._pending) >= _MOST_AT_ONCE:
            self._flush()
        frames = self._transport.receive(timeout)
        for frame in frames:
            self._note(frame, 0)
        return frames

    def reopen(self) -> None:
        """Reopens the transport; raises TransportError if that fails."""
        self._transport.reopen()

    def close(self) -> None:
        """Closes the transport and ends the log."""
        self._transport.close()
        self._flush()
        self._pipe.close()

    def _note(self, frame: Frame, way: int) -> None:
        head = frame.cob_id | way | (_ERROR if frame.is_error else 0)
        now = self._clock.now() + self._offset
        self._pending += _RECORD.pack(now, head, len(frame.data), frame.data)

    def _flush(self) -> None:
        lost = _RECORD.pack(0.0, self._lost, _LOST, b"")
        if self._lost and self._write(lost):
            self._lost = 0
        for start in range(0, len(self._pending), _MOST_AT_ONCE):
            part = self._pending[start : start + _MOST_AT_ONCE]
            if not self._write(part):
                self._lost += len(part) // _RECORD.size
        self._pending.clear()

    def _write(self, data: bytes | bytearray) -> bool:
        try:
            os.write(self._pipe.fileno(), data)
        except OSError:  # Full, or the writer is gone: the bus continues.
            return False
        return True


class FrameLogger:
    """The process that writes the log."""

    def __init__(self, path: Path, channel: str) -> None:
        """Opens the file and starts the process.

        Args:
            path: Log to write; replaces a file of that name.
            channel: Name of the bus in the log.

        Raises:
            InputError: The file cannot be written.
        """
        try:
            path.open("w").close()
        except OSError as error:
            raise InputError(
                f"{path}: {error.strerror}.", code="PNT-BUS-030"
            ) from error
        context = multiprocessing.get_context("spawn")
        read, self.pipe = context.Pipe(duplex=False)
        with contextlib.suppress(OSError):  # A limit of the system's; 64 KiB will do.
            fcntl.fcntl(self.pipe.fileno(), fcntl.F_SETPIPE_SZ, _PIPE_SIZE)
        self._process = context.Process(
            target=_write_log, args=(read, path, channel), name="painter frame log"
        )
        self._process.start()
        read.close()

    def close(self) -> None:
        """Waits until all frames are written."""
        self.pipe.close()
        self._process.join(_END_TIME)
        if self._process.is_alive():
            _LOGGER.error("the frame log did not end and was killed.")
            self._process.kill()
            self._process.join()


def _write_log(pipe: Connection, path: Path, channel: str) -> None:
    """Writes until the other end is closed; the parent handles Ctrl-C."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # Channels may be paths; the format separates by blanks.
    name = channel.replace(" ", "_")
    lost, rest, flushed = 0, b"", time.monotonic()
    with path.open("w", encoding="ascii") as log:
        while data := os.read(pipe.fileno(), _READ_AT_ONCE):
            data = rest + data
            end = len(data) - len(data) % _RECORD.size
            rest = data[end:]
            for when, head, length, payload in _RECORD.iter_unpack(data[:end]):
                if length == _LOST:
                    lost += head
                    continue
                frame = Frame(head & 0x3FFFFFFF, payload[:length], bool(head & _ERROR))
                record = LogRecord(when, frame, bool(head & _SENT))
                log.write(format_record(record, name) + "\n")
            if time.monotonic() - flushed > _FLUSH_EVERY:
                log.flush()
                flushed = time.monotonic()
    if lost:
        _LOGGER.warning("%s lacks %d frames: the disk was too slow.", path, lost)
