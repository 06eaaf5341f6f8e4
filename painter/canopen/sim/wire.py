"""A CAN bus in simulated time: arbitration and transmission times."""

import itertools
from collections.abc import Callable
from dataclasses import dataclass

from painter.canopen.protocol.frames import Frame, frame_time

Receiver = Callable[[Frame, float], None]


@dataclass(frozen=True, order=True)
class _Pending:
    """A frame that waits for the bus; sorts in the order of arbitration."""

    cob_id: int
    order: int
    ready: float
    port: int
    frame: Frame


class Wire:
    """Carries frames between ports, one after the other, lowest identifier first.

    Every frame takes its maximum number of bits, so that a bus load that passes here
    passes on a real bus.

    Attributes:
        receivers: One for each port.
        busy_time: Total transmission time, s.
        frame_count: Number of frames carried.
    """

    def __init__(self, bitrate: int) -> None:
        """Creates an idle wire.

        Args:
            bitrate: Bits per second.
        """
        self._bitrate = bitrate
        self.receivers: list[Receiver] = []
        self._pending: list[_Pending] = []
        self._order = itertools.count()
        self._free = 0.0
        self.busy_time = 0.0
        self.frame_count = 0

    def attach(self, receiver: Receiver) -> Callable[[Frame, float], None]:
        """Adds a port.

        Args:
            receiver: Gets each frame of the other ports, and the time of its end, s.

        Returns:
            A function that sends a frame from this port at a time, s.
        """
        port = len(self.receivers)
        self.receivers.append(receiver)

        def send(frame: Frame, now: float) -> None:
            item = _Pending(frame.cob_id, next(self._order), now, port, frame)
            self._pending.append(item)

        return send

    def next_end(self) -> float | None:
        """Returns when the next frame will end, s; None if none waits."""
        if not self._pending:
            return None
        start, item = self._choose()
        return start + frame_time(len(item.frame.data), self._bitrate)

    def advance(self, until: float) -> None:
        """Carries all frames that end by a time, s, and the frames they trigger."""
        while self._pending:
            start, item = self._choose()
            end = start + frame_time(len(item.frame.data), self._bitrate)
            if end > until:
                return
            self._pending.remove(item)
            self._free = end
            self.busy_time += end - start
            self.frame_count += 1
            for port, receive in enumerate(self.receivers):
                if port != item.port:
                    receive(item.frame, end)

    def _choose(self) -> tuple[float, _Pending]:
        """Returns the start time and the frame that wins the next arbitration."""
        start = max(self._free, min(item.ready for item in self._pending))
        return start, min(item for item in self._pending if item.ready <= start)
