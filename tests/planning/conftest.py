"""The robot of the models, and walls to plan for."""

import dataclasses

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.planning import CollisionChecker

from painter.planning.arm.kinematics import ArmKinematics, ArmLimits
from painter.planning.arm.scan_camera import ScanCamera
from painter.planning.clearance.obstacles import ClearSpace, ObstacleBox, wall_box
from painter.planning.config import MotionConfig, RasterConfig, TileConfig, TipConfig
from painter.planning.motion.gun_path import WallIk
from painter.planning.motion.joint_motion import planning_limits
from painter.planning.motion.transitions import TransitionPlanner
from painter.planning.program.program import ProgramPlanner
from painter.planning.scan.camera_poses import CameraPoses
from painter.planning.tile import nominal_tile_pose
from painter.robot.arm_model import (
    GetArmKinematics,
    GetArmLimits,
    MakeArmPlant,
    MakeCollisionChecker,
)
from perception.config import StereoConfig
from perception.values import WallSegmentation
from tests.cameras import MOUNTS, write_cell

DIRECTIVES = "package://painter_models/painter_cell.dmd.yaml"


@dataclasses.dataclass(frozen=True)
class Robot:
    """What planning knows of the robot."""

    kinematics: ArmKinematics
    limits: ArmLimits
    checker: CollisionChecker

    def planner(self, **settings) -> ProgramPlanner:
        """A planner of programs with the default settings but for those given."""
        defaults = {
            "tip": TipConfig(),
            "raster": RasterConfig(),
            "motion": MotionConfig(),
        }
        return ProgramPlanner(**(vars(self) | defaults | settings))

    def camera(self, stereo: StereoConfig | None = None) -> ScanCamera:
        """The camera on the tool, by default the default one."""
        return ScanCamera.mounted(stereo or StereoConfig(), self.kinematics.X_LC)

    def camera_poses(self, *boxes: ObstacleBox, **settings) -> CameraPoses:
        """Camera poses before the expected wall, with `boxes` on it."""
        stereo = settings.pop("stereo", None)
        return CameraPoses(self.camera(stereo), self.transitions(*boxes, **settings))

    def transitions(
        self, *boxes: ObstacleBox, X_WT: RigidTransform | None = None
    ) -> TransitionPlanner:
        """A transition planner before the expected wall, with `boxes` on it."""
        motion = MotionConfig()
        X_WT = X_WT or nominal_tile_pose(TileConfig())
        return TransitionPlanner(
            ik=WallIk(self.kinematics, X_WT),
            limits=planning_limits(self.limits, motion.limit_share),
            space=ClearSpace(
                self.checker,
                X_WT=X_WT,
                boxes=[wall_box(2.0, 2.0), *boxes],
                clearance=motion.clearance,
                floor_clearance=motion.floor_clearance,
            ),
            q_home=np.deg2rad(motion.home_deg),
        )


def make_robot(directives: str = DIRECTIVES) -> Robot:
    plant = MakeArmPlant(directives)
    return Robot(
        kinematics=GetArmKinematics(plant),
        limits=GetArmLimits(plant),
        checker=MakeCollisionChecker(directives, clearance=0.04),
    )


@pytest.fixture(scope="session")
def robot() -> Robot:
    return make_robot()


@pytest.fixture(scope="session", params=MOUNTS)
def robot_of_each_mount(request, tmp_path_factory) -> Robot:
    """The robot with its camera level and turned by a quarter either way."""
    return make_robot(write_cell(tmp_path_factory.mktemp("cell"), request.param))


@pytest.fixture
def make_wall():
    """Makes segmentations of the expected 2 x 2 m tile, 1 cm cells."""

    def make(*patches: tuple[slice, slice, float], X_WT=None) -> WallSegmentation:
        """`patches` are (rows, columns, depth in m): cells that are not wall."""
        mask = np.ones((200, 200), dtype=bool)
        depth = np.zeros((200, 200), dtype=np.float32)
        for rows, columns, height in patches:
            mask[rows, columns] = False
            depth[rows, columns] = height
        return WallSegmentation(
            labels=np.where(mask, 1, 2).astype(np.uint16),
            depth=depth,
            wall_mask=mask,
            X_WT=X_WT or nominal_tile_pose(TileConfig()),
            cell=0.01,
        )

    return make
