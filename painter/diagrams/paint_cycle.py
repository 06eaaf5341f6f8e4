"""The whole paint cycle: a station with the brain."""

import dataclasses
from typing import TYPE_CHECKING, Unpack

from pydrake.geometry import Meshcat
from pydrake.systems.framework import Diagram, DiagramBuilder

from painter.config import Scenario
from painter.diagrams.brain import MakeBrain, OwnSystems
from painter.diagrams.station import (
    STATION_INPUTS,
    STATION_TO_BRAIN,
    MakeStation,
)
from painter.planning.program.remainder import Remainder
from painter.robot.robot_model import MakeRobotModel, RobotModel
from painter.systems.simulated.paint_film import FilmState

if TYPE_CHECKING:  # Simulation runs without the robot's packages.
    from painter.diagrams.hardware_station import RobotConnection


@dataclasses.dataclass(frozen=True)
class PaintCycleDiagram:
    """The whole cycle.

    Attributes:
        diagram: Station and brain, connected; all their outputs are exported under
            their own names, and the brain's input `operator`.
        station: The station in it.
        brain: The brain in it.
        robot: Model of the robot that the brain plans for.
    """

    diagram: Diagram
    station: Diagram
    brain: Diagram
    robot: RobotModel


def MakePaintCycle(
    scenario: Scenario,
    *,
    connection: "RobotConnection | None" = None,
    remainder: Remainder | None = None,
    film: FilmState | None = None,
    meshcat: Meshcat | None = None,
    **own: Unpack[OwnSystems],
) -> PaintCycleDiagram:
    """Makes the whole paint cycle of a scenario.

    Args:
        scenario: The job.
        connection: The robot to connect to; None = a simulated one.
        remainder: See `MakeBrain`.
        film: Film that is on the wall already; simulation only. None = none.
        meshcat: Where to show it, or None.
        own: `finder`, `segmenter`, `planner`, `mover`, `accumulator`: systems of one's
            own in place of the brain's; see `OwnSystems` and docs/own-stage.md.

    Raises:
        PortTypeError: A given system has other ports than the one that it replaces.
        BusError: The robot's drives are not enabled.
    """
    robot = MakeRobotModel(scenario)
    brain = MakeBrain(scenario, robot, remainder=remainder, **own)
    station = MakeStation(scenario, connection=connection, film=film, meshcat=meshcat)
    builder = DiagramBuilder()
    for system in (station, brain):
        builder.AddSystem(system)
        for index in range(system.num_output_ports()):
            port = system.get_output_port(index)
            builder.ExportOutput(port, port.get_name())
    for name in STATION_TO_BRAIN:
        builder.Connect(station.GetOutputPort(name), brain.GetInputPort(name))
    for name in STATION_INPUTS:
        builder.Connect(brain.GetOutputPort(name), station.GetInputPort(name))
    builder.ExportInput(brain.GetInputPort("operator"), "operator")
    diagram = builder.Build()
    diagram.set_name("paint_cycle")
    return PaintCycleDiagram(diagram=diagram, station=station, brain=brain, robot=robot)
