"""The robot's station: CANopen drives and gun, and a depth camera."""

from collections.abc import Callable
from dataclasses import dataclass

from pydrake.systems.framework import Diagram, DiagramBuilder

from painter.camera.reader import Reading
from painter.canopen.process.robot_clock import Bus, RobotClock
from painter.config import Scenario
from painter.systems.hardware.canopen_arm import CanopenArm
from painter.systems.hardware.realsense_camera import RealsenseCamera

# Time between checks for a new picture, s; a camera takes at most 30 per second.
CAMERA_PERIOD = 0.02


@dataclass(frozen=True)
class RobotConnection:
    """The robot's devices, to which a hardware station connects.

    Attributes:
        bus: With its drives enabled.
        clock: Maps the diagram's time to the bus's clock.
        cycle: Time between two SYNCs, s.
        read_camera: Returns the camera's newest reading without waiting.
        gun_off: Whether the gun stays closed, whatever the brain commands.
    """

    bus: Bus
    clock: RobotClock
    cycle: float
    read_camera: Callable[[], Reading]
    gun_off: bool = False


def MakeHardwareStation(scenario: Scenario, connection: RobotConnection) -> Diagram:
    """Makes the robot's station.

    Args:
        scenario: Gives the sizes of the camera's pictures.
        connection: The robot.

    Returns:
        A diagram with the ports of `painter.diagrams.station`.

    Raises:
        BusError: The bus has ended, or its drives are not enabled.
    """
    builder = DiagramBuilder()
    config = scenario.wall_camera
    arm = builder.AddNamedSystem(
        "canopen_arm",
        CanopenArm(
            bus=connection.bus,
            clock=connection.clock,
            period=connection.cycle,
            gun_off=connection.gun_off,
        ),
    )
    camera = builder.AddNamedSystem(
        "realsense_camera",
        RealsenseCamera(
            read=connection.read_camera,
            width=config.stereo.width,
            height=config.stereo.height,
            color_width=config.color_width,
            color_height=config.color_height,
            period=CAMERA_PERIOD,
            diagram_time=connection.clock.picture_time,
        ),
    )
    builder.Connect(camera.GetOutputPort("status"), arm.GetInputPort("camera_status"))
    builder.ExportInput(arm.GetInputPort("desired_state"), "arm.desired_state")
    builder.ExportInput(arm.GetInputPort("trigger"), "gun.trigger")
    builder.ExportOutput(arm.GetOutputPort("state_estimated"), "arm.state_estimated")
    builder.ExportOutput(arm.GetOutputPort("status"), "arm.status")
    for port in ("color_image", "depth_image", "image_time"):
        builder.ExportOutput(camera.GetOutputPort(port), f"wall_camera.{port}")
    diagram = builder.Build()
    diagram.set_name("station")
    return diagram
