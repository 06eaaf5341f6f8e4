"""The one nominal placement does the whole job, collisions included."""

import matplotlib.image
import numpy as np
import pytest
from pydrake.multibody.tree import JacobianWrtVariable

from painter.config import Scenario
from painter.planning.tile import nominal_tile_pose
from painter.robot.arm_model import GetArmKinematics, GetArmLimits, MakeArmPlant
from painter.robot.reach_mapper import ReachMapper, main


@pytest.fixture(scope="module")
def mapper():
    return ReachMapper(Scenario())


def test_the_nominal_placement_sprays_and_scans_the_whole_tile(mapper):
    reach = mapper.reach(distance=1.05, shoulder_height=1.20, step=0.05)
    assert reach.spray_share == 1.0
    assert reach.scan_share == 1.0


def test_the_raster_and_the_scan_lie_within_reach_all_over(mapper):
    """Nozzle over x 0.06..1.94, y -0.10..2.10; camera over the four rows."""
    scenario = Scenario()
    X_WT = nominal_tile_pose(scenario.tile)
    is_free = mapper.IsFreeBefore(scenario.tile.distance, 0.0)
    ahead = np.array([1.0, 0.0, 0.0])
    picture = mapper.task.footprint
    margin = scenario.scan.margin
    for solve, x, y, distance in (
        (mapper.arm.solve, (0.06, 1.94), (-0.10, 2.10), 0.30),
        (
            mapper.arm.solve_camera,
            (picture.left - margin, 2.0 + margin - picture.right),
            (picture.below - margin, 2.0 + margin - picture.above),
            0.70,
        ),
    ):
        xs, ys = np.meshgrid(np.linspace(*x, 48), np.linspace(*y, 56))
        p_TQs = np.stack([xs.ravel(), ys.ravel(), np.full(xs.size, distance)])
        q = solve((X_WT @ p_TQs).T, ahead)
        assert mapper.limits.contains(q).all()
        assert is_free(q).all()


def test_the_raster_keeps_its_speed_within_the_joint_limits(mapper):
    """Vertical strokes at 0.6 m/s with 90 % of the joints' speed, anywhere."""
    scenario = Scenario()
    X_WT = nominal_tile_pose(scenario.tile)
    xs, ys = np.meshgrid(np.linspace(0.06, 1.94, 30), np.linspace(0.0, 2.0, 40))
    p_TQs = np.stack([xs.ravel(), ys.ravel(), np.full(xs.size, 0.30)])
    q = mapper.arm.solve((X_WT @ p_TQs).T, np.array([1.0, 0.0, 0.0]))
    V_WG = np.array([0.0, 0.0, 0.0, 0.0, 0.0, scenario.raster.speed])
    # Five joints keep axis and point: the roll about the axis follows by itself and
    # is zero on a plumb wall, so least squares solve the six rows exactly.
    plant = MakeArmPlant(scenario.directives)
    context = plant.CreateDefaultContext()
    world, gun = plant.world_frame(), plant.GetFrameByName("gun_nozzle")
    for q_i in q:
        plant.SetPositions(context, q_i)
        jacobian = plant.CalcJacobianSpatialVelocity(
            context, JacobianWrtVariable.kV, gun, np.zeros(3), world, world
        )
        v, *_ = np.linalg.lstsq(jacobian, V_WG, rcond=None)
        np.testing.assert_allclose(jacobian @ v, V_WG, atol=1e-9)
        assert np.all(np.abs(v) < 0.9 * mapper.limits.v_max)


def test_the_mapper_reads_the_robot_from_its_models(mapper):
    plant = MakeArmPlant(Scenario().directives)
    assert mapper.arm.reach == GetArmKinematics(plant).reach
    np.testing.assert_array_equal(mapper.limits.q_max, GetArmLimits(plant).q_max)


@pytest.mark.slow
def test_the_command_writes_a_picture(tmp_path):
    main(["--out", str(tmp_path / "new")])
    picture = matplotlib.image.imread(tmp_path / "new" / "reach_map.png")
    assert picture.shape[1] > 1000 and np.ptp(picture) > 0.9
