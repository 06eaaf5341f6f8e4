"""The master: one object that owns the bus; no thread, no clock of its own.

Call `cycle` once a cycle with its due time, and `poll` as often as needed in between:
`process/bus_process.py` does so in real time, tests in simulated time. Any fault stops
all axes, closes the gun and latches the reason until `acknowledge`.
"""

import logging
from collections.abc import Callable, Sequence

from painter.canopen.config.bus_config import BusConfig
from painter.canopen.config.units import axes_from_joints
from painter.canopen.master.arm_nodes import ArmNodes
from painter.canopen.master.feedback import BusState, Feedback, Statistics
from painter.canopen.master.follower import SetpointFollower
from painter.canopen.master.node_client import NodeClient, Script, run_concurrently
from painter.canopen.master.setpoints import Setpoint
from painter.canopen.master.watch import LoadMeter, first_stop_reason
from painter.canopen.protocol.cia402 import Command
from painter.canopen.protocol.frames import (
    ERROR_BUS_OFF,
    HEARTBEAT_BASE,
    SYNC_ID,
    Frame,
    frame_time,
)
from painter.canopen.protocol.nmt import NmtState
from painter.canopen.wire.transports import CanTransport, TransportError
from painter.errors import BusError
from perception.ground import FloatArray

_LOGGER = logging.getLogger(__name__)
_REOPEN_EVERY = 0.25


