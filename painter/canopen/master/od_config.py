"""What is written to a drive or I/O node before it is used, and why.

`write_and_verify` writes a plan, reads every object back and compares.
"""

from collections.abc import Generator, Sequence
from dataclasses import dataclass, field

from painter.canopen.config.bus_config import BusConfig, DriveConfig
from painter.canopen.config.bus_file import choose_mode
from painter.canopen.config.device import DeviceDescription, Mode
from painter.canopen.config.units import DriveLimits
from painter.canopen.protocol.frames import RPDO_BASES, TPDO_BASES
from painter.canopen.protocol.od_types import bounds, pack, unpack
from painter.canopen.protocol.sdo import SdoClient
from painter.errors import BusError, InputError

_OFF = 1 << 31
# Bits of a PDO's COB-ID that are compared on reading back: valid bit and identifier.
# Bit 30 (no RTR) is fixed in some devices. Source: CiA 301 v4.2.0, 7.5.2.35.
_COB_ID_MASK = 0x800007FF
# Time for which a following error must last, ms: two cycles at 200 Hz.
_FOLLOWING_ERROR_TIME = 10
_IO_EVENT_MS = 20

Objects = Sequence[tuple[int, int, int]]  # Index, sub, bits.

# TPDO2 is sent every other cycle, so that five drives stay below 40 % bus load.
SLOW_EVERY = 2
DRIVE_TPDO: Objects = ((0x6041, 0, 16), (0x6064, 0, 32))
DRIVE_SLOW_TPDO: Objects = ((0x606C, 0, 32), (0x60F4, 0, 32))
IO_RPDO: Objects = ((0x6200, 1, 8), (0x6411, 1, 16))
IO_TPDO: Objects = ((0x6000, 1, 8), (0x6401, 1, 16))


def drive_rpdo(mode: Mode) -> Objects:
    """Objects of a drive's RPDO: controlword and target."""
    target = (0x60C1, 1) if mode == Mode.INTERPOLATED_POSITION else (0x607A, 0)
    return ((0x6040, 0, 16), (*target, 32))


@dataclass(frozen=True)
class Entry:
    """One object to write.

    Attributes:
        index: Object.
        sub: Sub-index.
        value: What to write.
        name: In messages.
        mask: Bits that are compared on reading back.
    """

    index: int
    sub: int
    value: int
    name: str
    mask: int = -1


@dataclass
class ConfigPlan:
    """What is written to one node, in order.

    Attributes:
        device: Description of the node.
        entries: Objects to write.
        notes: Optional objects that the device lacks, and the consequence.
    """

    device: DeviceDescription
    entries: list[Entry] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def require(
        self, index: int, sub: int, value: int, name: str, mask: int = -1
    ) -> None:
        """Adds an object that the device must have.

        Raises:
            InputError: The device lacks the object, or its range excludes the value.
        """
        info = self.device.find(index, sub)
        if info is None or not self.device.is_writable(index, sub):
            raise InputError(
                f"{self.device.source}: no writable {index:04X}h:{sub} for {name}.",
                code="PNT-BUS-014",
            )
        low, high = bounds(info.data_type)
        if info.low != info.high:
            low = max(low, int(info.low)) if isinstance(info.low, int) else low
            high = min(high, int(info.high)) if isinstance(info.high, int) else high
        if not low <= value <= high:
            raise InputError(
                f"{self.device.source}: {name} ({index:04X}h:{sub}) must be {low} to "
                f"{high}, got {value}.",
                code="PNT-BUS-015",
            )
        self.entries.append(Entry(index, sub, value, name, mask))

    def request(
        self, index: int, sub: int, value: int, name: str, otherwise: str
    ) -> None:
        """Adds an object that the device may lack; then notes what applies instead."""
        info = self.device.find(index, sub)
        if info is None or not self.device.is_writable(index, sub):
            self.notes.append(f"no {index:04X}h ({name}): {otherwise}")
        elif info.low == info.high != value and info.low is not None:
            self.notes.append(f"{index:04X}h ({name}) is fixed to {info.low!r}.")
        else:
            self.require(index, sub, value, name)

    def pdo(
        self, parameters: int, maps: int, cob_id: int, kind: int, objects: Objects
    ) -> None:
        """Adds a PDO: off, mapping cleared, entries mapped and counted, on.

        Source: CiA 301 v4.2.0, 7.5.2.36 (the order of these steps).
        """
        self.require(parameters, 1, _OFF | cob_id, "PDO off", _COB_ID_MASK)
        self.require(parameters, 2, kind, "transmission type")
        self.require(maps, 0, 0, "mapping cleared")
        for i, (index, sub, bits) in enumerate(objects, start=1):
            entry = index << 16 | sub << 8 | bits
            self.require(maps, i, entry, f"mapping of {index:04X}h")
        self.require(maps, 0, len(objects), "mapped objects")
        self.require(parameters, 1, cob_id, "COB-ID", _COB_ID_MASK)

    def pdos_off(self, used: Sequence[int]) -> None:
        """Switches off the PDOs of the device that are not used."""
        for base, cob_ids in ((0x1400, RPDO_BASES), (0x1800, TPDO_BASES)):
            for n in range(4):
                if base + n not in used and self.device.is_writable(base + n, 1):
                    off = _OFF | cob_ids[n]
                    self.require(base + n, 1, off, "PDO off", _OFF)


