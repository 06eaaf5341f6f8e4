"""A simulated CiA 402 drive: state machine, brake, modes, limits, following error.

Source: CiA 402-2 v4.0.0; clauses and objects are named at their code.
"""

from painter.canopen.config.device import DeviceDescription, Mode, modes_of
from painter.canopen.config.units import AxisUnits, VelocityUnit
from painter.canopen.protocol.cia402 import (
    CONTROL_HALT,
    CONTROL_MODE_4,
    HOLDING_QUICK_STOP,
    STATUS_CODES,
    TRANSITIONS,
    AbortOption,
    Command,
    State,
    Status,
    command_of,
)
from painter.canopen.protocol.od_types import Value
from painter.canopen.sim.motion import Demand, HomingRun, SyncedTarget
from painter.canopen.sim.motor import Motor
from painter.canopen.sim.node import HEARTBEAT_LOST, SimNode
from painter.canopen.sim.store import SdoAbortError
from painter.canopen.sim.wire import Wire

FOLLOWING_ERROR = 0x8611
_POWERED = (State.ENABLED, State.QUICK_STOP, State.FAULT_REACTION)
_NO_MODE = 0x06090030
# Bits of the error register 1001h: generic, communication, profile specific.
_GENERIC, _COMMUNICATION, _PROFILE = 0x01, 0x10, 0x20


