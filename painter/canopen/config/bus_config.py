"""The bus file: nodes of the bus, their units and limits.

`bus_file.load_bus` reads it; `BusConfig.validate` names the field of every error.
"""

import dataclasses
import enum
from collections.abc import Collection, Iterator
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
from perception.settings import Conflict, required, setting, validate

# Source: CiA 301 v4.2.0, 5.3 (bit timing table).
BITRATES = (10_000, 20_000, 50_000, 125_000, 250_000, 500_000, 800_000, 1_000_000)


class HomingKind(enum.StrEnum):
    """How the zero of an axis is found."""

    NONE = "none"  # The encoder is absolute; `zero` holds the offset.
    DRIVE = "drive"  # By the homing mode of the drive.


@dataclasses.dataclass(kw_only=True)
class Identity:
    """Expected values of object 1018h; 0 is not checked."""

    vendor: int = 0
    product: int = 0
    revision: int = 0
    serial: int = 0


@dataclasses.dataclass(kw_only=True)
class Homing:
    """How an axis finds its zero.

    Attributes:
        kind: By absolute encoder or by the drive.
        method: 6098h; CiA 402-2 table of homing methods, negative ones are the maker's.
        speed_switch: 6099h:1, rad/s of the axis.
        speed_zero: 6099h:2, rad/s of the axis.
        acceleration: 609Ah, rad/s² of the axis.
        offset: 607Ch, rad of the axis.
        timeout: Longest time of the whole homing, s.
    """

    kind: HomingKind = HomingKind.NONE
    method: int = setting(37, "1", least=-128, most=37)
    speed_switch: float = setting(0.2, "rad/s", above=0.0)
    speed_zero: float = setting(0.05, "rad/s", above=0.0)
    acceleration: float = setting(1.0, "rad/s2", above=0.0)
    offset: float = setting(0.0, "rad")
    timeout: float = setting(30.0, "s", above=0.0)


def _option(default: enum.IntEnum) -> int:
    """Makes the field of an option code; its enumeration holds all legal values."""
    return setting(
        int(default), "1", choices=tuple(int(code) for code in type(default))
    )


@dataclasses.dataclass(kw_only=True)
class Options:
    """Option codes; see cia402.py. Objects that a drive lacks are noted.

    Attributes:
        quick_stop: 605Ah.
        shutdown: 605Bh.
        disable: 605Ch.
        halt: 605Dh.
        fault: 605Eh.
        abort: 6007h.
    """

    quick_stop: int = _option(QuickStopOption.QUICK_STOP_RAMP_AND_HOLD)
    shutdown: int = _option(StopOption.SLOW_DOWN)
    disable: int = _option(StopOption.SLOW_DOWN)
    halt: int = _option(HaltOption.QUICK_STOP_RAMP)
    fault: int = _option(FaultOption.QUICK_STOP_RAMP)
    abort: int = _option(AbortOption.QUICK_STOP)


@dataclasses.dataclass(kw_only=True)
class Timeouts:
    """Time-outs of bring-up and of the monitors, s.

    Attributes:
        boot: From the reset to the boot-up message.
        sdo: For the answer to an SDO request.
        sdo_retries: Further tries of a request.
        transition: For one step of the state machine without brake.
        brake: For the step that opens or closes the brake.
        heartbeat: Without a heartbeat of a node (or, in the drives, of the master).
        tpdo: Without a TPDO of a drive.
        setpoint: Without a setpoint while moving or spraying.
        rpdo_cycles: In the drives, cycles without an RPDO of the master.
    """

    boot: float = setting(2.0, "s", above=0.0)
    sdo: float = setting(0.1, "s", above=0.0)
    sdo_retries: int = setting(3, "1", least=0, most=100)
    transition: float = setting(0.5, "s", above=0.0)
    brake: float = setting(1.0, "s", above=0.0)
    heartbeat: float = setting(0.3, "s", above=0.0)
    tpdo: float = setting(0.02, "s", above=0.0)
    setpoint: float = setting(0.05, "s", above=0.0)
    rpdo_cycles: int = setting(4, "1", least=2, most=1000)


