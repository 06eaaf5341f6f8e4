"""Transports of CAN frames: any python-can interface, or a socket on this machine."""

import select
import socket
import struct
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, Protocol

import can

from painter.canopen.config.bus_config import BusConfig
from painter.canopen.protocol.frames import Frame
from painter.errors import BusError

# One frame in a packet: identifier, length, padding, data; as Linux's struct can_frame.
_LAYOUT = struct.Struct("<IB3x8s")
_MOST_AT_ONCE = 256


class TransportError(BusError):
    """The transport failed; it may be reopened."""


class CanTransport(Protocol):
    """Carries frames to and from a bus, for one thread."""

    def send(self, frame: Frame) -> None:
        """Sends a frame; raises TransportError when the transport fails."""

    def receive(self, timeout: float) -> list[Frame]:
        """Returns received frames; waits up to `timeout` s for the first one."""

    def reopen(self) -> None:
        """Reopens the transport; raises TransportError if that fails."""

    def close(self) -> None:
        """Closes the transport."""


def open_transport(bus: BusConfig) -> CanTransport:
    """Opens the interface and channel of a bus file.

    Raises:
        TransportError: It cannot be opened; names both.
    """
    if bus.interface == "local":
        return LocalTransport(bus.channel)
    return PythonCanTransport(bus.interface, bus.channel, bus.bitrate)


class PythonCanTransport:
    """A python-can interface."""

    def __init__(self, interface: str, channel: str, bitrate: int) -> None:
        """Opens it.

        Raises:
            TransportError: It cannot be opened; names both.
        """
        self._options = (interface, channel, bitrate)
        self._bus: can.BusABC | None = None
        # udp_multicast returns a bus its own frames.
        self._echoes = interface == "udp_multicast"
        self._own: list[tuple[int, bytes]] = []
        self.reopen()

    def reopen(self) -> None:
        """Opens the interface anew: a failed python-can bus does not recover."""
        self.close()
        interface, channel, bitrate = self._options
        extra: dict[str, Any] = {"fd": False} if self._echoes else {}
        try:
            self._bus = can.Bus(
                interface=interface,
                channel=channel,
                bitrate=bitrate,
                receive_own_messages=False,
                **extra,
            )
        except (can.CanError, OSError, ValueError, ImportError) as error:
            text = " ".join(str(error).split())
            raise TransportError(
                f"{interface} {channel}: {text}", code="PNT-BUS-031"
            ) from error

    def send(self, frame: Frame) -> None:
        """Sends a frame."""
        if self._bus is None:
            raise TransportError("the CAN interface is closed.", code="PNT-BUS-032")
        if self._echoes:
            self._own = [*self._own[-255:], (frame.cob_id, frame.data)]
        message = can.Message(
            arbitration_id=frame.cob_id, data=frame.data, is_extended_id=False
        )
        try:
            self._bus.send(message)
        except (can.CanError, OSError) as error:
            raise TransportError(
                f"sending failed: {error}", code="PNT-BUS-033"
            ) from error

    def receive(self, timeout: float) -> list[Frame]:
        """Returns received frames; waits up to `timeout` s for the first one."""
        if self._bus is None:
            raise TransportError("the CAN interface is closed.", code="PNT-BUS-034")
        frames: list[Frame] = []
        try:
            message = self._bus.recv(timeout)
            while message is not None and len(frames) < _MOST_AT_ONCE:
                self._take(message, frames)
                message = self._bus.recv(0.0)
            if message is not None:
                self._take(message, frames)
        except (can.CanError, OSError) as error:
            raise TransportError(
                f"receiving failed: {error}", code="PNT-BUS-035"
            ) from error
        return frames

    def close(self) -> None:
        """Closes the interface."""
        if self._bus is not None:
            with suppress(can.CanError, OSError):
                self._bus.shutdown()
            self._bus = None

    def _take(self, message: can.Message, frames: list[Frame]) -> None:
        data = bytes(message.data)
        if self._echoes and (message.arbitration_id, data) in self._own:
            self._own.remove((message.arbitration_id, data))
            return
        if message.is_error_frame:
            frames.append(Frame(message.arbitration_id, data, is_error=True))
        elif not (message.is_extended_id or message.is_remote_frame or message.is_fd):
            frames.append(Frame(message.arbitration_id, data))


def pack_frame(frame: Frame) -> bytes:
    """Returns a frame as one packet of a local socket."""
    return _LAYOUT.pack(frame.cob_id, len(frame.data), frame.data)


def unpack_frame(packet: bytes) -> Frame | None:
    """Returns the frame of a packet; None if it holds none."""
    if len(packet) != _LAYOUT.size:
        return None
    cob_id, length, data = _LAYOUT.unpack(packet)
    if cob_id > 0x7FF or length > 8:
        return None
    return Frame(cob_id, data[:length])


class LocalTransport:
    """A lossless socket to `painter drives` on this machine."""

    def __init__(self, path: str) -> None:
        """Connects.

        Raises:
            TransportError: Nothing listens on the path.
        """
        self._path = path
        self._socket: socket.socket | None = None
        self.reopen()

    def reopen(self) -> None:
        """Reconnects."""
        self.close()
        connection = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        try:
            connection.connect(self._path)
        except OSError as error:
            connection.close()
            raise TransportError(
                f"local {self._path}: {error.strerror}.", code="PNT-BUS-036"
            ) from error
        self._socket = connection

    def send(self, frame: Frame) -> None:
        """Sends a frame."""
        with self._connected() as connection:
            connection.send(pack_frame(frame))

    def receive(self, timeout: float) -> list[Frame]:
        """Returns received frames; waits up to `timeout` s for the first one."""
        frames: list[Frame] = []
        wait = max(timeout, 0.0)
        with self._connected() as connection:
            while len(frames) < _MOST_AT_ONCE:
                # select() waits to the microsecond, a socket's own time-out to the
                # millisecond.
                if not select.select([connection], [], [], wait)[0]:
                    break
                packet = connection.recv(64)
                if not packet:
                    raise ConnectionResetError(104, "the peer closed the connection")
                frame = unpack_frame(packet)
                if frame is not None:
                    frames.append(frame)
                wait = 0.0
        return frames

    def close(self) -> None:
        """Disconnects."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    @contextmanager
    def _connected(self) -> Iterator[socket.socket]:
        """Yields the socket; raises TransportError if it fails or is closed."""
        if self._socket is None:
            raise TransportError(
                f"local {self._path}: not connected.", code="PNT-BUS-037"
            )
        try:
            yield self._socket
        except OSError as error:
            raise TransportError(
                f"local {self._path}: {error.strerror}.", code="PNT-BUS-038"
            ) from error
