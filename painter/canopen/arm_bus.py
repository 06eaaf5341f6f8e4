"""The master: one object that owns the bus; no thread, no clock of its own.

`cycle` is called once a cycle with its due time, `poll` as often as wished in between;
cyclic_loop.py does that in real time, tests in simulated time. Whatever goes wrong
stops all axes, closes the gun and latches the reason until `acknowledge`.
"""

import logging
from collections import deque
from collections.abc import Iterable, Sequence

import numpy as np

from painter.canopen.bus_config import BusConfig
from painter.canopen.cia402 import Command
from painter.canopen.drive_client import DriveClient
from painter.canopen.feedback import AxisStatus, Feedback, Phase, Statistics
from painter.canopen.frames import (
    ERROR_BUS_OFF,
    HEARTBEAT_BASE,
    SYNC_ID,
    Frame,
    frame_time,
)
from painter.canopen.io_client import IoClient
from painter.canopen.links import Link, LinkError
from painter.canopen.node_client import OPERATIONAL, NodeClient, Script
from painter.canopen.setpoints import Sample, Setpoint, SetpointBuffer, StopRamp
from painter.canopen.units import (
    AXES,
    JOINTS,
    FloatArray,
    axes_from_joints,
    joints_from_axes,
)
from painter.errors import BusError

_LOGGER = logging.getLogger(__name__)
_REOPEN_EVERY = 0.25
# A setpoint may be this far outside a joint's range: rounding of a planned path.
_TOLERANCE = 1e-6
# Share by which a step between two cycles may exceed the joint's greatest speed.
_SPEED_MARGIN = 1.05


