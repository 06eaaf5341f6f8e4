"""Monitors of the nodes, which stop the arm, and of the bus load."""

from collections import deque

from painter.canopen.config.bus_config import BusConfig
from painter.canopen.master.arm_nodes import ArmNodes
from painter.canopen.protocol.frames import Frame, frame_time
from painter.canopen.protocol.nmt import NmtState

_WINDOW = 1.0


def first_stop_reason(bus: BusConfig, nodes: ArmNodes, *, now: float) -> str | None:
    """Returns the first reason to stop an enabled arm, or None.

    Args:
        bus: Holds the time-outs.
        nodes: All drives and the I/O node.
        now: Time, s.
    """
    timeouts = bus.timeouts
    for node in nodes.all:
        if now - node.heard > timeouts.heartbeat:
            return f"{node.name}: no heartbeat for {timeouts.heartbeat:g} s."
        if node.nmt != NmtState.OPERATIONAL:
            return f"{node.name}: left NMT state OPERATIONAL (is {node.nmt})."
    for drive in nodes.drives:
        # In cycles, not seconds: a late master must not blame a drive.
        if drive.missed * bus.cycle >= timeouts.tpdo:
            return f"{drive.name}: no TPDO for {drive.missed} cycles."
        reason = drive.stop_reason()
        if reason is not None:
            return reason
    return nodes.io.stop_reason()


class LoadMeter:
    """Worst-case bus load of the last second."""

    def __init__(self, bitrate: int) -> None:
        """Creates the meter of a bus with `bitrate` bits a second."""
        self._bitrate = bitrate
        self._frames: deque[tuple[float, float]] = deque()
        self._sum = 0.0

    def note(self, frame: Frame, now: float) -> None:
        """Counts a frame that was sent or received at a time, s."""
        took = frame_time(len(frame.data), self._bitrate)
        self._frames.append((now, took))
        self._sum += took
        while now - self._frames[0][0] > _WINDOW:
            self._sum -= self._frames.popleft()[1]

    def load(self, now: float) -> float:
        """Returns the load, 0 to 1."""
        if not self._frames:
            return 0.0
        return self._sum / max(now - self._frames[0][0], _WINDOW / 10.0)
