"""Pictures from one process to another over a local socket.

`FrameServer` sends what a renderer or player makes. `FrameClient` receives it; it is a
`FrameSource` and feeds librealsense's software device.
"""

import contextlib
import select
import socket
import struct
from pathlib import Path

import numpy as np

from painter.camera.frames import CameraError, ColorArray, DepthArray
from painter.timebase import TimeBase

_HEAD = struct.Struct("<4sdHHB")
_MAGIC = b"pic1"
_SEND_TIME = 1.0
_RECEIVE_TIME = 2.0


class FrameServer:
    """Sends pictures to all clients."""

    def __init__(self, path: str) -> None:
        """Listens.

        Raises:
            CameraError: The path cannot be used.
        """
        self._path = Path(path)
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            if self._path.is_socket():
                self._path.unlink()
            self._listener.bind(path)
        except OSError as error:
            self._listener.close()
            raise CameraError(
                f"camera socket {path}: {error.strerror}.", code="PNT-CAMERA-001"
            ) from error
        self._listener.listen()
        self._clients: list[socket.socket] = []

    def send(self, depth_mm: DepthArray, color: ColorArray | None, when: float) -> None:
        """Sends a picture; disconnects clients that do not read.

        Args:
            depth_mm: (H, W) uint16, mm.
            color: (H, W, 3) RGB, or None.
            when: When it was taken, by the run's clock, s.
        """
        while select.select([self._listener], [], [], 0.0)[0]:
            client, _ = self._listener.accept()
            client.settimeout(_SEND_TIME)
            self._clients.append(client)
        height, width = depth_mm.shape
        data = _HEAD.pack(_MAGIC, when, height, width, color is not None)
        data += np.ascontiguousarray(depth_mm, dtype="<u2").tobytes()
        if color is not None:
            data += np.ascontiguousarray(color, dtype=np.uint8).tobytes()
        for client in list(self._clients):
            try:
                client.sendall(data)
            except OSError:
                self._clients.remove(client)
                client.close()

    def close(self) -> None:
        """Disconnects all clients and removes the socket."""
        for client in self._clients:
            client.close()
        self._listener.close()
        with contextlib.suppress(FileNotFoundError):
            self._path.unlink()


class FrameClient:
    """Pictures of a `FrameServer`; a `FrameSource`.

    It returns every picture at the age of `latency`, like a camera, so that a slow
    rendering is no later than the others.
    """

    def __init__(
        self, path: str, *, latency: float, clock: TimeBase | None = None
    ) -> None:
        """Creates the client; it connects when the first picture is requested.

        Args:
            path: Of the server's socket.
            latency: Age at which pictures are returned, s.
            clock: Of the run, for the time stamps of pictures; None = the machine's.
        """
        self._clock = clock or TimeBase()
        self._path = path
        self._latency = latency
        self._socket: socket.socket | None = None

    def wait_frame(
        self, timeout: float
    ) -> tuple[DepthArray, ColorArray | None, float] | None:
        """See `FrameSource`."""
        try:
            connection = self._connected()
            if not select.select([connection], [], [], timeout)[0]:
                return None
            magic, when, height, width, has_color = _HEAD.unpack(self._read(_HEAD.size))
            if magic != _MAGIC:
                raise ConnectionError("not a picture")
            depth = np.frombuffer(self._read(2 * height * width), "<u2")
            color = None
            if has_color:
                color = np.frombuffer(self._read(3 * height * width), np.uint8)
                color = color.reshape(height, width, 3)
        except OSError as error:
            self.close()
            text = error.strerror or str(error)
            raise CameraError(
                f"camera socket {self._path}: {text}.", code="PNT-CAMERA-002"
            ) from error
        self._clock.sleep(when + self._latency - self._clock.now())
        return depth.reshape(height, width).astype(np.uint16), color, when

    def close(self) -> None:
        """Disconnects."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _connected(self) -> socket.socket:
        if self._socket is None:
            connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
            try:
                connection.connect(self._path)
            except OSError:
                connection.close()
                raise
            connection.settimeout(_RECEIVE_TIME)
            self._socket = connection
        return self._socket

    def _read(self, size: int) -> bytearray:
        assert self._socket is not None
        data, got = bytearray(size), 0
        view = memoryview(data)
        while got < size:
            count = self._socket.recv_into(view[got:])
            if count == 0:
                raise ConnectionResetError(104, "the peer closed the connection")
            got += count
        return data
