"""Plays a recorded log in place of the bus: a diagram reads what the arm did.

The frames pass through the same clients as on the robot. Times are the log's.
"""

from collections.abc import Sequence

import numpy as np

from painter.canopen.config.bus_config import BusConfig
from painter.canopen.config.units import AXES, joints_from_axes
from painter.canopen.master.arm_nodes import ArmNodes
from painter.canopen.master.drive_client import DriveClient
from painter.canopen.master.feedback import BusState, Feedback, Statistics
from painter.canopen.master.node_client import NodeClient
from painter.canopen.master.setpoints import Setpoint
from painter.canopen.process.bus_process import Report
from painter.canopen.process.sample_ring import Samples
from painter.canopen.protocol.cia402 import Command, State, command_of
from painter.canopen.protocol.frames import ERROR_BUS_OFF, RPDO_BASES, SYNC_ID
from painter.canopen.wire.candump import LogRecord
from painter.errors import InputError


class LogBus:
    """A bus that plays a log; commands to it have no effect."""

    def __init__(self, bus: BusConfig, records: Sequence[LogRecord]) -> None:
        """Reads the whole log; the clock starts where all drives are first enabled.

        Args:
            bus: The bus file.
            records: The log.

        Raises:
            InputError: At no time in the log are all drives enabled.
        """
        listener = _Listener(bus)
        for record in records:
            listener.take(record)
        self._feedbacks = listener.feedbacks
        self._times = np.array([feedback.time for feedback in self._feedbacks])
        enabled = [f.time for f in self._feedbacks if f.bus_state == BusState.ENABLED]
        if not enabled:
            raise InputError(
                "at no time in the log are all drives enabled.",
                code="PNT-BUSLOG-001",
            )
        self.begin, self.end = enabled[0], float(self._times[-1])
        self._now = self.begin

    def start(self) -> None:
        """Does nothing: bring-up is in the log."""

    def push(self, points: list[Setpoint]) -> None:
        """Does nothing: commands are in the log."""

    def stop(self, reason: str) -> None:
        """Does nothing: stops are in the log."""

    def report(self) -> Report:
        """Returns the report at the present time of the log."""
        after = int(np.searchsorted(self._times, self._now, side="right"))
        return Report(self._feedbacks[max(0, after - 1)])

    def samples(self, since: float) -> Samples:
        """Returns samples after a time, s, up to now."""
        first, end = np.searchsorted(self._times, (since, self._now), side="right")
        rows = self._feedbacks[first:end]
        return Samples(
            time=self._times[first:end],
            q=np.array([row.q for row in rows]).reshape(-1, len(AXES)),
            v=np.array([row.v for row in rows]).reshape(-1, len(AXES)),
            trigger=np.array([row.trigger for row in rows]),
        )

    def now(self) -> float:
        """Returns the present time of the log, s."""
        return self._now

    def wait_until(self, when: float) -> None:
        """Advances the present time to `when`, s."""
        self._now = max(self._now, when)

    def close(self) -> None:
        """Nothing to close."""


class _Listener:
    """Takes the frames of a log and records the arm's state at each SYNC."""

    def __init__(self, bus: BusConfig) -> None:
        self.feedbacks: list[Feedback] = []
        self._nodes = ArmNodes(bus, lambda frame: None)
        self._drives, self._io = self._nodes.drives, self._nodes.io
        self._valve = 1 << bus.io.valve_bit
        self._full_flow = bus.io.flow_full_scale
        self._state, self._reason, self._stopped_at = BusState.STARTING, "", 0.0
        # After a stop, drives report OPERATION ENABLED for one more cycle.
        self._has_left = True
        # Drives answer a SYNC with what they measured at it.
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
        node = self._nodes.find(frame.cob_id)
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
        q, v = self._nodes.joint_state()
        targets = np.array([d.units.angle(d.target) for d in self._drives])
        feedback = Feedback(
            time=time,
            bus_state=self._state,
            reason=self._reason,
            stopped_at=self._stopped_at,
            q=q,
            v=v,
            q_commanded=joints_from_axes(targets),
            trigger=self._io.trigger,
            axes=tuple(drive.status() for drive in self._drives),
            is_chain_closed=self._io.is_chain_closed,
            pressure=self._io.pressure,
            buffered=0,
            statistics=Statistics(cycles=len(self.feedbacks) + 1),
        )
        # Clocks of loggers may step back, so that a SYNC is before the last one.
        if not self.feedbacks or time > self.feedbacks[-1].time:
            self.feedbacks.append(feedback)

    def _watch(self, now: float) -> None:
        """Derives the bus state from statuswords and controlwords."""
        is_enabled = all(drive.state == State.ENABLED for drive in self._drives)
        is_commanded = all(
            command_of(d.controlword) == Command.ENABLE_OPERATION for d in self._drives
        )
        if self._state != BusState.ENABLED:
            self._has_left |= not (is_enabled and is_commanded)
            if is_enabled and is_commanded and self._has_left:
                self._state, self._reason, self._stopped_at = BusState.ENABLED, "", 0.0
            return
        reasons = [d.stop_reason() for d in self._drives]
        if not is_commanded:
            reasons.append("the master stopped the arm.")
        if self._io.inputs is not None:
            reasons.insert(0, self._io.stop_reason())
        found = next((reason for reason in reasons if reason), None)
        if found is not None:
            self._stop(found, now)