def plan_drive(
    bus: BusConfig,
    drive: DriveConfig,
    device: DeviceDescription,
    limits: DriveLimits,
) -> ConfigPlan:
    """Returns the configuration of a drive.

    Raises:
        InputError: The device lacks a required object, or its range excludes a value;
            names the object and the bound.
    """
    mode = choose_mode(device)
    if mode is None:
        raise InputError(
            f"{device.source}: has neither CSP nor IP mode.", code="PNT-BUS-016"
        )
    plan, node = ConfigPlan(device), drive.node_id
    plan.require(0x6060, 0, mode, "mode of operation")
    milliseconds = round(bus.cycle * 1e3)
    plan.require(0x60C2, 1, milliseconds, "interpolation period, ms")
    plan.request(0x60C2, 2, -3, "unit of the interpolation period", "taken as ms.")
    host = "only the host enforces this limit."
    plan.request(0x607D, 1, limits.position[0], "position limit, lower", host)
    plan.request(0x607D, 2, limits.position[1], "position limit, upper", host)
    plan.request(0x607F, 0, limits.profile_velocity, "velocity limit", host)
    plan.request(0x6080, 0, limits.motor_speed, "motor speed limit, rpm", host)
    plan.request(0x60C5, 0, limits.acceleration, "acceleration limit", host)
    ramp = "the drive uses its own ramp."
    plan.request(0x6085, 0, limits.quick_stop, "quick stop deceleration", ramp)
    plan.request(0x6084, 0, limits.quick_stop, "deceleration", ramp)
    plan.require(0x6065, 0, limits.following_error, "following error window")
    plan.request(
        0x6066, 0, _FOLLOWING_ERROR_TIME, "following error time", "it trips at once."
    )
    options, own = drive.options, "the drive reacts as its maker chose."
    plan.request(0x605A, 0, options.quick_stop, "quick stop option", own)
    plan.request(0x605B, 0, options.shutdown, "shutdown option", own)
    plan.request(0x605C, 0, options.disable, "disable option", own)
    plan.request(0x605D, 0, options.halt, "halt option", own)
    plan.request(0x605E, 0, options.fault, "fault reaction option", own)
    plan.request(0x6007, 0, options.abort, "abort connection option", own)
    _plan_monitoring(plan, bus)
    plan.pdos_off((0x1400, 0x1800, 0x1801))
    plan.pdo(0x1400, 0x1600, RPDO_BASES[0] + node, 1, drive_rpdo(mode))
    _plan_deadline(plan, bus.timeouts.rpdo_cycles * bus.cycle)
    plan.pdo(0x1800, 0x1A00, TPDO_BASES[0] + node, 1, DRIVE_TPDO)
    plan.pdo(0x1801, 0x1A01, TPDO_BASES[1] + node, SLOW_EVERY, DRIVE_SLOW_TPDO)
    return plan