class ArmBus:
    """Brings nodes up, streams setpoints, monitors the nodes, stops the arm.

    Attributes:
        state: What the bus does.
        reason: Why the arm was stopped; empty if it was not.
        is_lost: Whether the transport has failed.
        drives: Clients of the drives.
        io: Client of the I/O node.
        before_sync: Called right before each SYNC.
        measured: Called when all drives have answered a SYNC, with its due time, s, q
            (5,) rad, v (5,) rad/s and trigger.
    """

    def __init__(self, bus: BusConfig, transport: CanTransport) -> None:
        """Creates the master; nothing is sent yet.

        Args:
            bus: The bus file.
            transport: Carries the frames.

        Raises:
            InputError: The EDS of a drive does not allow its configuration.
        """
        self._bus = bus
        self._transport = transport
        self._nodes = ArmNodes(bus, self._send)
        self.drives, self.io = self._nodes.drives, self._nodes.io
        self._follower = SetpointFollower(
            bus.joint_limits(),
            cycle=bus.cycle,
            timeout=bus.timeouts.setpoint,
            sync_time=frame_time(0, bus.bitrate),
        )
        self.state = BusState.DOWN
        self.reason = ""
        self._stopped_at = 0.0
        self.before_sync: Callable[[], None] = lambda: None
        self.measured: Callable[[float, FloatArray, FloatArray, float], None] = (
            lambda *sample: None
        )
        self._script: Script | None = None
        self._is_cyclic = False  # SYNCs are sent and process data is monitored.
        self.is_lost = False
        self._reopen_at = 0.0
        self._next_heartbeat = 0.0
        self._last_cycle: float | None = None
        self._now = 0.0
        counted = ("cycles", "overruns", "missing", "foreign", "malformed")
        self._counts = dict.fromkeys(counted, 0)
        self._meter = LoadMeter(bus.bitrate)

    @property
    def is_idle(self) -> bool:
        """Whether no script (bring-up, homing, switching off) runs."""
        return self._script is None

    # Commands.

    def start(self) -> None:
        """Begins bring-up: configure, verify, operational, enable, home."""
        self._follower.release()
        self._begin(self._start_up(self._nodes.all))

    def acknowledge(self) -> None:
        """Restarts after a stop; configures nodes that rebooted.

        Raises:
            BusError: Nothing is latched, or the cause persists; names it.
        """
        if self.state != BusState.STOPPED:
            raise BusError(
                f"nothing to acknowledge: the bus is {self.state}.", code="PNT-BUS-001"
            )
        if self.is_lost:
            raise BusError(
                f"cannot acknowledge, the bus is still lost: {self.reason}",
                code="PNT-BUS-002",
            )
        if self.io.inputs is not None and not self.io.is_chain_closed:
            raise BusError(
                "cannot acknowledge: the e-stop chain is open.", code="PNT-BUS-003"
            )
        self.reason, self._stopped_at = "", 0.0
        self._follower.release()
        self._begin(
            self._start_up([n for n in self._nodes.all if not n.is_healthy(self._now)])
        )

    def push(self, points: Sequence[Setpoint]) -> None:
        """Adds setpoints; drops them unless the drives are enabled.

        Raises:
            ValueError: The times do not increase, or a value is not finite.
        """
        if self.state == BusState.ENABLED:
            self._follower.push(points)

    def stop(self, reason: str, *, quick: bool = False) -> None:
        """Stops all axes, closes the gun and latches the reason.

        Args:
            reason: Stays in the feedback until it is acknowledged.
            quick: By the drives' quick stop; else by a ramp, with the drives enabled.
        """
        was, self.io.trigger = self.state, 0.0
        if not self.reason:
            self.reason, self._stopped_at = reason, self._now
            _LOGGER.warning("stopped: %s", reason)
        self.state = BusState.STOPPED
        if self._script is not None:
            self._script.close()
            self._script = None
        if quick or was not in (BusState.ENABLED, BusState.STOPPED):
            self._follower.release()
            for drive in self.drives:
                drive.controlword = Command.QUICK_STOP
                drive.target = drive.position
        elif was == BusState.ENABLED:
            self._follower.brake(self._now)
        self._send_outputs()

    def shut_down(self) -> None:
        """Begins to switch off: ramp, brakes, power."""
        if self.state in (BusState.ENABLED, BusState.STARTING):
            self.stop("switched off.")
        self._begin(self._switch_off(self._now + self._follower.braking_time))

    # Time.

    def cycle(self, now: float, *, overruns: int = 0) -> None:
        """Runs one cycle: reads what was received, then sends SYNC, gun and targets.

        Args:
            now: When the cycle was due, s.
            overruns: Cycles that were skipped before it.
        """
        self.poll(now)
        self._counts["overruns"] += overruns
        self._follower.fall_behind(overruns)
        if self._is_cyclic and not self.is_lost:
            self._note_measured()
            self._expect_answers()
            self._counts["cycles"] += 1
            self.before_sync()
            self._send(Frame(SYNC_ID))
            self._follow(now)
            self._send_outputs()
        self._last_cycle = now

    def poll(self, now: float, timeout: float = 0.0) -> None:
        """Receives frames, monitors the nodes and continues the running script.

        Args:
            now: Time, s.
            timeout: How long to wait for a frame, s.
        """
        self._now = now
        frames: list[Frame] = []
        if self.is_lost:
            self._reopen(now)
        else:
            try:
                frames = self._transport.receive(timeout)
            except TransportError as error:
                self._lose(f"bus lost: {error}")
        for frame in frames:
            self._take(frame, now)
        if self.is_lost:
            return
        if self.state != BusState.DOWN and now >= self._next_heartbeat:
            self._next_heartbeat = now + self._bus.timeouts.heartbeat / 3.0
            state = bytes([NmtState.OPERATIONAL])
            self._send(Frame(HEARTBEAT_BASE + self._bus.master_id, state))
        for node in self._nodes.all:
            node.poll(now)
        self._monitor(now)
        self._advance_script()

    def feedback(self) -> Feedback:
        """Returns the state of the arm."""
        q, v = self._nodes.joint_state()
        return Feedback(
            time=self._now,
            bus_state=self.state,
            reason=self.reason,
            stopped_at=self._stopped_at,
            q=q,
            v=v,
            q_commanded=self._follower.q.copy(),
            trigger=self.io.trigger,
            axes=tuple(drive.status() for drive in self.drives),
            is_chain_closed=self.io.is_chain_closed,
            pressure=self.io.pressure,
            buffered=len(self._follower),
            statistics=Statistics(
                **self._counts,
                retries=sum(node.sdo.retry_count for node in self._nodes.all),
                load=self._meter.load(self._now),
            ),
        )

    # Scripts.

    def _begin(self, script: Script) -> None:
        if self._script is not None:
            self._script.close()
        self.state = BusState.STARTING
        self._script = script

    def _advance_script(self) -> None:
        if self._script is None:
            return
        try:
            next(self._script)
        except StopIteration:
            self._script = None
        except BusError as error:
            self._script = None
            self.stop(str(error), quick=True)

    def _start_up(self, nodes: Sequence[NodeClient]) -> Script:
        if nodes:
            self._is_cyclic = False  # No SYNC while PDOs are mapped.
            yield from run_concurrently([node.bring_up() for node in nodes])
        for node in self._nodes.all:
            node.got_tpdo, node.missed, node.alarm = False, 0, None
            node.start()
        for drive in self.drives:
            drive.forget_owed()
        self._is_cyclic = True
        yield from run_concurrently(
            [node.wait_operational() for node in self._nodes.all]
        )
        if not self.io.is_chain_closed:
            raise BusError("e-stop: the chain is open.", code="PNT-BUS-004")
        yield from run_concurrently([drive.enable() for drive in self.drives])
        for drive in self.drives:
            yield from drive.home()
        self._follower.hold(self._nodes.joint_state()[0])
        self.state = BusState.ENABLED

    def _switch_off(self, standing: float) -> Script:
        """Waits for the end of the ramp, a time in s; then brakes and power."""
        self.io.trigger = 0.0
        while self._now < standing:
            yield
        self._follower.release()
        if self._is_cyclic:
            yield from run_concurrently([drive.disable() for drive in self.drives])
        self._is_cyclic = False
        self.state = BusState.DOWN

    # Parts of a cycle.

    def _follow(self, now: float) -> None:
        """Hands the command of this cycle to the drives."""
        follower = self._follower
        if self.state != BusState.ENABLED and not follower.is_braking:
            return
        problem = follower.step(now)
        if problem is not None:
            self.stop(problem)
            follower.step(now)
        self.io.trigger = follower.trigger
        axes = axes_from_joints(follower.q)
        for drive, angle in zip(self.drives, axes, strict=True):
            drive.target = drive.units.counts(float(angle))

    def _note_measured(self) -> None:
        """Reports the answers to the last SYNC if they are complete."""
        if self._last_cycle is not None and all(d.is_measured for d in self.drives):
            q, v = self._nodes.joint_state()
            self.measured(self._last_cycle, q, v, self.io.trigger)

    def _send_outputs(self) -> None:
        if not self._is_cyclic:
            return
        self.io.send_outputs()  # First, so that the gun is never last.
        for drive in self.drives:
            self._send(drive.rpdo())

    def _expect_answers(self) -> None:
        came = [drive.expect_answer() for drive in self.drives]
        if self._counts["cycles"] > 0:
            self._counts["missing"] += came.count(False)
        # Scripts that wait for a new one clear the flag themselves.
        if self.state != BusState.STARTING:
            for drive in self.drives:
                drive.got_tpdo = False

    def _monitor(self, now: float) -> None:
        """Stops the arm for alarms, and while it is controlled for all else."""
        if not self._is_cyclic:
            return
        for node in self._nodes.all:
            alarm, node.alarm = node.alarm, None
            is_expected = self.state == BusState.STARTING and node.is_configured
            if alarm is not None and not is_expected:
                self.stop(alarm, quick=True)
        if self.state == BusState.ENABLED or (
            self.state == BusState.STOPPED and self._follower.is_braking
        ):
            reason = first_stop_reason(self._bus, self._nodes, now=now)
            if reason is not None:
                self.stop(reason, quick=True)

    # The transport.

    def _take(self, frame: Frame, now: float) -> None:
        self._meter.note(frame, self._now)
        if frame.is_error:
            if frame.cob_id & ERROR_BUS_OFF:
                self._lose("bus-off: the CAN controller gave up.")
            return
        node = self._nodes.find(frame.cob_id)
        if node is None or frame.cob_id < SYNC_ID:
            self._counts["foreign"] += 1
        elif not node.take(frame, now):
            self._counts["malformed"] += 1

    def _send(self, frame: Frame) -> None:
        if self.is_lost:
            return
        self._meter.note(frame, self._now)
        try:
            self._transport.send(frame)
        except TransportError as error:
            self._lose(f"bus lost: {error}")

    def _lose(self, reason: str) -> None:
        self.is_lost = True
        self._reopen_at = self._now + _REOPEN_EVERY
        self.stop(reason, quick=True)

    def _reopen(self, now: float) -> None:
        if now < self._reopen_at:
            return
        self._reopen_at = now + _REOPEN_EVERY
        try:
            self._transport.reopen()
        except TransportError as error:
            _LOGGER.debug("still lost: %s", error)
            return
        _LOGGER.warning("the bus is back; the stop stays latched until acknowledged.")
        self.is_lost = False
        for node in self._nodes.all:
            node.heard = now
            node.missed = 0
