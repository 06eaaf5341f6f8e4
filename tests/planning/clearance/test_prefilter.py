"""What the prefilter passes is clear, and it passes most of what is clear."""

import numpy as np
import pytest
from pydrake.common import Parallelism
from pydrake.geometry import Box, Sphere
from pydrake.math import RigidTransform, RollPitchYaw

from painter.planning.clearance.prefilter import SeparatingAxisPrefilter
from painter.planning.config import TileConfig
from painter.planning.tile import nominal_tile_pose

CLEARANCE = 0.01
X_WT = nominal_tile_pose(TileConfig())


def checker_with(robot, *boxes):
    """The cell with boxes (shape, pose in W) added."""
    checker = robot.checker.Clone()
    checker.SetPaddingAllRobotEnvironmentPairs(CLEARANCE)
    world = checker.plant().world_body()
    for number, (box, X_WB) in enumerate(boxes):
        assert checker.AddCollisionShapeToBody(f"box {number}", world, box, X_WB)
    return checker


def free(checker, q):
    """What Drake's own distances say."""
    answers = checker.CheckConfigsCollisionFree(list(q), Parallelism(False))
    return np.array(answers, dtype=bool)


@pytest.mark.parametrize("tilt", [0.0, 0.1])
def test_nothing_that_drake_finds_blocked_passes(robot, tilt):
    rng = np.random.default_rng(4)
    X_WS = X_WT @ RigidTransform(RollPitchYaw(tilt, 0.5 * tilt, -tilt), np.zeros(3))
    places = rng.uniform((0.0, 0.0, 0.0), (1.5, 1.5, 0.3), (6, 3))
    boxes = [
        (Box(rng.uniform(0.05, 0.5, 3)), X_WS @ RigidTransform(place))
        for place in places
    ]
    checker = checker_with(robot, *boxes)
    limits = robot.limits
    q = rng.uniform(limits.q_min, limits.q_max, (4000, 5))
    is_free = free(checker, q)
    assert 0.1 < is_free.mean() < 0.9
    passed = SeparatingAxisPrefilter(checker, X_WS).passes(q, CLEARANCE)
    assert not (passed & ~is_free).any()
    # Fewer arms folded at random pass than arms at work.
    assert (passed & is_free).sum() > 0.2 * is_free.sum()


def test_gun_before_the_wall_passes_nearly_everywhere(robot):
    x, y = np.meshgrid(np.linspace(0.1, 1.9, 19), np.linspace(0.1, 1.9, 19))
    places = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, 0.3)])
    q = robot.transitions().ik.inverse_kinematics(places)
    wall = (Box(4.0, 4.0, 0.1), X_WT @ RigidTransform([1.0, 1.0, -0.05]))
    checker = checker_with(robot, wall)
    assert free(checker, q).all()
    assert SeparatingAxisPrefilter(checker, X_WT).passes(q, CLEARANCE).mean() > 0.95


@pytest.mark.parametrize(("clearance", "passed"), [(0.0495, True), (0.0505, False)])
def test_bound_is_the_gap_before_the_nozzle(robot, clearance, passed):
    """A box 5 cm before a gun that is square to its face."""
    q = robot.transitions().ik.inverse_kinematics(np.array([[1.0, 1.0, 0.3]]))
    box = (Box(0.2, 0.2, 0.1), X_WT @ RigidTransform([1.0, 1.0, 0.2]))
    dut = SeparatingAxisPrefilter(checker_with(robot, box), X_WT)
    assert dut.passes(q, clearance).tolist() == [passed]


def test_configurations_out_of_reach_and_none_are_left_open(robot):
    dut = SeparatingAxisPrefilter(robot.checker, X_WT)
    assert dut.passes(np.full((1, 5), np.nan), CLEARANCE).tolist() == [False]
    assert dut.passes(np.zeros((0, 5)), CLEARANCE).tolist() == []


def test_shape_of_unknown_projection_is_refused(robot):
    checker = checker_with(robot, (Sphere(0.1), RigidTransform([2.0, 0.0, 1.0])))
    with pytest.raises(TypeError, match="Box or a Cylinder, got Sphere"):
        SeparatingAxisPrefilter(checker, X_WT)
