"""The tile on a recorded wall: which side, which size, which cells."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix

from perception.config import SegmentationConfig
from perception.errors import NoWallError
from perception.paper_steps.planes import Plane
from perception.recorded.recorded_tile import (
    ViewSource,
    fitting_cell,
    robust_extent,
    side_of_view,
)
from perception.recorded.segment_recorded import segment_recorded
from perception.synthetic.patch_wall import Patch, synthetic_wall

UP_Z = np.array([0.0, 0.0, 1.0])
# A wall across x at x = 1.5, seen from smaller x.
X_WALL = RigidTransform(
    RotationMatrix(np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])),
    [1.5, 1.0, -1.0],
)


def wall(*patches, spacing=0.02):
    rng = np.random.default_rng(0)
    return synthetic_wall(patches, spacing=spacing, margin=0.0, X_WT=X_WALL, rng=rng)


def segment(points, **options):
    config = options.pop("config", SegmentationConfig(cell=0.04))
    return segment_recorded(points, config=config, seed=1, up_W=UP_Z, **options)


def test_viewpoint_tells_front_from_back():
    # A box before the wall as seen from the origin is a recess from the other side.
    box = Patch(0.2, 0.3, 0.7, 1.2, 0.1)
    front = segment(wall(box), p_WC=np.zeros(3))
    back = segment(wall(box), p_WC=np.array([5.0, 0.0, 0.0]))
    for found, sign in ((front, -1.0), (back, 1.0)):
        assert found.side.source is ViewSource.GIVEN
        normal = found.stages.segmentation.X_WT.rotation().matrix()[:, 2]
        np.testing.assert_allclose(normal, [sign, 0.0, 0.0], atol=1e-3)
    depth = back.stages.segmentation.depth
    assert np.nanmin(depth) == pytest.approx(-0.1, abs=0.01)


@pytest.mark.parametrize("east", [-400.0, 400.0])
def test_far_origin_is_no_sensor(east):
    # A window 15 cm behind the wall; from x = -400 m the origin is behind it.
    window = Patch(0.5, 0.6, 1.4, 1.5, -0.15)
    points = wall(window) + np.array([[east], [20.0], [5.0]])
    found = segment(points)
    assert found.side.source is ViewSource.RECESSES
    np.testing.assert_allclose(found.side.normal_W, [-1.0, 0.0, 0.0], atol=1e-3)


def test_near_origin_is_the_sensor():
    plane = Plane(normal=np.array([1.0, 0, 0]), offset=1.5, rms=0.0, count=3)
    side = side_of_view(plane, wall(), limit=0.03, p_WC=None)
    assert side.source is ViewSource.ORIGIN
    np.testing.assert_array_equal(side.normal_W, [-1.0, 0.0, 0.0])


def test_cell_follows_the_largest_spacing():
    x, y = np.meshgrid(np.arange(0, 2, 0.004), np.arange(0, 2, 0.004))
    dense = np.stack([x.ravel(), y.ravel()])
    assert fitting_cell(dense, least=0.01) == 0.01
    x, y = np.meshgrid(np.arange(0, 2, 0.04), np.arange(0, 2, 0.04))
    assert fitting_cell(np.stack([x.ravel(), y.ravel()]), least=0.01) == 0.04
    # Scan lines 5 cm apart, 3 mm along the line.
    x, y = np.meshgrid(np.arange(0, 2, 0.003), np.arange(0, 2, 0.05))
    assert 0.04 <= fitting_cell(np.stack([x.ravel(), y.ravel()]), least=0.01) <= 0.05


def test_sparse_cloud_has_a_whole_mask():
    found = segment(
        wall(spacing=0.05), config=SegmentationConfig(cell=0.01), fit_cell=True
    )
    result = found.stages.segmentation
    assert 0.03 <= result.cell <= 0.08  # The points are strewn, not in rows.
    assert result.wall_mask.mean() > 0.97


def test_extent_is_that_of_the_wall_without_strays():
    points = np.random.default_rng(0).uniform(0, 2, (3, 20000))
    points[:, :10] = 40.0
    middle, extent = robust_extent(points)
    np.testing.assert_allclose(middle, 1.0, atol=0.01)
    np.testing.assert_allclose(extent, 2.0, atol=0.01)


def test_tile_is_what_is_seen():
    result = segment(wall()).stages.segmentation
    np.testing.assert_allclose(np.array(result.wall_mask.shape) * 0.04, 2.0, atol=0.05)


def test_inlier_distance_follows_the_noise():
    rng = np.random.default_rng(1)
    points = wall(spacing=0.01)
    points[0] = 1.5 + rng.normal(0.0, 0.003, points.shape[1])
    # Four standard deviations of 3 mm.
    found = segment(points, fit_inlier_distance=True)
    assert found.inlier_distance == pytest.approx(0.012, abs=0.001)
    assert segment(points).inlier_distance == 0.03


def dormer():
    """A wall 2 m high and 4 m wide, and 12 cm behind it a strip that tops it."""
    rng = np.random.default_rng(2)
    low = rng.uniform([-2, -1], [2, 1], (40000, 2)).T
    window = (np.abs(low[0]) < 0.5) & (np.abs(low[1]) < 0.5)
    high = rng.uniform([-1, 1], [1, 2], (10000, 2)).T
    y, z = np.concatenate([low, high], axis=1)
    x = 1.5 + 0.12 * np.concatenate([window, np.ones(10000)])
    return np.stack([x, y, z])


def test_wall_set_back_beside_the_wall_is_an_option():
    plain = segment(dormer(), config=SegmentationConfig(cell=0.05))
    found = segment(dormer(), config=SegmentationConfig(cell=0.05), set_back=0.25)
    assert plain.set_back_area == 0.0
    # The strip, 2 m x 1 m; not the window, 1 m x 1 m at the same depth.
    assert found.set_back_area == pytest.approx(2.0, abs=0.15)
    mask = found.stages.segmentation.wall_mask
    window = mask[14:27, 34:47]
    assert window.mean() < 0.05
    assert segment(
        dormer(), config=SegmentationConfig(cell=0.05), set_back=0.1
    ).set_back_area == pytest.approx(0.0)


def test_foot_of_an_obstacle_is_not_painted():
    # A box 10 cm high, whose side a camera at a slant sees as points at all heights.
    rng = np.random.default_rng(3)
    side = rng.uniform([0.0, 0.26, 0.4], [0.1, 0.3, 1.0], (2000, 3))
    sides = X_WALL @ np.stack([side[:, 1], side[:, 2], side[:, 0]])
    points = np.concatenate([wall(Patch(0.3, 0.4, 0.9, 1.0, 0.1)), sides], axis=1)
    result = segment(points, config=SegmentationConfig(cell=0.02)).stages.segmentation
    p_T = result.X_WT.inverse() @ X_WALL @ np.array([0.28, 0.7, 0.0])
    column, row = (p_T[:2] / result.cell).astype(int)
    assert not result.wall_mask[row - 5 : row + 5, column].any()
    assert result.wall_mask[row - 5 : row + 5, column - 4].all()


def carton(turned=1.0):
    """Three faces of a box that meet at its corner nearest to the origin."""
    rng = np.random.default_rng(4)
    faces = []
    for axis in range(3):
        face = rng.uniform(0.0, 0.5, (3, 4000))
        face[axis] = 0.0
        faces.append(face)
    corner = RotationMatrix.MakeZRotation(0.3).matrix() @ np.concatenate(faces, axis=1)
    return np.array([[1.0], [1.0], [1.0]]) + turned * corner


def test_carton_is_no_wall_but_a_corner_of_a_room_has_one():
    config = SegmentationConfig(cell=0.02)
    with pytest.raises(NoWallError, match="is a face of an object"):
        segment_recorded(carton(), config=config, seed=1)
    # The same faces seen from inside: their planes come forward to the sensor.
    segment_recorded(carton(-1.0), config=config, seed=1)


def test_strays_are_counted():
    points = np.concatenate([wall(), np.full((3, 4), 1e30), np.full((3, 9), np.nan)], 1)
    assert segment(points).strays == 4
