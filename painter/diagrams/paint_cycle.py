"""The brain, and the whole paint cycle: a station with the brain."""

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.systems.framework import Diagram, DiagramBuilder

from painter.config import Scenario
from painter.diagrams.station import MakeStation
from painter.planning.program.remainder import Remainder
from painter.planning.tile import nominal_tile_pose
from painter.robot.planners import MakeFreeMotionPlanner, MakeProgramPlanner
from painter.robot.robot_model import MakeRobotModel, RobotModel
from painter.systems.brain.camera_pose import CameraPose
from painter.systems.brain.known_result import KnownResult
from painter.systems.brain.map_accumulator import MapAccumulator
from painter.systems.brain.motion_planner import MotionPlanner
from painter.systems.brain.paint_cycle import (
    KNOWN_WALL_SEQUENCE,
    SEQUENCE,
    STAGES,
    PaintCycle,
)
from painter.systems.brain.path_follower import PathFollower
from painter.systems.brain.spray_path_planner import SprayPathPlanner
from painter.systems.brain.wall_finder import WallFinder
from painter.systems.brain.wall_segmenter import WallSegmenter
from painter.systems.simulated.paint_film import FilmState
from perception.depth_camera.depth import CameraIntrinsics
from perception.values import TileSize, Wall

if TYPE_CHECKING:  # Simulation runs without the robot's packages.
    from painter.diagrams.hardware_station import RobotConnection

# Inputs and outputs of the brain that meet the station's ports of the same name.
STATION_TO_BRAIN = (
    "arm.state_estimated",
    "arm.status",
    "wall_camera.depth_image",
    "wall_camera.image_time",
)
BRAIN_TO_STATION = ("arm.desired_state", "gun.trigger")
# A camera may be silent for up to 3 s before it counts as missing, s.
JOINT_HISTORY = 4.0


def MakeBrain(
    scenario: Scenario, robot: RobotModel, *, remainder: Remainder | None = None
) -> Diagram:
    """Makes the brain: all that looks, decides and plans, the same on every connection.

    Args:
        scenario: The job.
        robot: The job's robot.
        remainder: What is left to do on a wall that was seen before; None = look at
            the wall and paint all of it.

    Returns:
        A diagram with the inputs STATION_TO_BRAIN and `operator` (OperatorCommand, may
        be left unconnected), the outputs BRAIN_TO_STATION, and for whoever watches:
        `cycle_status`, `follower_status`, `surface_map`, `wall`, `segmentation`,
        `program`.
    """
    builder = DiagramBuilder()
    planner = MakeProgramPlanner(scenario, robot)
    X_WT_expected = nominal_tile_pose(scenario.tile)
    period = scenario.cycle.period
    add = builder.AddNamedSystem
    camera_pose = add(
        "camera_pose",
        CameraPose(
            kinematics=robot.kinematics,
            length=JOINT_HISTORY,
            X_CCm=RigidTransform(
                RollPitchYaw(np.deg2rad(scenario.wall_camera.calibrated_deg)),
                scenario.wall_camera.calibrated_m,
            ),
        ),
    )
    accumulator = add(
        "map_accumulator",
        MapAccumulator(
            config=scenario.map,
            pose_graph=scenario.pose_graph,
            intrinsics=CameraIntrinsics.from_stereo(scenario.wall_camera.stereo),
            tile=scenario.tile,
            X_WT=X_WT_expected,
            period=1.0 / scenario.wall_camera.rate,
        ),
    )
    mover = add(
        "motion_planner",
        MotionPlanner(
            planner=MakeFreeMotionPlanner(scenario, robot),
            cell=scenario.segmentation.cell,
            period=period,
        ),
    )
    spray_planner = add(
        "spray_path_planner",
        SprayPathPlanner(
            planner=planner,
            tile=scenario.tile,
            period=period,
            strokes=None if remainder is None else remainder.strokes,
        ),
    )
    follower = add("path_follower", PathFollower(period=period))
    cycle = add(
        "paint_cycle",
        PaintCycle(
            unattended=scenario.cycle.unattended,
            period=period,
            look_time=scenario.scan.look_time,
            time_limit=scenario.cycle.time_limit,
            sequence=SEQUENCE if remainder is None else KNOWN_WALL_SEQUENCE,
        ),
    )
    # Pictures become the map, and the map the wall.
    connect = builder.Connect
    if remainder is None:
        finder, segmenter = _AddPerception(builder, scenario, accumulator)
    else:
        finder, segmenter = _AddKnownWall(builder, scenario, remainder)
    stages = dict(zip(STAGES, (mover, finder, segmenter, spray_planner), strict=True))
    connect(camera_pose.GetOutputPort("X_WC"), accumulator.GetInputPort("X_WC"))
    connect(cycle.GetOutputPort("camera_enabled"), accumulator.GetInputPort("enabled"))
    wall_port = finder.GetOutputPort("result")
    for system in (accumulator, mover):
        connect(wall_port, system.GetInputPort("wall"))
    connect(accumulator.GetOutputPort("surface_map"), mover.GetInputPort("surface_map"))
    # The wall becomes a program.
    connect(
        segmenter.GetOutputPort("result"), spray_planner.GetInputPort("segmentation")
    )
    for name, stage in stages.items():
        connect(cycle.GetOutputPort("request"), stage.GetInputPort("request"))
        connect(stage.GetOutputPort("result"), cycle.GetInputPort(name))
    # Plans begin where the arm was last told to be, not at its tracking error.
    desired_port = follower.GetOutputPort("desired_state")
    for system in (mover, spray_planner):
        connect(desired_port, system.GetInputPort("state"))
    connect(
        cycle.GetOutputPort("motion_command"), follower.GetInputPort("motion_command")
    )
    connect(follower.GetOutputPort("status"), cycle.GetInputPort("follower_status"))
    # To and from the station.
    for name, ports in {
        "arm.state_estimated": (
            camera_pose.GetInputPort("state"),
            follower.GetInputPort("state"),
        ),
        "arm.status": (cycle.GetInputPort("arm_status"),),
        "wall_camera.depth_image": (accumulator.GetInputPort("depth_image"),),
        "wall_camera.image_time": (
            accumulator.GetInputPort("image_time"),
            camera_pose.GetInputPort("image_time"),
        ),
    }.items():
        builder.ExportInput(ports[0], name)
        for port in ports[1:]:
            builder.ConnectInput(name, port)
    builder.ExportInput(cycle.GetInputPort("operator"), "operator")
    builder.ExportOutput(desired_port, "arm.desired_state")
    builder.ExportOutput(follower.GetOutputPort("trigger"), "gun.trigger")
    builder.ExportOutput(cycle.GetOutputPort("cycle_status"), "cycle_status")
    builder.ExportOutput(follower.GetOutputPort("status"), "follower_status")
    builder.ExportOutput(accumulator.GetOutputPort("surface_map"), "surface_map")
    builder.ExportOutput(wall_port, "wall")
    builder.ExportOutput(segmenter.GetOutputPort("result"), "segmentation")
    builder.ExportOutput(spray_planner.GetOutputPort("result"), "program")
    diagram = builder.Build()
    diagram.set_name("brain")
    return diagram


