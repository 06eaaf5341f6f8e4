"""The bus file: what is on the bus, in which units, and what is allowed.

`bus_file.load_bus` reads it; `BusConfig.validate` names the field of every error.
"""

import dataclasses
import enum
import math
from collections.abc import Collection
from pathlib import Path

from painter.canopen.config.device import DeviceDescription, read_device
from painter.canopen.config.standard_objects import standard_drive
from painter.canopen.config.units import (
    AXES,
    JOINTS,
    AccelerationUnit,
    AxisUnits,
    DriveLimits,
    JointLimits,
    VelocityUnit,
    drive_limits,
)
from painter.canopen.protocol.cia402 import (
    AbortOption,
    FaultOption,
    HaltOption,
    QuickStopOption,
    StopOption,
)

# Source: CiA 301 v4.2.0, 5.3 (bit timing table).
BITRATES = (10_000, 20_000, 50_000, 125_000, 250_000, 500_000, 800_000, 1_000_000)


class HomingKind(enum.StrEnum):
    """Who knows where zero is."""

    NONE = "none"  # The encoder is absolute; `zero` holds the offset.
    DRIVE = "drive"  # The drive's own homing mode finds it.


@dataclasses.dataclass(kw_only=True)
class Identity:
    """Object 1018h; 0 is not checked."""

    vendor: int = 0
    product: int = 0
    revision: int = 0
    serial: int = 0


@dataclasses.dataclass(kw_only=True)
class Homing:
    """How an axis finds its zero.

    Attributes:
        kind: Who does it.
        method: 6098h; CiA 402-2 table of homing methods, negative ones are the maker's.
        speed_switch: 6099h:1, rad/s of the axis.
        speed_zero: 6099h:2, rad/s of the axis.
        acceleration: 609Ah, rad/s² of the axis.
        offset: 607Ch, rad of the axis.
        timeout: Time for the whole homing, s.
    """

    kind: HomingKind = HomingKind.NONE
    method: int = 37
    speed_switch: float = 0.2
    speed_zero: float = 0.05
    acceleration: float = 1.0
    offset: float = 0.0
    timeout: float = 30.0


@dataclasses.dataclass(kw_only=True)
class Options:
    """Option codes; see cia402.py. Objects that a drive lacks are reported."""

    quick_stop: int = QuickStopOption.QUICK_STOP_RAMP_AND_HOLD
    shutdown: int = StopOption.SLOW_DOWN
    disable: int = StopOption.SLOW_DOWN
    halt: int = HaltOption.QUICK_STOP_RAMP
    fault: int = FaultOption.QUICK_STOP_RAMP
    abort: int = AbortOption.QUICK_STOP


@dataclasses.dataclass(kw_only=True)
class Timeouts:
    """Times of bring-up and of the watches, s.

    Attributes:
        boot: From the reset to the boot-up message.
        sdo: For one answer; each request is tried `sdo_retries` more times.
        sdo_retries: Further tries of a request.
        transition: For one step of the state machine without brake.
        brake: For the step that opens or closes the brake.
        heartbeat: Without a heartbeat of a node (or, in the drives, of the master).
        tpdo: Without a process data object of a drive.
        setpoint: Without a setpoint while moving or spraying.
        rpdo_cycles: Cycles without a process data object of the master, in the drives.
    """

    boot: float = 2.0
    sdo: float = 0.1
    sdo_retries: int = 3
    transition: float = 0.5
    brake: float = 1.0
    heartbeat: float = 0.3
    tpdo: float = 0.02
    setpoint: float = 0.05
    rpdo_cycles: int = 4