class ArmBus:
    """Brings nodes up, streams setpoints, watches, stops."""

    def __init__(self, bus: BusConfig, link: Link) -> None:
        """Creates the master; nothing is sent yet.

        Args:
            bus: What is on the bus.
            link: The way to it.

        Raises:
            InputError: A drive's EDS does not allow its configuration.
        """
        self._bus = bus
        self._link = link
        limits = bus.drive_limits()
        self.drives = [
            DriveClient(axis, bus, limit, self._send)
            for axis, limit in zip(AXES, limits, strict=True)
        ]
        self.io = IoClient(bus, self._send)
        self.nodes: list[NodeClient] = [*self.drives, self.io]
        self._by_id = {node.node_id: node for node in self.nodes}
        self._joints = bus.joint_limits()
        self._v_max = np.array([joint.v_max for joint in self._joints])
        self._q_min = np.array([joint.q_min for joint in self._joints])
        self._q_max = np.array([joint.q_max for joint in self._joints])
        self.phase = Phase.DOWN
        self.reason = ""
        self._buffer = SetpointBuffer()
        self._ramp: StopRamp | None = None
        self._q, self._v = np.zeros(5), np.zeros(5)
        self._script: Script | None = None
        self._is_cyclic = False  # SYNC runs and process data is watched.
        self._is_lost = False
        self._reopen_at = 0.0
        self._next_heartbeat = 0.0
        self._last_cycle: float | None = None
        self._now = 0.0
        self._counts = dict.fromkeys(("cycles", "overruns", "missing", "foreign"), 0)
        self._traffic: deque[tuple[float, float]] = deque()
        self._traffic_time = 0.0

    # Commands.

    def start(self) -> None:
        """Begins bring-up: configure, verify, operational, enable, home."""
        self._begin(self._start_up(self.nodes))

    def acknowledge(self) -> None:
        """Begins again after a stop; nodes that rebooted are configured anew.

        Raises:
            BusError: Nothing is latched, or the cause is still there; names it.
        """
        if self.phase != Phase.STOPPED:
            raise BusError(f"nothing to acknowledge: the bus is {self.phase}.")
        if self._is_lost:
            raise BusError(f"cannot acknowledge, the bus is still lost: {self.reason}")
        if self.io.inputs is not None and not self.io.is_chain_closed:
            raise BusError("cannot acknowledge: the e-stop chain is open.")
        self.reason = ""
        self._begin(self._start_up([n for n in self.nodes if not self._is_sound(n)]))

    def push(self, points: Sequence[Setpoint]) -> None:
        """Adds setpoints; while no motion is allowed they are dropped.

        Raises:
            ValueError: They are not in order of time, or not finite.
        """
        if self.phase != Phase.ENABLED:
            return
        self._buffer.push(points)

    def stop(self, reason: str, *, quick: bool = False) -> None:
        """Stops all axes, closes the gun and latches the reason.

        Args:
            reason: Said in the feedback until it is acknowledged.
            quick: By the drives' quick stop, else by a ramp that stays enabled.
        """
        was, self.io.trigger = self.phase, 0.0
        if not self.reason:
            self.reason = reason
            _LOGGER.warning("stopped: %s", reason)
        self.phase = Phase.STOPPED
        self._buffer.clear()
        if self._script is not None:
            self._script.close()
            self._script = None
        if quick or was not in (Phase.ENABLED, Phase.STOPPED):
            self._ramp = None
            for drive in self.drives:
                drive.controlword = Command.QUICK_STOP
                drive.target = drive.position
        elif was == Phase.ENABLED:
            self._ramp = StopRamp(self._now, self._q, self._v, self._joints)
        self._send_outputs()

    def shut_down(self) -> None:
        """Begins to switch off: ramp, brakes, power."""
        if self.phase in (Phase.ENABLED, Phase.STARTING):
            self.stop("switched off.")
        self._begin(self._switch_off())

    # Time.

    def cycle(self, now: float, *, overruns: int = 0) -> None:
        """One cycle: SYNC, targets, gun; what came is read first.

        Args:
            now: When it was due, s.
            overruns: Cycles that were skipped before it.
        """
        self.poll(now)
        self._counts["overruns"] += overruns
        if self._is_cyclic and not self._is_lost:
            self._count_missing()
            self._counts["cycles"] += 1
            self._send(Frame(SYNC_ID))
            self._follow(now)
            self._send_outputs()
        self._last_cycle = now

    def poll(self, now: float, timeout: float = 0.0) -> None:
        """Reads frames, watches, and goes on with what runs.

        Args:
            now: Time, s.
            timeout: How long to wait for a frame, s.
        """
        self._now = now
        frames: list[Frame] = []
        if self._is_lost:
            self._reopen(now)
        else:
            try:
                frames = self._link.receive(timeout)
            except LinkError as error:
                self._lose(f"bus lost: {error}")
        for frame in frames:
            self._take(frame, now)
        if self._is_lost:
            return
        if self.phase != Phase.DOWN and now >= self._next_heartbeat:
            self._next_heartbeat = now + self._bus.timeouts.heartbeat / 3.0
            state = bytes([OPERATIONAL])
            self._send(Frame(HEARTBEAT_BASE + self._bus.master_id, state))
        for node in self.nodes:
            node.poll(now)
        self._watch(now)
        self._advance_script()

    def feedback(self) -> Feedback:
        """Returns the state of the arm."""
        axes = np.array([d.units.angle(d.position) for d in self.drives])
        speeds = np.array([d.units.speed(d.velocity) for d in self.drives])
        return Feedback(
            time=self._now,
            phase=self.phase,
            reason=self.reason,
            q=joints_from_axes(axes),
            v=joints_from_axes(speeds),
            q_commanded=self._q.copy(),
            trigger=self.io.trigger,
            axes=tuple(_axis_status(drive) for drive in self.drives),
            is_chain_closed=self.io.is_chain_closed,
            pressure=self.io.pressure,
            buffered=len(self._buffer),
            statistics=Statistics(
                **self._counts,
                retries=sum(node.sdo.retry_count for node in self.nodes),
                load=self._load(),
            ),
        )

    # Scripts.

    def _begin(self, script: Script) -> None:
        if self._script is not None:
            self._script.close()
        self._buffer.clear()
        self._ramp = None
        self.phase = Phase.STARTING
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
            scripts = []
            for node in nodes:
                config = node.config if isinstance(node, DriveClient) else None
                restore, store = (
                    (config.restore, config.store) if config else (False, False)
                )
                scripts.append(node.bring_up(restore=restore, store=store))
            yield from _together(scripts)
        for node in self.nodes:
            node.got_tpdo, node.missed, node.alarm = False, 0, None
            node.start()
        self._is_cyclic = True
        timeout = self._bus.timeouts.boot
        yield from _together(
            node.wait(
                lambda node=node: node.got_tpdo and node.nmt == OPERATIONAL,  # type: ignore[misc]
                timeout,
                "not operational",
            )
            for node in self.nodes
        )
        if not self.io.is_chain_closed:
            raise BusError("e-stop: the chain is open.")
        yield from _together([drive.enable() for drive in self.drives])
        for drive in self.drives:
            yield from drive.home()
        self._q = self._actual()
        self._v = np.zeros(5)
        self.phase = Phase.ENABLED

    def _switch_off(self) -> Script:
        self.io.trigger = 0.0
        if self._is_cyclic:
            yield from _together([drive.disable() for drive in self.drives])
        self._is_cyclic = False
        self.phase = Phase.DOWN

    # The cycle's parts.

    def _follow(self, now: float) -> None:
        """Takes the command of this cycle to the drives."""
        if self._ramp is not None:
            self._command(self._ramp.sample(now))
            return
        if self.phase != Phase.ENABLED:
            return
        sample = self._buffer.sample(now)
        if sample is None:
            self._command(Sample(self._q, np.zeros(5), 0.0, 0.0))
            return
        if sample.lag > 0.0 and sample.is_active:
            # Late, but not yet too late: go on as the last setpoint said.
            moved = sample.q + sample.v * sample.lag
            sample = Sample(moved, sample.v, sample.trigger, sample.lag)
        problem = self._objection(sample, now)
        if problem:
            self.stop(problem)
            assert self._ramp is not None
            sample = self._ramp.sample(now)
        self._command(sample)

    def _objection(self, sample: Sample, now: float) -> str | None:
        """Returns why a sample must not be followed, or None."""
        limit = self._bus.timeouts.setpoint
        if sample.lag > limit and sample.is_active:
            return (
                f"setpoints: none for {sample.lag:.3f} s while moving or spraying "
                f"(limit {limit:g} s)."
            )
        outside = np.maximum(self._q_min - sample.q, sample.q - self._q_max)
        worst = int(np.argmax(outside))
        if outside[worst] > _TOLERANCE:
            joint = self._joints[worst]
            return (
                f"setpoints: {JOINTS[worst]} {sample.q[worst]:.4f} rad is not in "
                f"{joint.q_min:g} to {joint.q_max:g} rad."
            )
        cycle = self._bus.cycle
        elapsed = cycle if self._last_cycle is None else now - self._last_cycle
        speed = np.abs(sample.q - self._q) / max(elapsed, cycle)
        worst = int(np.argmax(speed / self._v_max))
        if speed[worst] > _SPEED_MARGIN * self._v_max[worst]:
            return (
                f"setpoints: {JOINTS[worst]} would go {speed[worst]:.3f} rad/s, "
                f"allowed are {self._v_max[worst]:g} rad/s."
            )
        return None

    def _command(self, sample: Sample) -> None:
        self._q = np.clip(sample.q, self._q_min, self._q_max)
        self._v = sample.v
        self.io.trigger = sample.trigger
        axes = axes_from_joints(self._q)
        for drive, angle in zip(self.drives, axes, strict=True):
            drive.target = drive.units.counts(float(angle))

    def _actual(self) -> FloatArray:
        axes = np.array([d.units.angle(d.position) for d in self.drives])
        return joints_from_axes(axes)

    def _send_outputs(self) -> None:
        if not self._is_cyclic:
            return
        if self.io.is_configured:
            self._send(self.io.rpdo())  # First, so that the gun is never last.
        for drive in self.drives:
            self._send(drive.rpdo())

    def _count_missing(self) -> None:
        for drive in self.drives:
            if drive.got_tpdo:
                drive.missed = 0
            elif self._counts["cycles"] > 0:
                drive.missed += 1
                self._counts["missing"] += 1
            # Scripts that wait for a new one clear the flag themselves.
            if self.phase != Phase.STARTING:
                drive.got_tpdo = False

    # The watches.

    def _watch(self, now: float) -> None:
        for node in self.nodes:
            if node.alarm is not None and self._is_cyclic:
                alarm, node.alarm = node.alarm, None
                if self.phase != Phase.STARTING or not node.is_configured:
                    self.stop(alarm, quick=True)
        if self.phase not in (Phase.ENABLED, Phase.STOPPED) or not self._is_cyclic:
            return
        complaint = self._first_complaint(now)
        if complaint is not None and (self.phase == Phase.ENABLED or self._ramp):
            self.stop(complaint, quick=True)

    def _first_complaint(self, now: float) -> str | None:
        timeouts = self._bus.timeouts
        held = self.phase == Phase.ENABLED or self._ramp is not None
        for node in self.nodes:
            if now - node.heard > timeouts.heartbeat:
                return f"{node.name}: no heartbeat for {timeouts.heartbeat:g} s."
            if node.nmt != OPERATIONAL:
                return f"{node.name}: left NMT state operational (is {node.nmt})."
        for drive in self.drives:
            if drive.missed * self._bus.cycle >= timeouts.tpdo:
                return f"{drive.name}: no TPDO for {drive.missed} cycles."
            complaint = drive.complaint(must_be_enabled=held)
            if complaint:
                return complaint
        return self.io.complaint()

    def _is_sound(self, node: NodeClient) -> bool:
        """Whether a node can go on without being configured anew."""
        recent = self._now - node.heard <= self._bus.timeouts.heartbeat
        few = node.missed * self._bus.cycle < self._bus.timeouts.tpdo
        return node.is_configured and recent and few and node.nmt == OPERATIONAL

    # The link.

    def _take(self, frame: Frame, now: float) -> None:
        self._note_traffic(frame)
        if frame.is_error:
            if frame.cob_id & ERROR_BUS_OFF:
                self._lose("bus-off: the CAN controller gave up.")
            return
        node = self._by_id.get(frame.cob_id & 0x7F)
        if node is None or frame.cob_id < SYNC_ID:
            self._counts["foreign"] += 1
        else:
            node.take(frame, now)

    def _send(self, frame: Frame) -> None:
        if self._is_lost:
            return
        self._note_traffic(frame)
        try:
            self._link.send(frame)
        except LinkError as error:
            self._lose(f"bus lost: {error}")

    def _lose(self, reason: str) -> None:
        self._is_lost = True
        self._reopen_at = self._now + _REOPEN_EVERY
        self.stop(reason, quick=True)

    def _reopen(self, now: float) -> None:
        if now < self._reopen_at:
            return
        self._reopen_at = now + _REOPEN_EVERY
        try:
            self._link.reopen()
        except LinkError as error:
            _LOGGER.debug("still lost: %s", error)
            return
        _LOGGER.warning("the bus is back; the stop stays until it is acknowledged.")
        self._is_lost = False
        for node in self.nodes:
            node.heard = now
            node.missed = 0

    def _note_traffic(self, frame: Frame) -> None:
        took = frame_time(len(frame.data), self._bus.bitrate)
        self._traffic.append((self._now, took))
        self._traffic_time += took
        while self._traffic and self._now - self._traffic[0][0] > 1.0:
            self._traffic_time -= self._traffic.popleft()[1]

    def _load(self) -> float:
        if not self._traffic:
            return 0.0
        return self._traffic_time / max(self._now - self._traffic[0][0], 0.1)


def _together(scripts: Iterable[Script]) -> Script:
    """Runs scripts side by side until all have ended; the first error ends all."""
    running = list(scripts)
    while running:
        for script in list(running):
            try:
                next(script)
            except StopIteration:
                running.remove(script)
        if running:
            yield


def _axis_status(drive: DriveClient) -> AxisStatus:
    return AxisStatus(
        name=drive.name,
        state="UNKNOWN" if drive.state is None else drive.state.value,
        code=drive.emcy,
        following_error=drive.following_error / drive.units.counts_per_rad,
        statusword=drive.statusword,
    )
