"""The master's view of one drive: states up and down, homing, targets."""

from collections.abc import Callable

from painter.canopen.config.bus_config import BusConfig
from painter.canopen.config.bus_file import choose_mode
from painter.canopen.config.device import Mode
from painter.canopen.config.units import DriveLimits
from painter.canopen.master.feedback import AxisStatus
from painter.canopen.master.node_client import NodeClient, Script
from painter.canopen.master.od_config import plan_drive
from painter.canopen.protocol.cia402 import (
    CONTROL_MODE_4,
    Command,
    State,
    Status,
    next_command,
    state_of,
)
from painter.canopen.protocol.frames import RPDO_BASES, TPDO_BASES, Frame
from painter.canopen.protocol.od_types import pack
from painter.errors import BusError

_LOST_AFTER = 0.2  # A TPDO that is due for so long was lost, s.
_STEP_SETTLE = 0.05  # Time in which a homing drive clears its old status bits, s.


class DriveClient(NodeClient):
    """One drive as the master sees it.

    Attributes:
        mode: Mode of operation in which targets are streamed.
        units: Of the drive.
        state: State in the last statusword; None before the first.
        statusword: Last one received.
        position: Last actual position, counts.
        velocity: Last actual velocity, drive units.
        following_error: Last one received, counts.
        target: Commanded position, counts.
        controlword: Commanded.
        is_homed: Whether it has been homed since its last boot-up.
        is_homing: Whether homing runs.
    """

    def __init__(
        self,
        axis: str,
        bus: BusConfig,
        limits: DriveLimits,
        send: Callable[[Frame], None],
    ) -> None:
        """Creates the client.

        Args:
            axis: One of `units.AXES`.
            bus: The bus file.
            limits: The drive's limits.
            send: Sends a frame.

        Raises:
            InputError: Its EDS does not allow the configuration.
        """
        config = bus.drives[axis]
        device = bus.device(axis)
        super().__init__(
            axis,
            config.node_id,
            send,
            identity=config.identity,
            timeouts=bus.timeouts,
            plan=plan_drive(bus, config, device, limits),
            profile=402,
            restore=config.restore,
            store=config.store,
        )
        mode = choose_mode(device)
        assert mode is not None  # plan_drive() refuses these.
        self.mode = mode
        self.config = config
        self.units = config.units()
        self._cycle = bus.cycle
        self.state: State | None = None
        self.statusword = 0
        self.position = 0
        self.velocity = 0
        self.following_error = 0
        self.target = 0
        self.controlword = 0
        # Answers to SYNCs not yet received, and for how many SYNCs there were any.
        self._owed = self._owing = 0
        self.is_homed = False
        self.is_homing = False

    def is_healthy(self, now: float) -> bool:
        """See `NodeClient.is_healthy`; its TPDOs must arrive as well."""
        is_fresh = self.missed * self._cycle < self._timeouts.tpdo
        return is_fresh and super().is_healthy(now)

    @property
    def is_measured(self) -> bool:
        """Whether position and speed are those of the last SYNC, not an earlier one."""
        return self.got_tpdo and self._owed == 0

    def expect_answer(self) -> bool:
        """Expects a TPDO1 for a SYNC; returns whether the last SYNC was answered.

        Answers are counted: a late one that arrives after the next SYNC must not pass
        for the answer to that SYNC, which would report the arm 5 ms late. An answer
        that stays out for `_LOST_AFTER` counts as lost.
        """
        self.missed = 0 if self.got_tpdo else self.missed + 1
        self._owing = self._owing + 1 if self._owed else 0
        is_lost = self._owing * self._cycle > _LOST_AFTER
        self._owed = 1 if is_lost else self._owed + 1
        return self.got_tpdo

    def forget_owed(self) -> None:
        """Forgets missing answers, before SYNCs start."""
        self._owed = self._owing = 0

    def take_process_data(self, kind: int, data: bytes) -> bool:
        """Takes TPDO1 (6041h, 6064h) and TPDO2 (606Ch, 60F4h)."""
        if kind == TPDO_BASES[0] and len(data) == 6:
            self.statusword = int.from_bytes(data[:2], "little")
            self.state = state_of(self.statusword)
            self.position = int.from_bytes(data[2:6], "little", signed=True)
            self.got_tpdo = True
            self._owed = max(0, self._owed - 1)
        elif kind == TPDO_BASES[1] and len(data) == 8:
            self.velocity = int.from_bytes(data[:4], "little", signed=True)
            self.following_error = int.from_bytes(data[4:], "little", signed=True)
        else:
            return False
        return True

    def rpdo(self) -> Frame:
        """Returns the frame with controlword and target."""
        word = self.controlword
        if self.mode == Mode.INTERPOLATED_POSITION and not self.is_homing:
            word |= CONTROL_MODE_4 if self.state == State.ENABLED else 0
        data = word.to_bytes(2, "little")
        data += self.target.to_bytes(4, "little", signed=True)
        return Frame(RPDO_BASES[0] + self.node_id, data)

    def status(self) -> AxisStatus:
        """Returns the drive's state for the feedback."""
        return AxisStatus(
            name=self.name,
            state="UNKNOWN" if self.state is None else self.state.value,
            code=self.emcy,
            following_error=self.following_error / self.units.counts_per_rad,
            statusword=self.statusword,
        )

    def stop_reason(self) -> str | None:
        """Returns why the statusword must stop an enabled arm, or None."""
        if self.state in (State.FAULT, State.FAULT_REACTION):
            return f"{self.name}: drive fault, {self.fault_text()}."
        if self.state != State.ENABLED:
            shown = "no known state" if self.state is None else self.state.value
            return f"{self.name}: left OPERATION ENABLED, is in {shown}."
        if self.statusword & Status.MODE_13 and not self.is_homing:
            return f"{self.name}: following error (statusword bit 13)."
        if self.statusword & Status.INTERNAL_LIMIT and not self.is_homing:
            return f"{self.name}: internal limit active (statusword bit 11)."
        return None

    def check_device(self) -> Script:
        """Compares encoder and modes with the bus file, where the drive has them.

        Raises:
            BusError: They differ.
        """
        self.state, self.controlword = None, 0
        self.is_homed = self.config.homing.kind == "none"
        if self.plan.device.find(0x608F, 1):
            counts = yield from self.read(0x608F, 1)
            turns = yield from self.read(0x608F, 2)
            found = counts / max(turns, 1)
            if abs(found - self.config.counts_per_turn) > 0.5:
                raise BusError(
                    f"{self.name}: wrong unit: the encoder has {found:g} counts a turn "
                    f"(608Fh), {self.config.counts_per_turn:g} in the bus file.",
                    code="PNT-BUS-005",
                )
        if self.plan.device.find(0x6502):
            supported = yield from self.read(0x6502)
            if not supported >> (self.mode - 1) & 1:
                raise BusError(
                    f"{self.name}: mode {self.mode.name} is not supported: 6502h is "
                    f"{supported:X}h.",
                    code="PNT-BUS-006",
                )

    def enable(self) -> Script:
        """Steps up to OPERATION ENABLED; until then the target is the actual position.

        Raises:
            BusError: A step took too long; names the state the drive is in.
        """
        while True:
            self.target = self.position
            state = self.state
            if state is None or state in (State.NOT_READY, State.FAULT_REACTION):
                yield from self._leave(state)
                continue
            command = next_command(state)
            if command is None:
                self.controlword = Command.ENABLE_OPERATION
                return
            if command == Command.FAULT_RESET:
                self.controlword = 0  # So that bit 7 rises.
                for _ in range(2):
                    yield from self._next_statusword()
                if self.state != State.FAULT:
                    continue
                self.emcy = 0
            self.controlword = command
            yield from self._leave(state)

    def disable(self) -> Script:
        """Steps down to SWITCH ON DISABLED, by a ramp and with the brake closed."""
        for command, there in (
            (Command.SHUTDOWN, (State.READY, State.SWITCH_ON_DISABLED, State.FAULT)),
            (Command.DISABLE_VOLTAGE, (State.SWITCH_ON_DISABLED, State.FAULT)),
        ):
            if self.state == State.QUICK_STOP:
                self.controlword = Command.DISABLE_VOLTAGE
            else:
                self.controlword = command
            yield from self.wait(
                lambda there=there: self.state in there,  # type: ignore[misc]
                self._timeouts.brake,
                f"not off (is in {self.state})",
            )

    def home(self) -> Script:
        """Runs the drive's homing mode, then streams targets again.

        Raises:
            BusError: The drive reports an error or takes too long.
        """
        if self.config.homing.kind == "none" or self.is_homed:
            return
        homing = self.config.homing
        scale = self.units.speed_scale()
        ramp = homing.acceleration * self.units.acceleration_scale()
        offset = round(homing.offset * self.units.counts_per_rad) * self.units.sign
        values = (
            (0x6098, 0, homing.method),
            (0x6099, 1, max(1, round(homing.speed_switch * scale))),
            (0x6099, 2, max(1, round(homing.speed_zero * scale))),
            (0x609A, 0, max(1, round(ramp))),
            (0x607C, 0, offset),
        )
        for index, sub, value in values:
            info = self.plan.device.find(index, sub)
            if info is None and not (index == 0x607C and value == 0):
                raise BusError(
                    f"{self.name}: no {index:04X}h:{sub} for homing.",
                    code="PNT-BUS-007",
                )
            if info is not None:
                yield from self.sdo.transfer(index, sub, pack(info.data_type, value))
        self.is_homing = True
        try:
            yield from self._change_mode(Mode.HOMING)
            self.controlword = Command.ENABLE_OPERATION | CONTROL_MODE_4
            start = self.now
            while self.now - start < _STEP_SETTLE:
                yield
            yield from self.wait(
                self._has_homed, homing.timeout, f"homing {homing.method} not done"
            )
            self.controlword = Command.ENABLE_OPERATION
            for _ in range(2):
                yield from self._next_statusword()
            self.target = self.position
            for _ in range(2):
                yield from self._next_statusword()
            yield from self._change_mode(self.mode)
        finally:
            self.is_homing = False
            self.controlword &= ~CONTROL_MODE_4
        self.is_homed = True

    def _has_homed(self) -> bool:
        if self.statusword & Status.MODE_13:
            raise BusError(
                f"{self.name}: homing error (statusword bit 13).", code="PNT-BUS-008"
            )
        done = Status.MODE_12 | Status.TARGET_REACHED
        return self.statusword & done == done

    def _change_mode(self, mode: Mode) -> Script:
        yield from self.sdo.transfer(0x6060, 0, bytes([mode]))
        start = self.now
        while (yield from self.read(0x6061)) != mode:
            if self.now - start > self._timeouts.transition:
                raise BusError(
                    f"{self.name}: does not change to mode {mode.name}.",
                    code="PNT-BUS-009",
                )

    def _leave(self, state: State | None) -> Script:
        """Waits until the drive leaves a state; longer where the brake moves."""
        limits = self._timeouts
        slow = state in (State.SWITCHED_ON, State.QUICK_STOP, State.FAULT_REACTION)
        shown = "no statusword" if state is None else f"stays in {state.value}"
        if state == State.SWITCHED_ON:
            shown += " (brake?)"
        start = self.now
        timeout = limits.brake if slow else limits.transition
        while self.state == state:
            self.target = self.position
            if self.now - start > timeout:
                raise BusError(
                    f"{self.name}: {shown} for {timeout:g} s; statusword "
                    f"{self.statusword:04X}h, {self.fault_text()}.",
                    code="PNT-BUS-010",
                )
            yield

    def _next_statusword(self) -> Script:
        self.got_tpdo = False
        yield from self.wait(
            lambda: self.got_tpdo, self._timeouts.transition, "no statusword"
        )