@dataclasses.dataclass(kw_only=True)
class DriveConfig:
    """One drive.

    Attributes:
        node_id: 1 to 127.
        eds: EDS or DCF beside the bus file; empty for the full CiA 402 object set.
        identity: What 1018h must say.
        counts_per_turn: Encoder counts a turn of the motor.
        gear: Motor turns a turn of the axis.
        sign: +1 or -1.
        zero: Axis angle at drive position 0, rad.
        velocity_unit: Unit of velocities in the drive.
        acceleration_unit: Unit of accelerations in the drive.
        homing: How it finds its zero.
        options: What it does at a stop.
        restore: Whether 1011h is written first, so that nothing is left from before.
        store: Whether 1010h is written at the end of the configuration.
    """

    node_id: int
    counts_per_turn: float
    gear: float
    eds: str = ""
    identity: Identity = dataclasses.field(default_factory=Identity)
    sign: int = 1
    zero: float = 0.0
    velocity_unit: VelocityUnit = VelocityUnit.COUNTS_PER_S
    acceleration_unit: AccelerationUnit = AccelerationUnit.COUNTS_PER_S2
    homing: Homing = dataclasses.field(default_factory=Homing)
    options: Options = dataclasses.field(default_factory=Options)
    restore: bool = False
    store: bool = False

    def units(self) -> AxisUnits:
        """The drive's units."""
        return AxisUnits(
            counts_per_turn=self.counts_per_turn,
            gear=self.gear,
            sign=self.sign,
            zero=self.zero,
            velocity=self.velocity_unit,
            acceleration=self.acceleration_unit,
        )


@dataclasses.dataclass(kw_only=True)
class IoConfig:
    """The CiA 401 node of gun and safety chain.

    Attributes:
        node_id: 1 to 127.
        identity: What 1018h must say.
        valve_bit: Bit of 6200h:1 that opens the gun.
        estop_bit: Bit of 6000h:1 that is 1 while the e-stop chain is closed.
        flow_full_scale: Value of 6411h:1 at nominal flow.
        pressure_scale: Pressure of the pump at one count of 6401h:1, Pa.
        pressure_low: Pressure below which spraying stops the arm, Pa.
        deadline: Time without a word of the master after which the node closes the gun
            by itself, s; whole milliseconds. The master says it twice a cycle.
    """

    node_id: int = 6
    identity: Identity = dataclasses.field(default_factory=Identity)
    valve_bit: int = 0
    estop_bit: int = 0
    flow_full_scale: int = 32767
    pressure_scale: float = 1000.0
    pressure_low: float = 0.0
    deadline: float = 0.005


@dataclasses.dataclass(kw_only=True)
class BusConfig:
    """The bus and all on it.

    Attributes:
        drives: One drive an axis, by the names of `units.AXES`.
        joints: Limits by the names of `units.JOINTS`, SI units.
        interface: A python-can interface, or "local" for a socket on this machine.
        channel: The interface's channel, e.g. can0, or the socket's path.
        bitrate: Bits a second; the load is computed with it.
        cycle: Time between two SYNCs, s; whole milliseconds up to 50.
        master_id: Node-ID of the master's heartbeat.
        io: The I/O node.
        timeouts: Times of bring-up and of the watches.
        path: The file it came from; EDS files are looked for beside it.
    """

    drives: dict[str, DriveConfig]
    joints: dict[str, JointLimits]
    interface: str = "socketcan"
    channel: str = "can0"
    bitrate: int = 1_000_000
    cycle: float = 0.005
    master_id: int = 127
    io: IoConfig = dataclasses.field(default_factory=IoConfig)
    timeouts: Timeouts = dataclasses.field(default_factory=Timeouts)
    path: str = ""

    def axis_drives(self) -> list[DriveConfig]:
        """Drives in the order of `units.AXES`."""
        return [self.drives[name] for name in AXES]

    def joint_limits(self) -> list[JointLimits]:
        """Limits in the order of `units.JOINTS`."""
        return [self.joints[name] for name in JOINTS]

    def drive_limits(self) -> list[DriveLimits]:
        """Limits of the drives in their own units, in the order of `units.AXES`."""
        units = [drive.units() for drive in self.axis_drives()]
        return drive_limits(self.joint_limits(), units)

    def device(self, axis: str) -> DeviceDescription:
        """Reads the description of a drive.

        Raises:
            InputError: Its EDS cannot be read.
        """
        drive = self.drives[axis]
        if not drive.eds:
            return standard_drive()
        return read_device(Path(self.path).parent / drive.eds, drive.node_id)

    def validate(self) -> None:
        """Checks names and ranges.

        Raises:
            ValueError: Names the field, the value and the bound.
        """
        _check_names("drives", self.drives, AXES)
        _check_names("joints", self.joints, JOINTS)
        if self.bitrate not in BITRATES:
            raise ValueError(f"bitrate must be one of {BITRATES}, got {self.bitrate}.")
        milliseconds = self.cycle * 1e3
        if not 1.0 <= milliseconds <= 50.0 or abs(milliseconds % 1.0) > 1e-9:
            raise ValueError(
                f"cycle must be whole milliseconds, 0.001 to 0.05 s, got {self.cycle}."
            )
        ids = {"master_id": self.master_id, "io.node_id": self.io.node_id}
        ids |= {f"drives.{name}.node_id": d.node_id for name, d in self.drives.items()}
        seen: dict[int, str] = {}
        for field, node_id in ids.items():
            _check_range(field, node_id, 1, 127)
            if node_id in seen:
                raise ValueError(f"{field} is {node_id}, as is {seen[node_id]}.")
            seen[node_id] = field
        for name, drive in self.drives.items():
            _check_drive(f"drives.{name}", drive)
        for name, limits in self.joints.items():
            _check_joint(f"joints.{name}", limits)
        for name in (f.name for f in dataclasses.fields(Timeouts)):
            if name not in ("sdo_retries", "rpdo_cycles"):
                _check_positive(f"timeouts.{name}", getattr(self.timeouts, name))
        _check_range("timeouts.sdo_retries", self.timeouts.sdo_retries, 0, 100)
        _check_range("timeouts.rpdo_cycles", self.timeouts.rpdo_cycles, 2, 1000)
        least = self.cycle / 2.0 + 0.002  # Timers of nodes tick each millisecond.
        if not least <= self.io.deadline <= 60.0:
            raise ValueError(
                f"io.deadline must be {least:g} to 60 s (half a cycle and 2 ms), "
                f"got {self.io.deadline!r}."
            )
        _check_range("io.valve_bit", self.io.valve_bit, 0, 7)
        _check_range("io.estop_bit", self.io.estop_bit, 0, 7)
        _check_range("io.flow_full_scale", self.io.flow_full_scale, 1, 32767)
        if self.timeouts.tpdo < 2.0 * self.cycle:
            raise ValueError(
                f"timeouts.tpdo must be >= 2 cycles, {2.0 * self.cycle:g} s, "
                f"got {self.timeouts.tpdo:g}."
            )


