"""The cycle's gun-off motions end where they should and keep off the unknown wall."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw

from painter.errors import CollisionError, ReachError
from painter.planning.config import MotionConfig, ScanConfig, TileConfig
from painter.planning.scan.free_motion import FreeMotionPlanner
from painter.planning.tile import nominal_tile_pose

MOTION = MotionConfig()
HOME = np.deg2rad(MOTION.home_deg)
# Where the models put the arm when the cell is switched on.
FOLDED = np.array([0.0, -1.9, 2.6, -0.7, 0.0])


def plan(robot, goal, q0, *, tile=None, X_WT=None):
    tile = tile or TileConfig()
    planner = FreeMotionPlanner(
        **vars(robot),
        tile=tile,
        scan=ScanConfig(),
        motion=MOTION,
        camera=robot.camera(),
        standoff=0.3,
    )
    return planner.plan(goal, q0, X_WT or nominal_tile_pose(tile))


@pytest.mark.parametrize(
    ("goal", "longest"), [("home", 5.0), ("look", 12.0), ("scan", 25.0)]
)
def test_motion_is_quick_sprays_nothing_and_keeps_off_the_wall(robot, goal, longest):
    motion = plan(robot, goal, FOLDED)
    assert motion.duration <= longest
    assert len(motion.spray_on) == 0
    np.testing.assert_allclose(motion.q[0], FOLDED)
    _, p_WGs = robot.kinematics.gun_poses(motion.q)
    assert p_WGs[:, 0].max() <= 1.05 - MOTION.wall_keepout - MOTION.clearance
    if goal == "home":
        np.testing.assert_allclose(motion.q[-1], HOME)
    if goal == "look":
        _, p_WCs = robot.kinematics.camera_poses(motion.q[-1:])
        assert p_WCs[0, 0] == pytest.approx(1.05 - ScanConfig().look_distance)


@pytest.mark.parametrize("place", [(0.1, 0.05), (1.9, 1.95), (1.0, 1.0)])
def test_retract_leads_home_from_before_the_wall(robot, place):
    (q0,) = robot.transitions().ik.inverse_kinematics(np.array([[*place, 0.3]]))
    motion = plan(robot, "retract", q0)
    np.testing.assert_allclose(motion.q[[0, -1]], [q0, HOME], atol=1e-9)


@pytest.mark.parametrize("shift", [-0.02, 0.0, 0.05])
def test_scan_copes_with_a_wall_off_its_place(robot, shift):
    tilt = RigidTransform(RollPitchYaw(0.01, -0.01, 0.03), [shift, 0.02, 0.0])
    X_WT = tilt @ nominal_tile_pose(TileConfig())
    assert plan(robot, "scan", HOME, X_WT=X_WT).duration < 28.0


def test_tile_larger_than_reach_ends_the_job_at_first_sight(robot):
    with pytest.raises(ReachError, match=r"tile of 3.00 x 2.00 m: \d+ % .* has 1.57 m"):
        plan(robot, "look", HOME, tile=TileConfig(width=3.0))


def test_arm_inside_the_wall_is_a_collision(robot):
    (q0,) = robot.transitions().ik.inverse_kinematics(np.array([[1.0, 1.0, 0.01]]))
    with pytest.raises(CollisionError, match="starts in collision: gun"):
        plan(robot, "retract", q0)


def test_unknown_goal_is_refused(robot):
    with pytest.raises(ValueError, match="home, look, scan, retract"):
        plan(robot, "dance", HOME)
