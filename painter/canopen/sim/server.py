"""Simulated drives as a process: a rack in real time, behind a link."""

import contextlib
import os
import select
import socket
import time
from collections.abc import Callable
from pathlib import Path

from painter.canopen.bus_config import BusConfig
from painter.canopen.frames import SYNC_ID, Frame
from painter.canopen.links import Link, LinkError, open_link, pack_frame, unpack_frame
from painter.canopen.realtime import settle_memory
from painter.canopen.sim.load import Load
from painter.canopen.sim.rack import STEP, Rack

_MOST_BEHIND = 0.1
_MOST_AT_ONCE = 2.0 * STEP


class LocalHub:
    """Listens on a local socket and joins all who connect on one wire; a `Link`."""

    def __init__(self, path: str) -> None:
        """Listens.

        Raises:
            LinkError: The path cannot be used.
        """
        self._path = Path(path)
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        try:
            with contextlib.suppress(FileNotFoundError):
                if self._path.is_socket():
                    self._path.unlink()
            self._listener.bind(path)
        except OSError as error:
            self._listener.close()
            raise LinkError(f"local {path}: {error.strerror}.") from error
        self._listener.listen()
        self._clients: list[socket.socket] = []

    def send(self, frame: Frame) -> None:
        """Sends to all who are connected; those who do not read are dropped."""
        self._send(frame, besides=None)

    def receive(self, timeout: float) -> list[Frame]:
        """Returns frames that came; waits up to `timeout` s for the first one."""
        frames: list[Frame] = []
        waiting = [self._listener, *self._clients]
        ready, _, _ = select.select(waiting, [], [], timeout)
        for source in ready:
            if source is self._listener:
                client, _ = self._listener.accept()
                client.setblocking(False)
                self._clients.append(client)
                continue
            self._drain(source, frames)
        return frames

    def reopen(self) -> None:
        """It never closes by itself."""

    def close(self) -> None:
        """Disconnects all and removes the socket."""
        for client in self._clients:
            client.close()
        self._listener.close()
        with contextlib.suppress(FileNotFoundError):
            os.unlink(self._path)

    def _drain(self, source: socket.socket, frames: list[Frame]) -> None:
        try:
            while packet := source.recv(64):
                frame = unpack_frame(packet)
                if frame is not None:
                    frames.append(frame)
                    self._send(frame, besides=source)
        except BlockingIOError:
            return
        except OSError:
            pass
        self._drop(source)

    def _send(self, frame: Frame, *, besides: socket.socket | None) -> None:
        for client in list(self._clients):
            if client is besides:
                continue
            try:
                client.send(pack_frame(frame))
            except OSError:
                self._drop(client)

    def _drop(self, client: socket.socket) -> None:
        if client in self._clients:
            self._clients.remove(client)
        client.close()


class RackServer:
    """Runs a rack in real time and carries frames between its wire and a link.

    Frames from the link take their time on the wire like all others, so what the rack
    charges is what a real bus would.
    """

    def __init__(self, bus: BusConfig, load: Load | None = None) -> None:
        """Opens the link of the bus file ("local" listens) and powers the rack.

        Args:
            bus: What is on the bus.
            load: What the motors move; see `Rack`.

        Raises:
            LinkError: The link cannot be opened.
        """
        self.rack = Rack(bus, load)
        self._link: Link = (
            LocalHub(bus.channel) if bus.interface == "local" else open_link(bus)
        )
        self._send = self.rack.wire.attach(self._to_link)
        self._start = time.monotonic()
        self.slips = 0
        self._synced = 0.0

    def run(self, is_done: Callable[[float], bool]) -> None:
        """Runs until `is_done`, which is asked about every ms with the rack's time."""
        settle_memory()
        while not is_done(self.rack.now):
            self._serve(self._now())

    def monotonic(self) -> float:
        """Returns the rack's present time by `time.monotonic()`, s."""
        return self._start + self.rack.now

    def close(self) -> None:
        """Gives the link up."""
        self._link.close()

    def _now(self) -> float:
        """Time of the rack; it slips when this process was held up for long."""
        now = time.monotonic() - self._start
        behind = now - self.rack.now
        if behind > _MOST_BEHIND:
            self._start += behind - STEP
            self.slips += 1
            return self.rack.now + STEP
        return now

    def _serve(self, now: float) -> None:
        due = self.rack.now + STEP
        end = self.rack.wire.next_end()
        wait = max(0.0, min(due, due if end is None else end) - now)
        try:
            frames = self._link.receive(wait)
        except LinkError:
            frames = []
            time.sleep(STEP)
            with contextlib.suppress(LinkError):
                self._link.reopen()
        now = max(self._now(), self.rack.now)
        has_sync = any(frame.cob_id == SYNC_ID for frame in frames)
        when = self.rack.now if has_sync else now
        for frame in frames:
            if frame.cob_id == SYNC_ID:
                when = self._sync_time(now)
                self.rack.advance(when)
            if not frame.is_error:  # Of this computer's controller; no node sees it.
                self._send(frame, when)
        # Held up, it goes on in short steps: there may be frames to be read between.
        self.rack.advance(min(now, self.rack.now + _MOST_AT_ONCE))

    def _sync_time(self, now: float) -> float:
        """Returns when a SYNC came: when it was due, if this process was held up since.

        Else nodes would see none for long, and then several at once.
        """
        due = max(self._synced + self.rack.bus.cycle, self.rack.now)
        self._synced = min(now, due) if now - due < _MOST_BEHIND else now
        return self._synced

    def _to_link(self, frame: Frame, now: float) -> None:
        with contextlib.suppress(LinkError):
            self._link.send(frame)