@dataclasses.dataclass(kw_only=True)
class DriveConfig:
    """One drive.

    Attributes:
        node_id: 1 to 127.
        eds: EDS or DCF beside the bus file; empty for the full CiA 402 object set.
        identity: Expected values of 1018h.
        counts_per_turn: Encoder counts per turn of the motor.
        gear: Motor turns per turn of the axis.
        sign: +1 or -1.
        zero: Axis angle at drive position 0, rad.
        velocity_unit: Unit of velocities in the drive.
        acceleration_unit: Unit of accelerations in the drive.
        homing: How it finds its zero.
        options: How it reacts to stops.
        restore: Whether defaults are restored (1011h) before the configuration.
        store: Whether the configuration is stored (1010h) at its end.
    """

    node_id: int = required("1", least=1, most=127)
    counts_per_turn: float = required("1", above=0.0)
    gear: float = required("1", above=0.0)
    eds: str = ""
    identity: Identity = dataclasses.field(default_factory=Identity)
    sign: int = setting(1, "1", choices=(1, -1))
    zero: float = setting(0.0, "rad")
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
        identity: Expected values of 1018h.
        valve_bit: Bit of 6200h:1 that opens the gun.
        estop_bit: Bit of 6000h:1 that is 1 while the e-stop chain is closed.
        flow_full_scale: Value of 6411h:1 at nominal flow.
        pressure_scale: Pressure of the pump at one count of 6401h:1, Pa.
        pressure_low: Pressure below which spraying stops the arm, Pa.
        deadline: Time without an RPDO after which the node closes the gun by itself, s;
            whole milliseconds. The master sends two a cycle.
    """

    node_id: int = setting(6, "1", least=1, most=127)
    identity: Identity = dataclasses.field(default_factory=Identity)
    valve_bit: int = setting(0, "1", least=0, most=7)
    estop_bit: int = setting(0, "1", least=0, most=7)
    flow_full_scale: int = setting(32767, "1", least=1, most=32767)
    pressure_scale: float = setting(1000.0, "Pa")
    pressure_low: float = setting(0.0, "Pa")
    deadline: float = setting(0.005, "s", above=0.0, most=60.0)


@dataclasses.dataclass(kw_only=True)
class BusConfig:
    """The bus and its nodes.

    Attributes:
        drives: One drive an axis, by the names of `units.AXES`.
        joints: Limits by the names of `units.JOINTS`, SI units.
        interface: A python-can interface, or "local" for a socket on this machine.
        channel: The interface's channel, e.g. can0, or the socket's path.
        bitrate: Bits per second; the bus load is computed with it.
        cycle: Time between two SYNCs, s; whole milliseconds up to 50.
        master_id: Node-ID of the master's heartbeat.
        io: The I/O node.
        timeouts: Of bring-up and of the monitors.
        path: The bus file; paths of EDS files are relative to its folder.
    """

    drives: dict[str, DriveConfig]
    joints: dict[str, JointLimits]
    interface: str = "socketcan"
    channel: str = "can0"
    bitrate: int = setting(1_000_000, "bit/s", choices=BITRATES)
    cycle: float = setting(0.005, "s", least=0.001, most=0.05)
    master_id: int = setting(127, "1", least=1, most=127)
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
        validate(self)

    def conflicts(self) -> Iterator[Conflict]:
        """Checks fields against each other."""
        if abs(self.cycle * 1e3 % 1.0) > 1e-9:
            yield "cycle", "whole milliseconds", self.cycle
        ids = {"master_id": self.master_id, "io.node_id": self.io.node_id}
        ids |= {f"drives.{name}.node_id": d.node_id for name, d in self.drives.items()}
        seen: dict[int, str] = {}
        for field, node_id in ids.items():
            if node_id in seen:
                yield field, f"other than {seen[node_id]}", node_id
            seen[node_id] = field
        least = self.cycle / 2.0 + 0.002  # Timers of nodes tick each millisecond.
        if self.io.deadline < least:
            bound = f">= {least:g} s, half a cycle and 2 ms"
            yield "io.deadline", bound, self.io.deadline
        if self.timeouts.tpdo < 2.0 * self.cycle:
            bound = f">= 2 cycles, {2.0 * self.cycle:g} s"
            yield "timeouts.tpdo", bound, self.timeouts.tpdo


def _check_names(field: str, given: Collection[str], wanted: tuple[str, ...]) -> None:
    missing = [name for name in wanted if name not in given]
    extra = [name for name in given if name not in wanted]
    if missing:
        raise ValueError(f"{field}.{missing[0]} is missing.")
    if extra:
        raise ValueError(f"{field}.{extra[0]} is unknown; known: {', '.join(wanted)}.")
