"""The brain: mapping, segmentation, planning and the sequence of the cycle."""

from typing import TypedDict, Unpack

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.systems.framework import Diagram, DiagramBuilder, LeafSystem

from painter.config import Scenario
from painter.planning.program.remainder import Remainder
from painter.planning.tile import nominal_tile_pose
from painter.robot.planners import MakeFreeMotionPlanner, MakeProgramPlanner
from painter.robot.robot_model import RobotModel
from painter.systems.brain.camera_pose import CameraPose
from painter.systems.brain.known_result import KnownResult
from painter.systems.brain.map_accumulator import ACCUMULATOR_INPUTS, MapAccumulator
from painter.systems.brain.motion_planner import MotionPlanner
from painter.systems.brain.paint_cycle import PaintCycle
from painter.systems.brain.path_follower import PathFollower
from painter.systems.brain.spray_path_planner import SprayPathPlanner
from painter.systems.brain.wall_finder import WallFinder
from painter.systems.brain.wall_segmenter import WallSegmenter
from painter.systems.cycle_state import KNOWN_WALL_SEQUENCE, SEQUENCE
from painter.systems.ports import CheckPorts
from painter.systems.stage import STAGES
from painter.systems.values import StageRequest, StageResult
from perception.depth_camera.depth import CameraIntrinsics
from perception.values import SurfaceMap, TileSize, Wall

# Inputs of the brain, by the input ports that read them.
INPUTS = {
    "arm.state_estimated": ("camera_pose.state", "path_follower.state"),
    "arm.status": ("paint_cycle.arm_status",),
    "wall_camera.depth_image": ("map_accumulator.depth_image",),
    "wall_camera.image_time": ("map_accumulator.image_time", "camera_pose.image_time"),
    "operator": ("paint_cycle.operator",),
}
# Outputs of the brain, and which output port each is.
OUTPUTS = {
    "arm.desired_state": "path_follower.desired_state",
    "gun.trigger": "path_follower.trigger",
    "cycle_status": "paint_cycle.cycle_status",
    "follower_status": "path_follower.status",
    "surface_map": "map_accumulator.surface_map",
    "wall": "wall_finder.result",
    "segmentation": "wall_segmenter.result",
    "program": "spray_path_planner.result",
}
CONNECTIONS = (
    # Pictures become the map, the map the wall, the wall a program.
    ("camera_pose.X_WC", "map_accumulator.X_WC"),
    ("paint_cycle.camera_enabled", "map_accumulator.enabled"),
    ("wall_finder.result", "map_accumulator.wall"),
    ("map_accumulator.surface_map", "wall_finder.surface_map"),
    ("map_accumulator.surface_map", "wall_segmenter.surface_map"),
    ("wall_finder.result", "wall_segmenter.wall"),
    ("wall_segmenter.result", "spray_path_planner.segmentation"),
    ("map_accumulator.surface_map", "motion_planner.surface_map"),
    ("wall_finder.result", "motion_planner.wall"),
    # Motions begin at the last commanded state, without its tracking error.
    ("path_follower.desired_state", "motion_planner.state"),
    ("path_follower.desired_state", "spray_path_planner.state"),
    ("paint_cycle.motion_command", "path_follower.motion_command"),
    ("path_follower.status", "paint_cycle.follower_status"),
    *((f"{stage}.result", f"paint_cycle.{stage}") for stage in STAGES),
    *(("paint_cycle.request", f"{stage}.request") for stage in STAGES),
)
# A camera may be silent for up to 3 s before it counts as missing, s.
JOINT_HISTORY = 4.0


class OwnSystems(TypedDict, total=False):
    """Systems of one's own in place of the brain's.

    Any LeafSystem with the ports of the system that it replaces may be given, derived
    from `painter.systems.stage.Stage` or not.

    Attributes:
        finder: Replaces the WallFinder.
        segmenter: Replaces the WallSegmenter.
        planner: Replaces the SprayPathPlanner.
        mover: Replaces the MotionPlanner.
        accumulator: Replaces the MapAccumulator.
    """

    finder: LeafSystem
    segmenter: LeafSystem
    planner: LeafSystem
    mover: LeafSystem
    accumulator: LeafSystem


REPLACED = {
    "finder": "wall_finder",
    "segmenter": "wall_segmenter",
    "planner": "spray_path_planner",
    "mover": "motion_planner",
    "accumulator": "map_accumulator",
}


