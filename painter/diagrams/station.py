"""The station: what the brain sees of a connection, whichever body it is."""

from typing import TYPE_CHECKING

from pydrake.geometry import Meshcat
from pydrake.systems.framework import Diagram

from painter.config import Scenario
from painter.diagrams.sim_station import MakeSimStation
from painter.systems.simulated.paint_film import FilmState

if TYPE_CHECKING:  # Simulation runs without the robot's packages.
    from painter.diagrams.hardware_station import RobotConnection

STATION_INPUTS = frozenset({"arm.desired_state", "gun.trigger"})
STATION_OUTPUTS = frozenset(
    {
        "arm.state_estimated",
        "arm.status",
        "wall_camera.color_image",
        "wall_camera.depth_image",
        "wall_camera.image_time",
    }
)
CHEAT_PREFIX = "cheat."


def MakeStation(
    scenario: Scenario,
    *,
    connection: "RobotConnection | None" = None,
    film: FilmState | None = None,
    meshcat: Meshcat | None = None,
) -> Diagram:
    """Makes the simulated station or, given a connected `body`, the robot's.

    Args:
        scenario: What stands in front of which robot.
        connection: What the robot's station is connected to; None = a simulated one.
        film: What is on the wall already; simulation only. None = nothing.
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
    CheckPorts(station)
    return station


def CheckPorts(station: Diagram) -> None:
    """Raises ValueError if a station's ports are not those of the contract."""
    inputs = {
        station.get_input_port(i).get_name() for i in range(station.num_input_ports())
    }
    outputs = {
        station.get_output_port(i).get_name() for i in range(station.num_output_ports())
    }
    public = {name for name in outputs if not name.startswith(CHEAT_PREFIX)}
    for kind, found, expected in (
        ("inputs", inputs, STATION_INPUTS),
        ("outputs", public, STATION_OUTPUTS),
    ):
        if found != expected:
            raise ValueError(
                f"station {kind}: missing {sorted(expected - found)}, "
                f"not in the contract {sorted(found - expected)}."
            )
