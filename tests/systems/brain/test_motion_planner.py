"""The stage that plans gun-off motions: it takes the wall found, if there is one."""

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator

from painter.planning.arm.scan_camera import ScanCamera
from painter.planning.config import MotionConfig, ScanConfig, TileConfig
from painter.planning.motion.gun_path import WallIk
from painter.planning.scan.free_motion import FreeMotionPlanner
from painter.planning.spray_path import Motion
from painter.planning.tile import nominal_tile_pose
from painter.robot.arm_model import (
    GetArmKinematics,
    GetArmLimits,
    MakeArmPlant,
    MakeCollisionChecker,
)
from painter.systems.brain.motion_planner import MotionPlanner
from painter.systems.values import StageRequest, StageResult
from perception.config import StereoConfig
from perception.values import SurfaceMap, Wall

DIRECTIVES = "package://painter_models/painter_cell.dmd.yaml"
HOME = np.deg2rad(MotionConfig().home_deg)


def make_planner(**tile):
    plant = MakeArmPlant(DIRECTIVES)
    kinematics = GetArmKinematics(plant)
    planner = FreeMotionPlanner(
        kinematics=kinematics,
        limits=GetArmLimits(plant),
        checker=MakeCollisionChecker(DIRECTIVES, clearance=0.04),
        tile=TileConfig(**tile),
        scan=ScanConfig(),
        motion=MotionConfig(),
        camera=ScanCamera.mounted(StereoConfig(), kinematics.X_LC),
    )
    return MotionPlanner(planner=planner, period=0.1)


@pytest.fixture(scope="module")
def planner():
    return make_planner()


def ask(dut, goal, *, wall=None, q=HOME, stage="motion_planner", points=None):
    """The stage's answer to one request."""
    simulator = Simulator(dut)
    context = simulator.get_mutable_context()
    request = StageRequest(number=1, stage=stage, goal=goal)
    dut.GetInputPort("request").FixValue(context, request)
    dut.GetInputPort("state").FixValue(context, np.concatenate([q, np.zeros(5)]))
    dut.GetInputPort("wall").FixValue(context, wall or StageResult())
    if points is not None:
        surface_map = SurfaceMap.empty().replace(p_WQs=points)
        dut.GetInputPort("surface_map").FixValue(context, Value(surface_map))
    simulator.AdvanceTo(0.05)  # One look at the request, at t = 0.
    return dut.GetOutputPort("result").Eval(context)


def test_home_leads_from_the_state_to_home(planner):
    start = HOME + 0.1
    result = ask(planner, "home", q=start)
    assert isinstance(result.value, Motion), result.error
    np.testing.assert_allclose(result.value.q[[0, -1]], [start, HOME], atol=1e-9)


def test_scan_follows_the_wall_found(planner):
    shift = RigidTransform([0.03, 0.0, 0.0])
    X_WT = shift @ nominal_tile_pose(TileConfig())
    found = Wall(X_WT=X_WT, rms=0.002, inlier_count=1000, inlier_share=0.9)
    camera_x = []
    for wall in (None, StageResult(number=1, value=found)):
        motion = ask(planner, "scan", wall=wall).value
        _, p_WCs = GetArmKinematics(MakeArmPlant(DIRECTIVES)).camera_poses(motion.q)
        camera_x.append(np.median(p_WCs[:, 0]))  # Most of the time on rows.
    np.testing.assert_allclose(camera_x, [1.05 - 0.7, 1.08 - 0.7], atol=1e-3)


def test_more_looks_go_to_what_the_map_lacks_beside_a_box(planner):
    x, y = np.meshgrid(np.arange(0.0025, 2.0, 0.005), np.arange(0.0025, 2.0, 0.005))
    box = (abs(x - 0.3) < 0.1) & (abs(y - 1.0) < 0.1)
    shadow = (x > 0.13) & (x < 0.2) & (abs(y - 1.0) < 0.1)
    X_WT = nominal_tile_pose(TileConfig())
    ik = WallIk(GetArmKinematics(MakeArmPlant(DIRECTIVES)), X_WT)
    (q,) = ik.inverse_kinematics(np.array([[1.4, 0.4, 0.5]]))
    ends = []
    for gap in (shadow, np.zeros_like(shadow)):
        p_TQs = np.stack([x, y, np.where(box, 0.1, 0.0)])[:, ~gap]
        result = ask(planner, "more looks", q=q, points=X_WT @ p_TQs)
        assert result.error is None
        ends.append(result.value)
    assert ends[1] is None
    # The camera comes to the box's left: W y grows to the left from the tile's middle.
    _, p_WCs = ik.kinematics.camera_poses(ends[0].q[-1:])
    assert p_WCs[0, 1] > 1.0 - 0.2


def test_tile_out_of_reach_is_an_error_result_that_says_so():
    result = ask(make_planner(width=3.0), "look")
    assert result.value is None
    assert result.error.startswith("ReachError: tile of 3.00 x 2.00 m")


def test_unknown_goal_is_an_error_result(planner):
    assert "retract, more looks, got 'dance'" in ask(planner, "dance").error


def test_requests_to_others_are_left_alone(planner):
    assert ask(planner, "home", stage="wall_finder").number == 0


def test_settings_are_checked():
    with pytest.raises(ValueError, match=r"tile\.width"):
        make_planner(width=-1.0)
