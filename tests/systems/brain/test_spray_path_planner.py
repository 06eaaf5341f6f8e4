"""The stage that plans the paint program from where the arm stands."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from painter.config import Scenario
from painter.planning.config import MotionConfig, TileConfig
from painter.planning.spray_path import PaintProgram
from painter.planning.tile import nominal_tile_pose
from painter.robot.planners import MakeProgramPlanner
from painter.systems.brain.spray_path_planner import SprayPathPlanner
from painter.systems.values import StageRequest, StageResult
from perception.values import WallSegmentation

HOME = np.deg2rad(MotionConfig().home_deg)


@pytest.fixture(scope="module")
def planner():
    return SprayPathPlanner(
        planner=MakeProgramPlanner(Scenario()), tile=TileConfig(), period=0.1
    )


def segmented(shape=(200, 200)):
    mask = np.zeros(shape, dtype=bool)
    mask[60:140, 40:80] = True
    return StageResult(
        number=1,
        value=WallSegmentation(
            labels=mask.astype(np.uint16),
            depth=np.zeros(shape, dtype=np.float32),
            wall_mask=mask,
            X_WT=nominal_tile_pose(TileConfig()),
            cell=0.01,
        ),
    )


def ask(dut, segmentation, q):
    simulator = Simulator(dut)
    context = simulator.get_mutable_context()
    request = StageRequest(number=1, stage="spray_path_planner")
    dut.GetInputPort("request").FixValue(context, request)
    dut.GetInputPort("state").FixValue(context, np.concatenate([q, np.zeros(5)]))
    dut.GetInputPort("segmentation").FixValue(context, segmentation)
    simulator.AdvanceTo(0.05)  # One look at the request, at t = 0.
    return dut.GetOutputPort("result").Eval(context)


def test_program_paints_the_patch_and_leads_from_here_to_home(planner):
    start = HOME + 0.05
    result = ask(planner, segmented(), start)
    program = result.value
    assert isinstance(program, PaintProgram), result.error
    np.testing.assert_allclose(program.motion.q[[0, -1]], [start, HOME], atol=1e-9)
    ends = np.array([[stroke.start_T, stroke.end_T] for stroke in program.strokes])
    # The patch is x 0.4 to 0.8, y 0.6 to 1.4; strokes overrun it by the lead alone.
    assert ends[..., 0].min() > 0.35
    assert ends[..., 0].max() < 0.85
    assert ends[..., 1].min() == pytest.approx(0.6, abs=0.03)
    assert ends[..., 1].max() == pytest.approx(1.4, abs=0.03)


def test_no_segmentation_is_an_error_result(planner):
    assert "segmentation holds NoneType" in ask(planner, StageResult(), HOME).error


def test_segmentation_of_another_tile_is_an_error_result(planner):
    error = ask(planner, segmented((200, 150)), HOME).error
    assert "(200, 150) cells, the tile (200, 200)" in error
