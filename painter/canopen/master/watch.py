"""What stops the arm, and how busy the bus is."""

from collections import deque
from collections.abc import Sequence

from painter.canopen.config.bus_config import BusConfig
from painter.canopen.master.drive_client import DriveClient
from painter.canopen.master.io_client import IoClient
from painter.canopen.master.node_client import OPERATIONAL, NodeClient
from painter.canopen.protocol.frames import Frame, frame_time

_WINDOW = 1.0


def first_stop_reason(
    bus: BusConfig,
    drives: Sequence[DriveClient],
    io: IoClient,
    *,
    now: float,
    must_be_enabled: bool,
) -> str | None:
    """Returns the first thing that must stop the arm, or None.

    Args:
        bus: Holds the time-outs.
        drives: All drives.
        io: The I/O node.
        now: Time, s.
        must_be_enabled: Whether the drives should be in OPERATION ENABLED.
    """
    timeouts = bus.timeouts
    nodes: list[NodeClient] = [*drives, io]
    for node in nodes:
        if now - node.heard > timeouts.heartbeat:
            return f"{node.name}: no heartbeat for {timeouts.heartbeat:g} s."
        if node.nmt != OPERATIONAL:
            return f"{node.name}: left NMT state operational (is {node.nmt})."
    for drive in drives:
        # In cycles, not seconds: a master that is late itself must not blame a drive.
        if drive.missed * bus.cycle >= timeouts.tpdo:
            return f"{drive.name}: no TPDO for {drive.missed} cycles."
        complaint = drive.stop_reason(must_be_enabled=must_be_enabled)
        if complaint:
            return complaint
    return io.stop_reason()


class LoadMeter:
    """Worst-case share of the last second that frames take."""

    def __init__(self, bitrate: int) -> None:
        """Creates the meter of a bus with `bitrate` bits a second."""
        self._bitrate = bitrate
        self._frames: deque[tuple[float, float]] = deque()
        self._sum = 0.0

    def note(self, frame: Frame, now: float) -> None:
        """Counts a frame that was sent or came, at a time, s."""
        took = frame_time(len(frame.data), self._bitrate)
        self._frames.append((now, took))
        self._sum += took
        while now - self._frames[0][0] > _WINDOW:
            self._sum -= self._frames.popleft()[1]

    def load(self, now: float) -> float:
        """Returns the share, 0 to 1."""
        if not self._frames:
            return 0.0
        return self._sum / max(now - self._frames[0][0], _WINDOW / 10.0)