def _check_names(field: str, given: Collection[str], wanted: tuple[str, ...]) -> None:
    missing = [name for name in wanted if name not in given]
    extra = [name for name in given if name not in wanted]
    if missing:
        raise ValueError(f"{field}.{missing[0]} is missing.")
    if extra:
        raise ValueError(f"{field}.{extra[0]} is unknown; known: {', '.join(wanted)}.")


def _check_range(field: str, value: int, low: int, high: int) -> None:
    if not low <= value <= high:
        raise ValueError(f"{field} must be {low} to {high}, got {value}.")


def _check_positive(field: str, value: float) -> None:
    if not (math.isfinite(value) and value > 0.0):
        raise ValueError(f"{field} must be > 0, got {value!r}.")


def _check_drive(field: str, drive: DriveConfig) -> None:
    _check_positive(f"{field}.counts_per_turn", drive.counts_per_turn)
    _check_positive(f"{field}.gear", drive.gear)
    if drive.sign not in (-1, 1):
        raise ValueError(f"{field}.sign must be 1 or -1, got {drive.sign!r}.")
    if not math.isfinite(drive.zero):
        raise ValueError(f"{field}.zero must be finite, got {drive.zero!r}.")
    _check_range(f"{field}.homing.method", drive.homing.method, -128, 37)
    for name in ("speed_switch", "speed_zero", "acceleration", "timeout"):
        _check_positive(f"{field}.homing.{name}", getattr(drive.homing, name))
    kinds = {
        "quick_stop": QuickStopOption,
        "shutdown": StopOption,
        "disable": StopOption,
        "halt": HaltOption,
        "fault": FaultOption,
        "abort": AbortOption,
    }
    for name, kind in kinds.items():
        value = getattr(drive.options, name)
        if value not in list(kind):
            allowed = ", ".join(str(int(option)) for option in kind)
            raise ValueError(
                f"{field}.options.{name} must be one of {allowed}; got {value}."
            )


def _check_joint(field: str, limits: JointLimits) -> None:
    if not limits.q_min < limits.q_max:
        raise ValueError(
            f"{field}.q_min must be < q_max {limits.q_max!r}, got {limits.q_min!r}."
        )
    for name in ("v_max", "a_max", "stop", "following_error"):
        _check_positive(f"{field}.{name}", getattr(limits, name))
