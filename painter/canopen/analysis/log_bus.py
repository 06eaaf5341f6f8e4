"""A recorded log in the bus's place: what a diagram reads is what the arm did then.

The frames go through the same clients as on the robot. Times are the log's.
"""

from collections.abc import Sequence

import numpy as np

from painter.canopen.config.bus_config import BusConfig
from painter.canopen.config.units import AXES, joints_from_axes
from painter.canopen.master.drive_client import DriveClient
from painter.canopen.master.feedback import BusState, Feedback, Statistics
from painter.canopen.master.io_client import IoClient
from painter.canopen.master.node_client import NodeClient
from painter.canopen.master.setpoints import Setpoint
from painter.canopen.process.bus_process import Report
from painter.canopen.process.sample_ring import Samples
from painter.canopen.protocol.cia402 import Command, State, command_of
from painter.canopen.protocol.frames import ERROR_BUS_OFF, RPDO_BASES, SYNC_ID, Frame
from painter.canopen.wire.candump import LogRecord
from painter.errors import InputError
from perception.ground import FloatArray


class LogBus:
    """A bus that plays a log; commands to it have no effect."""

    def __init__(self, bus: BusConfig, records: Sequence[LogRecord]) -> None:
        """Reads the log through; the clock stands where all drives were first enabled.

        Args:
            bus: What was on the bus.
            records: The log.

        Raises:
            InputError: The drives are never all enabled in it.
        """
        listener = _Listener(bus)
        for record in records:
            listener.take(record)
        self._feedbacks = listener.feedbacks
        self._times = np.array([feedback.time for feedback in self._feedbacks])
        enabled = [f.time for f in self._feedbacks if f.bus_state == BusState.ENABLED]
        if not enabled:
            raise InputError(
                "the log holds no time at which all drives are enabled.",
                code="PNT-BUSLOG-001",
            )
        self.begin, self.end = enabled[0], float(self._times[-1])
        self._now = self.begin

    def start(self) -> None:
        """Bring-up is in the log."""

    def push(self, points: list[Setpoint]) -> None:
        """What was commanded is in the log."""

    def stop(self, reason: str) -> None:
        """What stopped the arm is in the log."""

    def report(self) -> Report:
        """Returns what the bus knew at its present."""
        after = int(np.searchsorted(self._times, self._now, side="right"))
        return Report(self._feedbacks[max(0, after - 1)])

    def samples(self, since: float) -> Samples:
        """Returns what was measured after a time and up to now, s."""
        first, end = np.searchsorted(self._times, (since, self._now), side="right")
        rows = self._feedbacks[first:end]
        return Samples(
            time=self._times[first:end],
            q=np.array([row.q for row in rows]).reshape(-1, len(AXES)),
            v=np.array([row.v for row in rows]).reshape(-1, len(AXES)),
            trigger=np.array([row.trigger for row in rows]),
        )

    def now(self) -> float:
        """Returns the log's present, s."""
        return self._now

    def wait_until(self, when: float) -> None:
        """Makes a time, s, the present."""
        self._now = max(self._now, when)

    def close(self) -> None:
        """Nothing to close."""


class _Listener:
    """Takes the frames of a log and notes the arm's state at each SYNC."""

    def __init__(self, bus: BusConfig) -> None:
        def send(frame: Frame) -> None:
            """Clients that only listen send nothing."""

        self.feedbacks: list[Feedback] = []
        self._drives = [
            DriveClient(axis, bus, limits, send)
            for axis, limits in zip(AXES, bus.drive_limits(), strict=True)
        ]
        self._io = IoClient(bus, send)
        nodes: list[NodeClient] = [*self._drives, self._io]
        self._by_id = {node.node_id: node for node in nodes}
        self._nodes = nodes
        self._valve = 1 << bus.io.valve_bit
        self._full_flow = bus.io.flow_full_scale
        self._state, self._reason, self._stopped_at = BusState.STARTING, "", 0.0
        # Drives go on saying that they are enabled for a cycle after a stop.
        self._has_left = True
        # What the drives answer to a SYNC was measured at it.
        self._last_sync: float | None = None

    def take(self, record: LogRecord) -> None:
        frame, now = record.frame, record.time
        if frame.is_error:
            if frame.cob_id & ERROR_BUS_OFF:
                self._stop("bus-off: the CAN controller gave up.", now)
            return
        if frame.cob_id == SYNC_ID:
            if self._last_sync is not None:
                self._note(self._last_sync)
            self._last_sync = now
            return
        node = self._by_id.get(frame.cob_id & 0x7F)
        if node is None:
            return
        if frame.cob_id == RPDO_BASES[0] + node.node_id:
            self._take_command(node, frame.data)
        elif frame.cob_id >= SYNC_ID:
            node.is_configured = self._state == BusState.ENABLED
            node.take(frame, now)
            if node.alarm is not None and self._state == BusState.ENABLED:
                self._stop(node.alarm, now)
            node.alarm = None

    def _take_command(self, node: NodeClient, data: bytes) -> None:
        if isinstance(node, DriveClient) and len(data) == 6:
            node.controlword = int.from_bytes(data[:2], "little")
            node.target = int.from_bytes(data[2:], "little", signed=True)
        elif node is self._io and len(data) == 3:
            flow = int.from_bytes(data[1:], "little", signed=True)
            is_open = data[0] & self._valve
            self._io.trigger = flow / self._full_flow if is_open else 0.0

    def _stop(self, reason: str, now: float) -> None:
        if not self._reason:
            self._state, self._reason, self._stopped_at = BusState.STOPPED, reason, now
            self._has_left = False

    def _note(self, time: float) -> None:
        self._watch(time)
        axes = [d.units.angle(d.position) for d in self._drives]
        speeds = [d.units.speed(d.velocity) for d in self._drives]
        targets = [d.units.angle(d.target) for d in self._drives]
        feedback = Feedback(
            time=time,
            bus_state=self._state,
            reason=self._reason,
            stopped_at=self._stopped_at,
            q=_joints(axes),
            v=_joints(speeds),
            q_commanded=_joints(targets),
            trigger=self._io.trigger,
            axes=tuple(drive.status() for drive in self._drives),
            is_chain_closed=self._io.is_chain_closed,
            pressure=self._io.pressure,
            buffered=0,
            statistics=Statistics(cycles=len(self.feedbacks) + 1),
        )
        # Error frames and slow clocks of loggers may put a SYNC before the last one.
        if not self.feedbacks or time > self.feedbacks[-1].time:
            self.feedbacks.append(feedback)

    def _watch(self, now: float) -> None:
        """Derives the bus state from what the drives say and are told."""
        is_enabled = all(drive.state == State.ENABLED for drive in self._drives)
        is_told = all(
            command_of(d.controlword) == Command.ENABLE_OPERATION for d in self._drives
        )
        if self._state != BusState.ENABLED:
            self._has_left |= not (is_enabled and is_told)
            if is_enabled and is_told and self._has_left:
                self._state, self._reason, self._stopped_at = BusState.ENABLED, "", 0.0
            return
        complaints = [d.stop_reason(must_be_enabled=True) for d in self._drives]
        if not is_told:
            complaints.append("the master stopped the arm.")
        if self._io.inputs is not None:
            complaints.insert(0, self._io.stop_reason())
        found = next((text for text in complaints if text), None)
        if found is not None:
            self._stop(found, now)


def _joints(axes: list[float]) -> FloatArray:
    return joints_from_axes(np.array(axes))
