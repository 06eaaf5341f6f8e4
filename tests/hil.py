"""The whole loop in one process and in simulated time, for tests.

Brain, hardware station, master, CAN frames, simulated drives, the arm's plant, camera
and paint film: all that `painter deploy` and `painter drives` run, stepped together.
"""

import dataclasses

import numpy as np

from painter.camera.frames import CameraFrame
from painter.camera.reader import CameraHealth, CameraState, Reading
from painter.canopen.config.bus_file import load_bus
from painter.canopen.master.feedback import BusState
from painter.canopen.process.robot_clock import RobotClock
from painter.canopen.sim.lockstep import LockstepBus
from painter.canopen.sim.rack import Rack
from painter.config import Scenario, load_scenario
from painter.diagrams.hardware_station import RobotConnection
from painter.rehearsal.arm_load import ArmLoad
from painter.rehearsal.sim_world import SimWorld
from painter.resources import models_path

WORLD_PERIOD = 0.01


def small_scenario(*words: str) -> Scenario:
    """A low piece of a bare wall: a few strokes, at 0.5 m/s."""
    return load_scenario(
        "blank",
        [
            "tile={width: 0.7, height: 0.6, bottom: 0.9}",
            "raster.speed=0.5",
            *words,
        ],
    )


class Loop:
    """Drives with the arm on them, the world around, and the bus's master.

    Attributes:
        bus: To be handed to the diagram.
        rack: The drives.
        load: The arm.
        world: What is around it; None = no camera, no film.
        unplugged: Set it, and the camera says that it was unplugged.
    """

    def __init__(self, scenario: Scenario, *, world: bool = True) -> None:
        self.scenario = scenario
        bus = load_bus(models_path("bus", "painter.bus.yaml"))
        self.load = ArmLoad(scenario)
        self.rack = Rack(bus, self.load)
        self.bus = LockstepBus(self.rack)
        self.rack.stepped = self._step
        self.world = SimWorld(scenario) if world else None
        self.unplugged = False
        self._reading = Reading()
        self._steps = 0
        self.observers = []

    def bring_up(self) -> "Loop":
        self.bus.start()
        while self.bus.report().feedback.bus_state == BusState.STARTING:
            self.bus.wait_until(self.bus.now() + 0.05)
        report = self.bus.report().feedback
        assert report.bus_state == BusState.ENABLED, report.reason
        return self

    def connection(self, **changes) -> RobotConnection:
        connection = RobotConnection(
            bus=self.bus,
            clock=RobotClock(),
            cycle=self.rack.bus.cycle,
            read_camera=self._read,
        )
        return dataclasses.replace(connection, **changes)

    @property
    def trigger(self) -> float:
        """What the gun truly does."""
        io, config = self.rack.io, self.rack.bus.io
        is_open = io.outputs >> config.valve_bit & 1
        return io.flow / config.flow_full_scale if is_open else 0.0

    def _step(self) -> None:
        for observer in self.observers:
            observer(self)
        self._steps += 1
        if self.world is None or self._steps % round(WORLD_PERIOD * 1e3):
            return
        self.world.advance(self._steps * 1e-3, self.load.state, self.trigger)
        picture = self.world.picture()
        if picture is not None:
            count = self._reading.health.pictures + 1
            self._reading = Reading(
                CameraFrame(picture.depth_mm, None, picture.time, count),
                picture.time,
                CameraHealth(state=CameraState.STREAMING, pictures=count),
            )

    def _read(self) -> Reading:
        if not self.unplugged:
            return self._reading
        return dataclasses.replace(
            self._reading,
            health=CameraHealth(CameraState.MISSING, "camera: it was unplugged."),
        )


def blind_reading() -> Reading:
    """A camera that works and has no picture yet."""
    return Reading(health=CameraHealth(state=CameraState.STREAMING))


def tip_speed(X_WG: np.ndarray, period: float) -> np.ndarray:
    """Speed of the nozzle between poses (n, 4, 4), (n - 1,) m/s."""
    return np.linalg.norm(np.diff(X_WG[:, :3, 3], axis=0), axis=1) / period