def plan_io(bus: BusConfig, device: DeviceDescription) -> ConfigPlan:
    """Returns the configuration of the I/O node: outputs go off without the master."""
    plan, node = ConfigPlan(device), bus.io.node_id
    plan.require(0x6206, 1, 0xFF, "error mode of outputs")
    plan.require(0x6207, 1, 0, "error value of outputs")
    plan.require(0x6443, 1, 1, "error mode of the flow")
    plan.require(0x6444, 1, 0, "error value of the flow")
    _plan_monitoring(plan, bus)
    plan.pdos_off((0x1400, 0x1800))
    plan.pdo(0x1400, 0x1600, RPDO_BASES[0] + node, 255, IO_RPDO)
    _plan_deadline(plan, bus.io.deadline)
    plan.request(0x1800, 5, _IO_EVENT_MS, "event timer, ms", "sent on change only.")
    plan.pdo(0x1800, 0x1A00, TPDO_BASES[0] + node, 255, IO_TPDO)
    return plan


def _plan_deadline(plan: ConfigPlan, deadline: float) -> None:
    """Sets the deadline of the RPDO, s, after which the node misses its master.

    Source: CiA 301 v4.2.0, 7.5.2.35: the event timer of an RPDO is its deadline, in ms.
    """
    milliseconds = round(deadline * 1e3)
    own = "only the heartbeat shows that the master is dead."
    plan.request(0x1400, 5, milliseconds, "deadline of the RPDO, ms", own)


def _plan_monitoring(plan: ConfigPlan, bus: BusConfig) -> None:
    milliseconds = round(bus.timeouts.heartbeat * 1e3)
    consumer = bus.master_id << 16 | milliseconds
    own = "the node does not detect a dead master."
    plan.request(0x1016, 1, consumer, "heartbeat of the master", own)
    plan.require(0x1017, 0, max(1, milliseconds // 3), "heartbeat")
    # 1: stay operational, so that the statusword keeps coming; 6007h stops the axis.
    plan.request(0x1029, 1, 1, "error behaviour", "the node may leave OPERATIONAL.")


def write_and_verify(
    name: str, sdo: SdoClient, plan: ConfigPlan
) -> Generator[None, None, None]:
    """Writes a plan, reads back the last value of each object and compares.

    Raises:
        SdoError: The node aborted an access.
        BusError: A value reads back differently; names object and both values.
    """
    final: dict[tuple[int, int], Entry] = {}
    for entry in plan.entries:
        info = plan.device.find(entry.index, entry.sub)
        assert info is not None
        data = pack(info.data_type, entry.value)
        yield from sdo.transfer(entry.index, entry.sub, data)
        final[entry.index, entry.sub] = entry
    for entry in final.values():
        info = plan.device.find(entry.index, entry.sub)
        assert info is not None
        if info.access == "wo":
            continue
        data = yield from sdo.transfer(entry.index, entry.sub)
        try:
            found = unpack(info.data_type, data)
        except ValueError as error:
            raise BusError(
                f"{name}: {entry.index:04X}h:{entry.sub}: {error}", code="PNT-BUS-017"
            ) from None
        assert isinstance(found, int)
        if (found ^ entry.value) & entry.mask:
            raise BusError(
                f"{name}: {entry.name} ({entry.index:04X}h:{entry.sub}) was written "
                f"{entry.value} and reads {found}.",
                code="PNT-BUS-018",
            )