class SimDrive(SimNode):
    """One drive with its motor.

    Attributes:
        motor: What the position loop moves.
        state: State of the power state machine.
        demand: Output of the trajectory generator.
        brake_time: Time the brake takes to open, s.
        brake_stuck: Whether the brake does not open; fault injection.
        brake_closed: Whether the brake is closed.
        home_switch: Motor position of the home switch, counts.
    """

    def __init__(
        self,
        node_id: int,
        description: DeviceDescription,
        wire: Wire,
        *,
        units: AxisUnits,
        brake_time: float = 0.1,
    ) -> None:
        """Creates the drive, switched off at position 0.

        Args:
            node_id: 1 to 127.
            description: Its objects; functions whose objects are missing do nothing.
            wire: Of the bus.
            units: Its encoder, and the units of its velocities and accelerations.
            brake_time: Time the brake takes to open, s.
        """
        super().__init__(node_id, description, wire)
        self.motor = Motor()
        self.state = State.NOT_READY
        self.brake_time = brake_time
        self.brake_stuck = False
        self._units = units
        self.home_switch = 0.0
        self._moved = 0.0
        self._offset = 0.0  # Drive position of motor position 0.
        self.store.fix(0x608F, 1, round(units.counts_per_turn))
        if units.velocity == VelocityUnit.RPM:
            self.store.fix(0x60A9, 0, 0x00B44700)
        if not self.store.number(0x1000):
            self.store.fix(0x1000, 0, 0x00020192)  # Servo drive; missing in some EDS.
        self.store.hooks[0x6060] = self._check_mode
        self.on_reset()

    @property
    def position(self) -> float:
        """Actual position as the drive counts it."""
        return self.motor.position + self._offset

    def on_reset(self) -> None:
        """Power is off, the brake closed; transition 0."""
        self.state = State.NOT_READY
        self.demand = Demand(self.position)
        self._target = SyncedTarget()
        self._controlword = 0
        self._next: tuple[State, float] | None = None
        self._leaving: State | None = None
        self._error_since: float | None = None
        self._has_error = self._limited = self._reached = self._lost = False
        self._homing: HomingRun | None = None
        self._homed = False
        self.brake_closed = True

    def on_boot(self) -> None:
        """The drive is initialised, transition 1."""
        if self.state == State.NOT_READY:
            self.state = State.SWITCH_ON_DISABLED

    def trip(self, code: int) -> None:
        """Enters FAULT REACTION ACTIVE, transition 13, and sends the EMCY."""
        if self.state in (State.FAULT_REACTION, State.FAULT):
            return
        self.store.set(0x603F, 0, code)
        self.state = State.FAULT_REACTION
        self._next = self._leaving = None
        is_bus = code >> 8 == HEARTBEAT_LOST >> 8
        self.emergency(code, _GENERIC | (_COMMUNICATION if is_bus else _PROFILE))

    def on_connection_lost(self) -> None:
        """Acts on 6007h, abort connection option; faults if the drive lacks it."""
        if self.state not in _POWERED:
            return
        option = self.store.number(0x6007, otherwise=AbortOption.FAULT)
        if option == AbortOption.FAULT:
            self.trip(HEARTBEAT_LOST)
        elif option == AbortOption.DISABLE_VOLTAGE:
            self._command(Command.DISABLE_VOLTAGE)
        elif option == AbortOption.QUICK_STOP:
            self._command(Command.QUICK_STOP)

    def on_write(self, index: int, sub: int, value: Value) -> None:
        """Acts on controlword and mode of operation."""
        if index == 0x6040 and isinstance(value, int):
            previous, self._controlword = self._controlword, value
            command = command_of(value, previous)
            if command is not None:
                self._command(command)
            if value & CONTROL_MODE_4 and not previous & CONTROL_MODE_4:
                self._start_mode()
        elif index == 0x6060 and isinstance(value, int):
            self.store.set(0x6061, 0, value)
            self._hold_here()

    def on_sync(self, now: float) -> None:
        """Takes the target in CSP and IP mode."""
        mode = self.store.number(0x6060)
        if self.state != State.ENABLED or self._leaving or self._is_halted:
            return
        if mode == Mode.CYCLIC_SYNC_POSITION:
            wanted = self.store.number(0x607A)
        elif mode == Mode.INTERPOLATED_POSITION:
            if not self._controlword & CONTROL_MODE_4:
                return
            wanted = self.store.number(0x60C1, 1)
        else:
            return
        target = self._clamp(wanted)
        cut = self._target.take(
            self.demand, target, now=now, period=self.period, speed=self._speed_limit
        )
        self._limited = cut or target != wanted

    def refresh(self) -> None:
        """Updates statusword and actual values."""
        store = self.store
        store.set(0x6041, 0, self.statusword())
        store.set(0x6064, 0, _int32(self.position))
        store.set(0x6062, 0, _int32(self.demand.position))
        store.set(0x60F4, 0, _int32(self.demand.position - self.position))
        store.set(0x606C, 0, _int32(self.motor.velocity / self._velocity_scale))

    def statusword(self) -> int:
        """Object 6041h."""
        word = STATUS_CODES[self.state][1] | int(Status.REMOTE)
        if self.state not in (State.NOT_READY, State.SWITCH_ON_DISABLED):
            word |= Status.VOLTAGE_ENABLED
        if self._limited:
            word |= Status.INTERNAL_LIMIT
        if self._has_error:
            word |= Status.MODE_13
        mode = self.store.number(0x6060)
        following = self.state == State.ENABLED and not self._is_halted
        if mode == Mode.HOMING:
            if self._homed:
                word |= Status.MODE_12 | Status.TARGET_REACHED
        elif mode == Mode.PROFILE_POSITION:
            word |= Status.TARGET_REACHED if self._reached else 0
            word |= Status.MODE_12 if self._controlword & CONTROL_MODE_4 else 0
        elif following and mode == Mode.CYCLIC_SYNC_POSITION:
            word |= Status.MODE_12
        elif following and mode == Mode.INTERPOLATED_POSITION:
            word |= Status.MODE_12 if self._controlword & CONTROL_MODE_4 else 0
        return int(word)

    def step(self, now: float) -> None:
        """Advances motor, brake and state machine to `now`."""
        dt, self._moved = now - self._moved, now
        super().step(now)
        if dt <= 0.0:
            return
        if self._next is not None and now >= self._next[1]:
            self.state, self._next = self._next[0], None
            if self.state == State.ENABLED:
                self._hold_here()
        # While the brake opens the motor holds, or the arm would sag.
        opening = self._next is not None
        if self.state in _POWERED or opening:
            if not opening:
                self._move(dt)
            self.motor.drive(
                self.demand.position - self._offset, self.demand.velocity, dt
            )
            if not opening:
                self._monitor_following(now)
        else:
            self.motor.coast(dt, brake=self.brake_closed)
            self.demand.hold(self.position)

    @property
    def _is_halted(self) -> bool:
        return bool(self._controlword & CONTROL_HALT)

    @property
    def period(self) -> float:
        """Object 60C2h, interpolation time period, s."""
        exponent = self.store.number(0x60C2, 2, -3)
        return float(self.store.number(0x60C2, 1, 1) * 10.0**exponent)

    @property
    def _velocity_scale(self) -> float:
        """Counts/s per drive unit of velocity."""
        return self._units.counts_per_rad / self._units.speed_scale()

    @property
    def _speed_limit(self) -> float:
        """Lower one of 607Fh and 6080h, counts/s; very high without them."""
        limits = [1e12]
        if self.store.number(0x607F):
            limits.append(self.store.number(0x607F) * self._velocity_scale)
        if self.store.number(0x6080):
            turns = self.store.number(0x6080) / 60.0
            limits.append(turns * self._units.counts_per_turn)
        return min(limits)

    def _ramp(self, index: int) -> float:
        """Acceleration in an object, counts/s²; 1e7 if it is 0 or missing."""
        value = self.store.number(index)
        scale = self._units.counts_per_rad / self._units.acceleration_scale()
        return value * scale if value else 1e7

    def _clamp(self, target: int) -> int:
        """Clips to 607Dh; without effect unless its lower bound is below its upper."""
        low, high = self.store.number(0x607D, 1), self.store.number(0x607D, 2)
        return target if low >= high else min(high, max(low, target))

    def _hold_here(self) -> None:
        self.demand.hold(self.position)
        self._target.reset(self.position, self.now)
        self._limited = self._has_error = False
        self._error_since = None
        self._homing = None
        self._reached = False

    def _check_mode(self, sub: int, value: Value) -> None:
        known = self.store.description.modes()
        supported = modes_of(self.store.number(0x6502, otherwise=0xE1))
        if value != 0 and value not in (known or supported):
            raise SdoAbortError(_NO_MODE)

    def _command(self, command: Command) -> None:
        """Makes the transitions on command: 2 to 12, 15 and 16."""
        if self._next is not None and command in (
            Command.DISABLE_VOLTAGE,
            Command.QUICK_STOP,
            Command.SHUTDOWN,
        ):
            self._next = None  # The brake was opening: it closes again.
            self.brake_closed = True
        key = (self.state, command)
        if key not in TRANSITIONS or self._next is not None:
            return
        number, state = TRANSITIONS[key]
        if number == 4:
            if not self.brake_stuck:
                self.brake_closed = False
                self._hold_here()
                self._next = (state, self.now + self.brake_time)
        elif number in (5, 8):
            option = self.store.number(0x605C if number == 5 else 0x605B)
            if option:
                self._leaving = state
            else:
                self._switch_off(state)
        elif number in (9, 12):
            self._switch_off(state)
        elif number == 11:
            self._leaving = None
            if self.store.number(0x605A, otherwise=2) == 0:
                self._switch_off(State.SWITCH_ON_DISABLED)
            else:
                self.state = state
        elif number == 15:
            self.store.set(0x603F, 0, 0)
            self.emergency(0, 0)
            self._has_error = False
            self.state = state
        elif number == 16:
            if self.store.number(0x605A, otherwise=2) in HOLDING_QUICK_STOP:
                self.state = state
                self._hold_here()
        else:
            self.state = state

    def _switch_off(self, state: State) -> None:
        """Removes power; the brake closes at once, even while the axis moves."""
        self.state, self._leaving, self._next = state, None, None
        self.brake_closed = True

    def _start_mode(self) -> None:
        if self.state != State.ENABLED:
            return
        mode = self.store.number(0x6060)
        self._reached = False
        if mode == Mode.HOMING:
            self._homed = False
            method = self.store.number(0x6098)
            self._homing = HomingRun(method, self.home_switch + self._offset)

    def _move(self, dt: float) -> None:
        if self.state == State.FAULT_REACTION:
            self._stop_for(0x605E, State.FAULT, dt)
        elif self.state == State.QUICK_STOP:
            option = self.store.number(0x605A, otherwise=2)
            after = None if option in HOLDING_QUICK_STOP else State.SWITCH_ON_DISABLED
            self._stop_for(0x605A, after, dt)
        elif self._leaving is not None:
            if self.demand.brake(self._ramp(0x6084), dt):
                self._switch_off(self._leaving)
        elif self._is_halted:
            option = self.store.number(0x605D, otherwise=1)
            self.demand.brake(self._ramp(0x6084 if option == 1 else 0x6085), dt)
            self._target.reset(self.demand.position, self.now)
        else:
            self._follow_mode(dt)

    def _stop_for(self, index: int, after: State | None, dt: float) -> None:
        """Brakes by an option code: 1 and 5 on 6084h, others on the quick stop ramp."""
        option = self.store.number(index, otherwise=2)
        ramp = self._ramp(0x6084 if option in (1, 5) else 0x6085)
        if option == 0 or self.demand.brake(ramp, dt):
            self._target.reset(self.demand.position, self.now)
            if after is not None:
                self._switch_off(after)

    def _follow_mode(self, dt: float) -> None:
        mode = self.store.number(0x6060)
        if mode in (Mode.CYCLIC_SYNC_POSITION, Mode.INTERPOLATED_POSITION):
            self._target.follow(self.demand, self.now)
        elif mode == Mode.PROFILE_POSITION and self._controlword & CONTROL_MODE_4:
            target = self._clamp(self.store.number(0x607A))
            speed = min(
                self.store.number(0x6081) * self._velocity_scale, self._speed_limit
            )
            ramp = self._ramp(0x6083)
            self._reached = self.demand.approach(target, speed, ramp, dt)
        elif mode == Mode.HOMING and self._homing is not None:
            self._home(self._homing, dt)

    def _home(self, run: HomingRun, dt: float) -> None:
        speed = self.store.number(0x6099, 1, 1000) * self._velocity_scale
        run.step(self.demand, speed, self._ramp(0x609A), dt)
        settled = abs(self.demand.position - self.position) < 1.0
        if run.is_done and settled:
            # 607Ch: offset of the drive's zero from home.
            self._offset = self.store.number(0x607C) - self.motor.position
            self._hold_here()
            self._homed = True

    def _monitor_following(self, now: float) -> None:
        """Trips when the following error exceeds 6065h for longer than 6066h."""
        window = self.store.number(0x6065)
        error = abs(self.demand.position - self.position)
        if not window or error <= window:
            self._error_since = None
            return
        if self._error_since is None:
            self._error_since = now
        if now - self._error_since >= self.store.number(0x6066) / 1e3:
            self._has_error = True
            self.trip(FOLLOWING_ERROR)


def _int32(value: float) -> int:
    return max(-(1 << 31), min((1 << 31) - 1, round(value)))
