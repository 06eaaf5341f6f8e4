"""The station: what the brain sees of a body, whichever body it is."""

from pydrake.geometry import Meshcat
from pydrake.systems.framework import Diagram

from painter.config import Scenario
from painter.diagrams.sim_station import MakeSimStation
from painter.systems.paint_film import FilmState

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
    film: FilmState | None = None,
    meshcat: Meshcat | None = None,
) -> Diagram:
    """Makes the simulated station.

    Args:
        scenario: What stands in front of which robot.
        film: What is on the wall already; None = nothing.
        meshcat: Where to show it, or None.

    Returns:
        A diagram with exactly the ports of the contract, plus `cheat.*`.
    """
    station = MakeSimStation(scenario, film=film, meshcat=meshcat)
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
