"""All named scenes and twenty random ones are planned, from their truth."""

import numpy as np
import pytest

from painter.config import load_scenario
from painter.cycle.true_wall import true_segmentation
from painter.planning.tile import nominal_tile_pose
from painter.robot.planners import MakeFreeMotionPlanner, MakeProgramPlanner
from painter.robot.robot_model import MakeRobotModel

NAMED = [(name, 1) for name in ("blank", "cubes", "obstacles", "room", "terrace")]
RANDOM = [("random", seed) for seed in range(1, 21)]

pytestmark = [pytest.mark.slow, pytest.mark.timeout(1800)]


@pytest.fixture(scope="module")
def planner():
    return MakeProgramPlanner(load_scenario("blank"))


@pytest.fixture(scope="module")
def robot():
    return MakeRobotModel(load_scenario("blank"))


@pytest.mark.parametrize(("name", "seed"), NAMED + RANDOM)
def test_program_is_whole_and_passes_its_verification(planner, robot, name, seed):
    job = load_scenario(name, [f"random_seed={seed}"])
    wall = true_segmentation(job)
    # A map's edges are off by a cell and its heights by millimetres.
    rng = np.random.default_rng(seed)
    noise = rng.normal(0.0, 0.002, wall.depth.shape).astype(np.float32)
    wall = wall.replace(depth=np.asarray(wall.depth) + noise)
    q = np.deg2rad(job.motion.home_deg)
    for goal, X_WT in (("look", nominal_tile_pose(job.tile)), ("scan", wall.X_WT)):
        q = MakeFreeMotionPlanner(job, robot).plan(goal, q, X_WT).q[-1]
    # Raises if a limit, a clearance, a stand-off or an angle is not kept.
    program = planner.program(planner.strokes(wall), wall, q)
    left_out = sum(item.stroke.length for item in program.skipped)
    assert left_out < 0.05 * sum(stroke.length for stroke in program.strokes)
