"""The wall among planes, and the tile laid on it."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix

from perception.config import SegmentationConfig
from perception.errors import AmbiguousWallError, NoWallError
from perception.paper_steps.wall import find_wall
from perception.synthetic.patch_wall import synthetic_wall
from perception.values import TileSize

TILE = TileSize(2.0, 2.0)
# A plumb wall across W x, 1.05 m ahead: T x = -W y, T y = W z, T z = -W x.
X_WT_NOMINAL = RigidTransform(
    RotationMatrix(np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])),
    [1.05, 1.0, 0.2],
)


def find(points, *, config=None, seed=1):
    """Looks for the wall near the nominal pose."""
    config = config or SegmentationConfig()
    return find_wall(points, X_WT_NOMINAL, TILE, config=config, seed=seed)


def wall_points(X_TS=None, *, patches=(), seed=0):
    """Cloud of a wall that stands at X_TS from where it is expected."""
    X_WS = X_WT_NOMINAL if X_TS is None else X_WT_NOMINAL @ X_TS
    rng = np.random.default_rng(seed)
    return synthetic_wall(patches, spacing=0.02, X_WT=X_WS, rng=rng)


def test_wall_at_its_place_gives_the_expected_tile():
    points = wall_points()
    wall = find(points)
    np.testing.assert_allclose(
        wall.X_WT.GetAsMatrix4(), X_WT_NOMINAL.GetAsMatrix4(), atol=5e-4
    )
    # Of 14400 points the standard error of their rms is 0.6 %.
    assert wall.rms == pytest.approx(0.0015, rel=0.03)
    assert wall.inlier_count == points.shape[1]
    assert wall.inlier_share == 1.0


@pytest.mark.parametrize("angles_deg", [(0, 0, 0), (5, 0, 0), (0, 4, 0), (-3, 6, 2)])
def test_tile_stays_on_the_expected_centre_line(angles_deg):
    # Turned about the tile's centre and moved 6 cm along its normal.
    centre = RigidTransform([1.0, 1.0, 0.0])
    turn = RigidTransform(RollPitchYaw(np.radians(angles_deg)), [0.0, 0.0, 0.06])
    wall = find(wall_points(centre @ turn @ centre.inverse()))
    X_TS = X_WT_NOMINAL.inverse() @ wall.X_WT
    np.testing.assert_allclose(X_TS @ [1.0, 1.0, 0.0], [1.0, 1.0, 0.06], atol=5e-4)
    normal = X_TS.rotation().col(2)
    np.testing.assert_allclose(normal, turn.rotation().col(2), atol=1e-3)
    # T y is the expected y without its part along the normal; T x closes the frame.
    upward = np.array([0.0, 1.0, 0.0]) - normal[1] * normal
    upward /= np.linalg.norm(upward)
    np.testing.assert_allclose(X_TS.rotation().col(1), upward, atol=1e-9)


def test_larger_plane_far_behind_is_not_the_wall():
    near = wall_points()
    far = wall_points(RigidTransform([0.0, 0.0, -0.8]), seed=1)
    points = np.concatenate([near[:, ::3], far], axis=1)
    wall = find(points)
    assert wall.X_WT.translation()[0] == pytest.approx(1.05, abs=1e-3)


def test_wall_too_far_off_is_named_with_its_distance():
    with pytest.raises(NoWallError, match=r"0\.300 m behind .* turned 0\.\d deg"):
        find(wall_points(RigidTransform([0.0, 0.0, -0.3])))


def test_wall_turned_too_far_is_named_with_its_angle():
    turned = RigidTransform(RollPitchYaw(0.0, np.radians(25.0), 0.0), np.zeros(3))
    centre = RigidTransform([1.0, 1.0, 0.0])
    with pytest.raises(NoWallError, match=r"turned 25\.\d deg"):
        find(wall_points(centre @ turned @ centre.inverse()))


def test_plane_of_few_points_is_no_wall():
    points = np.concatenate(
        [
            wall_points()[:, :500],
            wall_points(RigidTransform([0.0, 0.0, -1.0])),
        ],
        axis=1,
    )
    with pytest.raises(NoWallError, match="10% or more"):
        find(points)


@pytest.mark.parametrize(
    ("points", "message"),
    [
        (np.zeros((3, 0)), "0 finite points of 0"),
        (np.full((3, 500), np.nan), "0 finite points of 500"),
        (np.zeros((3, 99)), "99 finite points of 99"),
        (np.outer([1.0, 0.5, 0.2], np.linspace(0, 1, 500)), "no plane among 500"),
    ],
)
def test_unusable_clouds_are_refused_with_numbers(points, message):
    with pytest.raises(NoWallError, match=message):
        find(points)


def test_same_seed_same_wall():
    points = wall_points()
    one, other = find(points, seed=3), find(points, seed=3)
    np.testing.assert_array_equal(one.X_WT.GetAsMatrix4(), other.X_WT.GetAsMatrix4())


def test_steps_on_a_wall_do_not_make_a_wall_aslant():
    """Wall, a low box, a higher one: within 3 cm one plane aslant holds them all."""
    rng = np.random.default_rng(4)
    p_TQs = rng.uniform(0.0, 2.0, (3, 30000))
    x = p_TQs[0]
    p_TQs[2] = np.select([x < 1.1, x < 1.6], [0.0, 0.05], 0.10)
    p_TQs[2] += rng.normal(0.0, 0.001, x.size)
    wall = find(X_WT_NOMINAL @ p_TQs)
    X_found = X_WT_NOMINAL.inverse() @ wall.X_WT
    # The fit of the wall's strip, 1.1 m wide, is far better than a tenth of a degree.
    tilt = np.degrees(np.arccos(X_found.rotation().matrix()[2, 2]))
    assert tilt < 0.1
    assert abs(X_found.translation()[2]) < 0.001


def test_two_walls_side_by_side_10_cm_apart_are_ambiguous():
    left = wall_points(RigidTransform([0.0, 0.0, 0.05]))
    right = wall_points(RigidTransform([0.0, 0.0, -0.05]), seed=1)
    x = (X_WT_NOMINAL.inverse() @ left)[0]
    x_right = (X_WT_NOMINAL.inverse() @ right)[0]
    points = np.concatenate([left[:, x < 1.0], right[:, x_right >= 1.0]], axis=1)
    with pytest.raises(AmbiguousWallError, match=r"0\.100 m apart"):
        find(points)


def test_floor_larger_than_the_wall_is_not_the_wall():
    rng = np.random.default_rng(2)
    floor = rng.uniform([-2.0, -3.0, -0.002], [1.0, 3.0, 0.002], (60000, 3)).T
    points = np.concatenate([wall_points(), floor], axis=1)
    up_W = np.array([0.0, 0.0, 1.0])
    wall = find_wall(
        points, X_WT_NOMINAL, TILE, config=SegmentationConfig(), seed=1, up_W=up_W
    )
    assert wall.X_WT.translation()[0] == pytest.approx(1.05, abs=1e-3)
    with pytest.raises(NoWallError, match="level, as floors are"):
        find_wall(
            floor, X_WT_NOMINAL, TILE, config=SegmentationConfig(), seed=1, up_W=up_W
        )