def _AddPerception(
    builder: DiagramBuilder, scenario: Scenario, accumulator: MapAccumulator
) -> tuple[WallFinder, WallSegmenter]:
    """Adds the stages that find and segment the wall in the map."""
    settings: dict[str, Any] = {
        "tile": TileSize(scenario.tile.width, scenario.tile.height),
        "config": scenario.segmentation,
        "seed": scenario.random_seed,
        "period": scenario.cycle.period,
    }
    finder = builder.AddNamedSystem(
        "wall_finder",
        WallFinder(
            X_WT_expected=nominal_tile_pose(scenario.tile),
            mount_limit_deg=scenario.pose_graph.mount_limit_deg,
            **settings,
        ),
    )
    segmenter = builder.AddNamedSystem("wall_segmenter", WallSegmenter(**settings))
    map_port = accumulator.GetOutputPort("surface_map")
    for system in (finder, segmenter):
        builder.Connect(map_port, system.GetInputPort("surface_map"))
    builder.Connect(finder.GetOutputPort("result"), segmenter.GetInputPort("wall"))
    return finder, segmenter


def _AddKnownWall(
    builder: DiagramBuilder, scenario: Scenario, remainder: Remainder
) -> tuple[KnownResult, KnownResult]:
    """Adds stages that answer with the wall as it was found and segmented before."""
    wall = Wall(
        X_WT=remainder.segmentation.X_WT, rms=np.nan, inlier_count=0, inlier_share=0.0
    )
    finder, segmenter = (
        builder.AddNamedSystem(
            stage, KnownResult(stage=stage, value=value, period=scenario.cycle.period)
        )
        for stage, value in (
            ("wall_finder", wall),
            ("wall_segmenter", remainder.segmentation),
        )
    )
    return finder, segmenter


@dataclasses.dataclass(frozen=True)
class PaintCycleDiagram:
    """The whole cycle.

    Attributes:
        diagram: Station and brain, connected; all their outputs are exported under
            their own names, and the brain's input `operator`.
        station: The station in it.
        brain: The brain in it.
        robot: The robot that the brain plans for.
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
) -> PaintCycleDiagram:
    """Makes the whole paint cycle of a scenario.

    Args:
        scenario: The job.
        connection: What the robot's station is connected to; None = a simulated one.
        remainder: See `MakeBrain`.
        film: What is on the wall already; simulation only. None = nothing.
        meshcat: Where to show it, or None.
    """
    builder = DiagramBuilder()
    station = builder.AddSystem(
        MakeStation(scenario, connection=connection, film=film, meshcat=meshcat)
    )
    robot = MakeRobotModel(scenario)
    brain = builder.AddSystem(MakeBrain(scenario, robot, remainder=remainder))
    for name in STATION_TO_BRAIN:
        builder.Connect(station.GetOutputPort(name), brain.GetInputPort(name))
    for name in BRAIN_TO_STATION:
        builder.Connect(brain.GetOutputPort(name), station.GetInputPort(name))
    builder.ExportInput(brain.GetInputPort("operator"), "operator")
    for system in (station, brain):
        for index in range(system.num_output_ports()):
            port = system.get_output_port(index)
            builder.ExportOutput(port, port.get_name())
    diagram = builder.Build()
    diagram.set_name("paint_cycle")
    return PaintCycleDiagram(diagram=diagram, station=station, brain=brain, robot=robot)