def MakeBrain(
    scenario: Scenario,
    robot: RobotModel,
    *,
    remainder: Remainder | None = None,
    **own: Unpack[OwnSystems],
) -> Diagram:
    """Makes the brain, the same on both bodies.

    Args:
        scenario: The job.
        robot: The job's robot.
        remainder: Strokes left to paint on a wall known from an earlier run; None =
            scan the wall and paint all of it.
        own: See `OwnSystems`.

    Returns:
        A diagram with the inputs INPUTS and the outputs OUTPUTS. `operator`
        (OperatorCommand) may be left unconnected.

    Raises:
        PortTypeError: A given system has other ports than the one that it replaces.
        TypeError: A keyword is unknown.
        ValueError: With a `remainder` wall and strokes are known: no finder, segmenter
            or planner may be given.
    """
    if remainder is not None and own.keys() & {"finder", "segmenter", "planner"}:
        raise ValueError(
            "remainder: wall and strokes are known; give no finder, segmenter, planner."
        )
    systems = {
        "camera_pose": _MakeCameraPose(scenario, robot),
        "map_accumulator": _MakeAccumulator(scenario),
        "path_follower": PathFollower(period=scenario.cycle.period),
        "paint_cycle": PaintCycle(
            unattended=scenario.cycle.unattended,
            period=scenario.cycle.period,
            look_time=scenario.scan.look_time,
            time_limit=scenario.cycle.time_limit,
            sequence=SEQUENCE if remainder is None else KNOWN_WALL_SEQUENCE,
        ),
    } | _MakeStages(scenario, robot, remainder)
    unknown = own.keys() - REPLACED.keys()
    if unknown:
        raise TypeError(f"{', '.join(unknown)}: replace {', '.join(REPLACED)} alone.")
    for keyword, system in own.items():
        name = REPLACED[keyword]
        _CheckOwn(name, system)
        systems[name] = system
    diagram = _Connect(systems)
    diagram.set_name("brain")
    return diagram


def _MakeCameraPose(scenario: Scenario, robot: RobotModel) -> CameraPose:
    camera = scenario.wall_camera
    return CameraPose(
        kinematics=robot.kinematics,
        length=JOINT_HISTORY,
        X_NC=RigidTransform(
            RollPitchYaw(np.deg2rad(camera.calibrated_deg)), camera.calibrated_m
        ),
    )


def _MakeAccumulator(scenario: Scenario) -> MapAccumulator:
    return MapAccumulator(
        config=scenario.map,
        pose_graph=scenario.pose_graph,
        intrinsics=CameraIntrinsics.from_stereo(scenario.wall_camera.stereo),
        tile=scenario.tile,
        X_WT=nominal_tile_pose(scenario.tile),
        period=1.0 / scenario.wall_camera.rate,
    )


def _MakeStages(
    scenario: Scenario, robot: RobotModel, remainder: Remainder | None
) -> dict[str, LeafSystem]:
    """Makes the four stages; those of a known wall answer from before."""
    period = scenario.cycle.period
    stages: dict[str, LeafSystem] = {
        "motion_planner": MotionPlanner(
            planner=MakeFreeMotionPlanner(scenario, robot),
            cell=scenario.segmentation.cell,
            period=period,
        ),
        "spray_path_planner": SprayPathPlanner(
            planner=MakeProgramPlanner(scenario, robot),
            tile=scenario.tile,
            period=period,
            strokes=None if remainder is None else remainder.strokes,
        ),
    }
    if remainder is not None:
        segmentation = remainder.segmentation
        wall = Wall(
            X_WT=segmentation.X_WT, rms=np.nan, inlier_count=0, inlier_share=0.0
        )
        for name, value in (("wall_finder", wall), ("wall_segmenter", segmentation)):
            stages[name] = KnownResult(stage=name, value=value, period=period)
        return stages
    tile = TileSize(scenario.tile.width, scenario.tile.height)
    stages["wall_finder"] = WallFinder(
        X_WT_expected=nominal_tile_pose(scenario.tile),
        tile=tile,
        config=scenario.segmentation,
        seed=scenario.random_seed,
        period=period,
        mount_limit_deg=scenario.pose_graph.mount_limit_deg,
    )
    stages["wall_segmenter"] = WallSegmenter(
        tile=tile,
        config=scenario.segmentation,
        seed=scenario.random_seed,
        period=period,
    )
    return stages


def _CheckOwn(name: str, own: LeafSystem) -> None:
    """Checks the ports of a system that replaces one of the brain's own."""
    if name in STAGES:
        inputs = {"request": StageRequest(), **STAGES[name].inputs}
        CheckPorts(name, own, inputs, {"result": StageResult()})
    else:
        outputs = {"surface_map": SurfaceMap.empty()}
        CheckPorts(name, own, ACCUMULATOR_INPUTS, outputs)


def _Connect(systems: dict[str, LeafSystem]) -> Diagram:
    """Adds the systems under their names, connects them and exports the ports."""
    builder = DiagramBuilder()
    for name, system in systems.items():
        builder.AddNamedSystem(name, system)

    def split(name: str) -> tuple[LeafSystem, str]:
        system, _, port = name.partition(".")
        return systems[system], port

    for source, target in CONNECTIONS:
        system, port = split(target)
        if isinstance(system, KnownResult) and port != "request":
            continue  # It reads nothing else.
        sender, output = split(source)
        builder.Connect(sender.GetOutputPort(output), system.GetInputPort(port))
    for name, readers in INPUTS.items():
        for index, reader in enumerate(readers):
            system, port = split(reader)
            if index == 0:
                builder.ExportInput(system.GetInputPort(port), name)
            else:
                builder.ConnectInput(name, system.GetInputPort(port))
    for name, source in OUTPUTS.items():
        system, port = split(source)
        builder.ExportOutput(system.GetOutputPort(port), name)
    return builder.Build()
