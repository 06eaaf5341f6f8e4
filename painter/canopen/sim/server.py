"""Simulated drives as a process: a rack in real time on a transport."""

import contextlib
import math
import os
import select
import socket
from collections.abc import Callable
from pathlib import Path

from painter.canopen.config.bus_config import BusConfig
from painter.canopen.process.realtime import freeze_gc
from painter.canopen.protocol.frames import SYNC_ID, Frame
from painter.canopen.sim.load import Load
from painter.canopen.sim.rack import STEP, Rack
from painter.canopen.wire.transports import (
    CanTransport,
    TransportError,
    open_transport,
    pack_frame,
    unpack_frame,
)
from painter.timebase import TimeBase

_MOST_BEHIND = 0.1
_MOST_AT_ONCE = 2.0 * STEP
# How long the rack's time waits for a SYNC that is due, s: delays by this computer's
# scheduler are not delays of the bus.
_PATIENCE = 0.05
# How fast the origin of the rack's time follows later SYNCs, s per SYNC.
_CREEP = 0.0001


class LocalHub:
    """Joins all clients of a local socket on one wire; a `CanTransport`."""

    def __init__(self, path: str) -> None:
        """Listens.

        Raises:
            TransportError: The path cannot be used.
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
            raise TransportError(
                f"local {path}: {error.strerror}.", code="PNT-BUS-024"
            ) from error
        self._listener.listen()
        self._clients: list[socket.socket] = []

    def send(self, frame: Frame) -> None:
        """Sends to all clients; drops those that do not read."""
        self._send(frame, besides=None)

    def receive(self, timeout: float) -> list[Frame]:
        """Returns received frames; waits up to `timeout` s for the first one."""
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
        """Does nothing: it never closes by itself."""

    def close(self) -> None:
        """Disconnects all clients and removes the socket."""
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
    """Runs a rack in real time and carries frames between its wire and a transport.

    Frames from the transport take their time on the wire like all others, so the bus
    load is that of a real bus. While drives are operational and SYNCs come, SYNCs drive
    the rack's clock: from one to the next it advances by the cycle that was written to
    the drives (60C2h). It waits for a late SYNC and then continues from when that was
    due; an early SYNC advances it.

    Attributes:
        rack: The simulated nodes.
        transport: To the master.
        slips: How often the rack's time fell behind without catching up.
        sync_late: Longest delay of a SYNC until it was taken, s by the run's clock.
    """

    def __init__(
        self, bus: BusConfig, load: Load | None = None, clock: TimeBase | None = None
    ) -> None:
        """Opens the transport of the bus file ("local" listens) and powers the rack.

        Args:
            bus: The bus file.
            load: What the motors move; see `Rack`.
            clock: Of the run; None = the machine's.

        Raises:
            TransportError: The transport cannot be opened.
        """
        self.rack = Rack(bus, load)
        self.transport: CanTransport = (
            LocalHub(bus.channel) if bus.interface == "local" else open_transport(bus)
        )
        self._send = self.rack.wire.attach(self._to_link)
        self._clock = clock or TimeBase()
        # The run's clock at the rack's time 0, s: `_start` follows each SYNC, `_origin`
        # the SYNCs with the least delay.
        self._start = self._origin = self._clock.now()
        self.slips = 0
        self.sync_late = 0.0
        # When the next SYNC is due in the rack's time, s.
        self._sync_due = math.inf

    def run(self, is_done: Callable[[float], bool]) -> None:
        """Runs until `is_done` of the rack's time, called about every ms, is true."""
        freeze_gc()
        while not is_done(self.rack.now):
            self.serve()

    def clock_time(self) -> float:
        """Returns the rack's present time on the run's clock, s."""
        return self._origin + self.rack.now

    def close(self) -> None:
        """Closes the transport."""
        self.transport.close()

    def _now(self) -> float:
        """Returns the rack's time; it slips after a long delay of this process."""
        now = self._clock.now() - self._start
        behind = now - self.rack.now
        if behind > _MOST_BEHIND:
            self._start += behind - STEP
            self._origin = self._start
            self.slips += 1
            return self.rack.now + STEP
        return now

    def _horizon(self, now: float) -> float:
        """Returns how far the rack may advance: not past a SYNC that is due."""
        due = self._sync_due
        return now if now > due + _PATIENCE else min(now, due)

    def serve(self) -> None:
        """Waits up to a step for frames, takes them, and advances the rack."""
        frames = self._receive(self._clock.machine(self._wait(self._now())))
        now = self._now()
        for frame in frames:
            if frame.cob_id == SYNC_ID:
                now = self._take_sync(now)
            if not frame.is_error:  # From this computer's driver; no node sees it.
                # Its time of arrival is unknown after a delay: before the next step.
                self._send(frame, self.rack.now)
        # After a delay it catches up in short steps, to read frames in between.
        self.rack.advance(min(self._horizon(now), self.rack.now + _MOST_AT_ONCE))

    def _wait(self, now: float) -> float:
        """Returns how long to wait for frames, s; a step at most."""
        step, end = self.rack.now + STEP, self.rack.wire.next_end()
        due = step if end is None else min(step, end)
        is_held = now >= due > self._horizon(now) + 1e-9
        return STEP if is_held else min(max(0.0, due - now), STEP)

    def _receive(self, wait: float) -> list[Frame]:
        try:
            return self.transport.receive(wait)
        except TransportError:
            self._clock.sleep(STEP)
            with contextlib.suppress(TransportError):
                self.transport.reopen()
        return []

    def _take_sync(self, now: float) -> float:
        """Advances to a received SYNC; returns its time in the rack, s.

        It is one cycle after the previous one; the first one after a pause is on the
        next whole step.
        """
        due = self._sync_due
        is_new = math.isinf(due) or now > due + _PATIENCE
        if is_new:
            due = max(now, self.rack.now) + 0.5 * STEP
        else:
            self.sync_late = max(self.sync_late, now - due)
        when = STEP * round(due / STEP)
        self._start += now - when
        latest = self._start if is_new else self._origin + _CREEP
        self._origin = min(self._start, latest)
        self.rack.advance(when)
        # Frames received before it are carried before it: two targets at the next SYNC
        # would be the distance of two cycles in one.
        while (end := self.rack.wire.next_end()) is not None:
            self.rack.wire.advance(end)
        self._sync_due = when + (self.rack.sync_period or math.inf)
        return when

    def _to_link(self, frame: Frame, now: float) -> None:
        with contextlib.suppress(TransportError):
            self.transport.send(frame)
