"""All simulated nodes of a bus file on one wire, and faults to inject."""

from collections import deque
from collections.abc import Callable

import numpy as np

from painter.canopen.config.bus_config import BusConfig
from painter.canopen.config.units import AXES
from painter.canopen.protocol.frames import ERROR_BUS_OFF, Frame
from painter.canopen.protocol.nmt import NmtState
from painter.canopen.sim.drive import SimDrive
from painter.canopen.sim.faults import Fault
from painter.canopen.sim.io_node import SimIo
from painter.canopen.sim.load import Load
from painter.canopen.sim.motor import LoadedMotor
from painter.canopen.sim.node import SimNode
from painter.canopen.sim.wire import Wire
from painter.canopen.wire.transports import TransportError

STEP = 0.001


class Rack:
    """The simulated nodes of a bus, in simulated time.

    Attributes:
        bus: The bus file.
        wire: The bus.
        drives: By axis.
        io: The I/O node.
        transport: The master's end of the wire.
        now: Simulated time, s.
        stepped: Called after each step of 1 ms.
    """

    def __init__(self, bus: BusConfig, load: Load | None = None) -> None:
        """Creates all drives and the I/O node, before their boot-up.

        Args:
            bus: The bus file; drives have the objects of their EDS.
            load: What the motors move; None = motors alone, each with its own inertia,
                at position 0.
        """
        self.bus = bus
        self.wire = Wire(bus.bitrate)
        self.drives: dict[str, SimDrive] = {}
        for name in AXES:
            config = bus.drives[name]
            drive = SimDrive(
                config.node_id, bus.device(name), self.wire, units=config.units()
            )
            for sub, wanted in enumerate(
                (config.identity.vendor, config.identity.product), start=1
            ):
                if wanted:
                    drive.store.fix(0x1018, sub, wanted)
            self.drives[name] = drive
        self.io = SimIo(bus.io.node_id, self.wire)
        self.transport = WireTransport(self)
        self.now = 0.0
        self.stepped: Callable[[], None] = lambda: None
        self._load = load
        if load is not None:
            self._motors = [LoadedMotor() for _ in AXES]
            self._units = [config.units() for config in bus.axis_drives()]
            self._take_motion(load)
            for drive, motor in zip(self.drives.values(), self._motors, strict=True):
                motor.demand = motor.position
                drive.motor = motor
                drive.on_reset()

    @property
    def nodes(self) -> list[SimNode]:
        """All nodes, drives first."""
        return [*self.drives.values(), self.io]

    @property
    def sync_period(self) -> float:
        """Cycle written to the operational drives (60C2h), s; 0 without any."""
        return max(
            (
                drive.period
                for drive in self.drives.values()
                if drive.nmt == NmtState.OPERATIONAL
            ),
            default=0.0,
        )

    def advance(self, until: float) -> None:
        """Advances frames, motors and timers to a time, s, in steps of 1 ms."""
        while (after := STEP * (round(self.now / STEP) + 1)) <= until + 1e-9:
            self.now = after
            self.wire.advance(self.now)
            for node in self.nodes:
                node.step(self.now)
            if self._load is not None:
                self._move(self._load)
            self.stepped()
        self.wire.advance(until)

    def _move(self, load: Load) -> None:
        """Moves the load by the demands of the drives."""
        pairs = list(zip(self._units, self._motors, strict=True))
        load.step(
            np.array([unit.angle(motor.demand) for unit, motor in pairs]),
            np.array(
                [
                    unit.sign * motor.demand_velocity / unit.counts_per_rad
                    for unit, motor in pairs
                ]
            ),
            STEP,
        )
        self._take_motion(load)

    def _take_motion(self, load: Load) -> None:
        for unit, motor, q, v in zip(
            self._units, self._motors, *load.axes(), strict=True
        ):
            scale = unit.sign * unit.counts_per_rad
            motor.position = (float(q) - unit.zero) * scale
            motor.velocity = float(v) * scale

    def inject(self, fault: Fault, axis: str = "base_yaw") -> None:
        """Injects a fault now.

        Args:
            fault: What fails.
            axis: Which drive; ignored unless a drive fails.
        """
        drive = self.drives[axis]
        if fault == Fault.EMCY:
            drive.trip(0x3220)
        elif fault == Fault.FOLLOWING_ERROR:
            drive.motor.is_blocked = True
        elif fault == Fault.HEARTBEAT_LOST:
            drive.silent = True
        elif fault == Fault.NODE_RESET:
            drive.reboot()
        elif fault == Fault.TPDO_SILENT:
            drive.tpdo_silent = True
        elif fault == Fault.SDO_ABORT:
            drive.sdo.aborts[0x607D, 1] = 0x08000022
        elif fault == Fault.WRONG_IDENTITY:
            drive.store.fix(0x1018, 2, 0xBAD)
        elif fault == Fault.WRONG_UNIT:
            drive.store.fix(0x608F, 1, drive.store.number(0x608F, 1) * 2)
        elif fault == Fault.BRAKE_STUCK:
            drive.brake_stuck = True
        elif fault == Fault.ESTOP:
            self.io.inputs &= ~(1 << self.bus.io.estop_bit)
        elif fault == Fault.PRESSURE_LOW:
            self.io.pressure = 0
        elif fault == Fault.BUS_OFF:
            self.transport.bus_off()
        elif fault == Fault.INTERFACE_DOWN:
            self.transport.is_down = True

    def clear(self) -> None:
        """Ends all lasting faults; tripped drives still need a fault reset."""
        for name, drive in self.drives.items():
            drive.motor.is_blocked = drive.silent = drive.tpdo_silent = False
            drive.brake_stuck = False
            drive.sdo.aborts.clear()
            identity = self.bus.drives[name].identity
            drive.store.fix(0x1018, 2, identity.product)
            drive.store.fix(0x608F, 1, round(self.bus.drives[name].counts_per_turn))
        self.io.inputs = 0xFF
        self.io.pressure = 100
        self.transport.is_down = False


class WireTransport:
    """The master's port on the wire of a rack, in the same thread.

    Attributes:
        is_down: Whether the adapter is unplugged; fault injection.
    """

    def __init__(self, rack: Rack) -> None:
        """Attaches to the wire."""
        self._rack = rack
        self._frames: deque[Frame] = deque()
        self._is_off = False
        self.is_down = False
        self._send = rack.wire.attach(self._take)

    def send(self, frame: Frame) -> None:
        """Sends a frame; a controller that is bus-off loses it.

        Raises:
            TransportError: The adapter is unplugged.
        """
        self._check()
        if not self._is_off:
            self._send(frame, self._rack.now)

    def receive(self, timeout: float) -> list[Frame]:
        """Returns received frames; simulated time does not advance here.

        Raises:
            TransportError: The adapter is unplugged.
        """
        self._check()
        frames = list(self._frames)
        self._frames.clear()
        return frames

    def reopen(self) -> None:
        """Restarts the controller.

        Raises:
            TransportError: The adapter is unplugged.
        """
        self._check()
        self._is_off = False
        self._frames.clear()

    def close(self) -> None:
        """Nothing to close."""

    def bus_off(self) -> None:
        """Makes the controller go bus-off, with an error frame."""
        self._is_off = True
        self._frames.append(Frame(ERROR_BUS_OFF, bytes(8), is_error=True))

    def _take(self, frame: Frame, now: float) -> None:
        if not self._is_off and not self.is_down:
            self._frames.append(frame)

    def _check(self) -> None:
        if self.is_down:
            raise TransportError("the CAN interface is down.", code="PNT-BUS-023")
