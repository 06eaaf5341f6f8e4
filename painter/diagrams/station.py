"""The station: the ports between brain and robot, the same on both bodies."""

from typing import TYPE_CHECKING

from pydrake.geometry import Meshcat
from pydrake.systems.framework import Diagram
from pydrake.systems.sensors import ImageDepth16U, ImageRgba8U

from painter.config import Scenario
from painter.diagrams.sim_station import MakeSimStation
from painter.planning.arm.kinematics import NQ
from painter.systems.ports import CheckPorts
from painter.systems.simulated.paint_film import FilmState
from painter.systems.values import ArmStatus

if TYPE_CHECKING:  # Simulation runs without the robot's packages.
    from painter.diagrams.hardware_station import RobotConnection

STATION_INPUTS = {"arm.desired_state": 2 * NQ, "gun.trigger": 1}
STATION_OUTPUTS = {
    "arm.state_estimated": 2 * NQ,
    "arm.status": ArmStatus(),
    "wall_camera.color_image": ImageRgba8U(),
    "wall_camera.depth_image": ImageDepth16U(),
    "wall_camera.image_time": 1,
}
# The outputs that the brain reads; the colour picture is for the report.
STATION_TO_BRAIN = tuple(sorted(STATION_OUTPUTS.keys() - {"wall_camera.color_image"}))
CHEAT_PREFIX = "cheat."


def MakeStation(
    scenario: Scenario,
    *,
    connection: "RobotConnection | None" = None,
    film: FilmState | None = None,
    meshcat: Meshcat | None = None,
) -> Diagram:
    """Makes the simulated station or, given a `connection`, the robot's.

    Args:
        scenario: Robot, scene and settings.
        connection: The robot to connect to; None = a simulated one.
        film: Film that is on the wall already; simulation only. None = none.
        meshcat: Where to show it; simulation only. None = nowhere.

    Returns:
        A diagram with exactly the ports of the contract; in simulation, plus `cheat.*`.

    Raises:
        BusError: The robot's drives are not enabled.
    """
    if connection is None:
        station = MakeSimStation(scenario, film=film, meshcat=meshcat)
    else:
        from painter.diagrams.hardware_station import MakeHardwareStation

        station = MakeHardwareStation(scenario, connection)
    CheckStation(station)
    return station


def CheckStation(station: Diagram) -> None:
    """Raises PortTypeError if a station's ports are not those of the contract."""
    CheckPorts(
        "station", station, STATION_INPUTS, STATION_OUTPUTS, ignored=CHEAT_PREFIX
    )
