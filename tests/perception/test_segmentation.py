"""The six steps together on walls whose answer is known."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw

from perception.config import MapConfig, SegmentationConfig
from perception.errors import NoWallError
from perception.fine_steps.unseen import Reason
from perception.mapping.fusion.voxel_map import VoxelMap
from perception.segmentation import segment_wall
from perception.synthetic.patch_wall import (
    EXAMPLE_PATCHES,
    Patch,
    synthetic_truth,
    synthetic_wall,
)
from perception.values import SurfaceMap, TileSize

TILE = TileSize(2.0, 2.0)
GLASS = float("nan")


def segment(points, X_WT=None, *, seed=1, **settings):
    """Segments a 2 x 2 m tile."""
    config = SegmentationConfig(**settings)
    X_WT = RigidTransform() if X_WT is None else X_WT
    return segment_wall(
        SurfaceMap.of_points(points), X_WT, TILE, config=config, seed=seed
    )


def cloud(patches, **options):
    """A wall at 1 cm spacing, one point a cell, if not told otherwise."""
    rng = np.random.default_rng(0)
    return synthetic_wall(patches, **{"spacing": 0.01, **options}, rng=rng)


def iou(mask, truth):
    """Intersection over union."""
    return np.count_nonzero(mask & truth) / np.count_nonzero(mask | truth)


@pytest.mark.parametrize("outliers", [0, 500])
def test_example_wall_is_parted_as_drawn(outliers):
    result = segment(cloud(EXAMPLE_PATCHES, outliers=outliers, spacing=0.005))
    # All edges lie on cell borders; a cell in ten along their 13 m is 0.5 %.
    assert iou(result.wall_mask, synthetic_truth()) > 0.995
    assert result.labels.shape == result.depth.shape == (200, 200)
    assert result.labels.dtype == np.uint16
    assert result.depth.dtype == np.float32


def test_labels_go_by_area_and_glass_is_nothing_seen():
    result = segment(cloud(EXAMPLE_PATCHES, spacing=0.005))
    labels, counts = np.unique(result.labels, return_counts=True)
    np.testing.assert_array_equal(labels, np.arange(7))
    assert (np.diff(counts[1:]) <= 0).all()
    pane = (slice(98, 152), slice(28, 72))
    assert (result.labels[pane] == 0).all()
    assert np.isnan(result.depth[pane]).all()
    assert not result.wall_mask[pane].any()
    # Wall 2.55 m², door 0.93 m², window frame 0.14 m², box 0.04 m².
    expected = [25416, 9300, 1416, 480, 400, 225]
    np.testing.assert_allclose(counts[1:], expected, rtol=0.02, atol=10)


def test_depth_is_measured_from_the_wall():
    result = segment(cloud(EXAMPLE_PATCHES))
    assert np.nanmedian(result.depth[result.wall_mask]) == pytest.approx(0.0, abs=5e-4)
    assert np.nanmedian(result.depth[20:150, 130:180]) == pytest.approx(-0.07, abs=5e-4)
    assert np.nanmedian(result.depth[32:48, 27:43]) == pytest.approx(0.10, abs=5e-4)


def test_wall_on_both_sides_of_a_door_is_wall():
    door = Patch(0.9, -0.2, 1.3, 2.2, -0.10)
    result = segment(cloud([door]))
    assert iou(result.wall_mask, synthetic_truth([door])) > 0.99
    assert set(np.unique(result.labels[result.wall_mask])) == {1, 2}


def test_what_nothing_came_back_from_is_painted_only_in_gaps_between_points():
    hole = Patch(0.5, 0.5, 0.55, 0.55, GLASS)  # 5 x 5 cells
    gap = Patch(1.5, 1.5, 1.52, 1.52, GLASS)  # 2 x 2 cells
    result = segment(cloud([hole, gap], spacing=0.005))
    assert not result.wall_mask[51:54, 51:54].any()
    assert (result.reason[51:54, 51:54] == Reason.UNSEEN).all()
    assert result.wall_mask[150:152, 150:152].all()
    assert np.isnan(result.depth[150:152, 150:152]).all()


def test_things_seen_through_a_window_do_not_break_the_wall_beside_it():
    window = Patch(0.6, 0.6, 1.4, 1.4, GLASS)
    rng = np.random.default_rng(2)
    behind = rng.uniform([[0.3], [0.3], [-1.2]], [[1.7], [1.7], [-0.9]], (3, 40000))
    points = np.concatenate([cloud([window]), behind], axis=1)
    result = segment(points)
    assert iou(result.wall_mask, synthetic_truth([window])) > 0.98


def test_wall_that_is_not_the_largest_plane_is_still_the_wall():
    door = Patch(-0.2, -0.2, 1.4, 2.2, -0.3)
    result = segment(cloud([door]))
    assert iou(result.wall_mask, synthetic_truth([door])) > 0.99
    assert (result.labels[result.wall_mask] == 2).all()


def test_answer_moves_with_the_wall():
    X_WT = RigidTransform(RollPitchYaw(1.2, -0.4, 2.0), [3.0, -1.0, 0.5])
    still = segment(cloud(EXAMPLE_PATCHES))
    moved = segment(cloud(EXAMPLE_PATCHES, X_WT=X_WT), X_WT)
    # The planes differ by rounding and by triples; cells on an edge may change sides.
    assert iou(still.wall_mask, moved.wall_mask) > 0.995
    np.testing.assert_allclose(
        moved.X_WT.GetAsMatrix4(), X_WT.GetAsMatrix4(), atol=1e-3
    )


def test_same_seed_same_segmentation():
    points = cloud(EXAMPLE_PATCHES, outliers=300)
    one, other = segment(points, seed=5), segment(points, seed=5)
    np.testing.assert_array_equal(one.labels, other.labels)
    np.testing.assert_array_equal(one.depth, other.depth)
    np.testing.assert_array_equal(one.wall_mask, other.wall_mask)


def test_order_of_points_hardly_matters():
    points = cloud(EXAMPLE_PATCHES)
    order = np.random.default_rng(8).permutation(points.shape[1])
    one, other = segment(points), segment(points[:, order])
    assert iou(one.wall_mask, other.wall_mask) > 0.995


@pytest.mark.parametrize("corner", [0.7, 0.7025, 0.7075])
def test_edges_on_a_map_are_where_they_are(corner):
    # The statistical filter takes the rows of its even grid along edges for outliers.
    rng = np.random.default_rng(0)
    x, y = np.meshgrid(*[np.arange(-0.1, 2.1, 0.0016)] * 2)

    def on_plate(x, y):
        return (np.abs(x - corner - 0.15) < 0.15) & (np.abs(y - corner - 0.15) < 0.15)

    z = 0.1 * on_plate(x, y) + rng.normal(0.0, 0.0005, x.shape)
    points = np.stack([x, y, z]).reshape(3, -1)
    voxels = VoxelMap.empty(RigidTransform(), 2.0, 2.0, config=MapConfig())
    surface = voxels.fuse(points, np.array([1.0, 1.0, 0.7])).surface_map
    result = segment_wall(
        surface, RigidTransform(), TILE, config=SegmentationConfig(), seed=1
    )
    centres = (np.arange(200) + 0.5) * 0.01
    wall = ~on_plate(*np.meshgrid(centres, centres))
    np.testing.assert_array_equal(result.wall_mask, wall)


def test_non_finite_points_are_dropped():
    points = cloud(EXAMPLE_PATCHES)
    spoilt = np.concatenate([points, np.full((3, 1000), np.nan)], axis=1)
    np.testing.assert_array_equal(segment(points).labels, segment(spoilt).labels)


@pytest.mark.parametrize(
    ("points", "message"),
    [
        (np.zeros((3, 0)), "0 finite points"),
        (np.full((3, 300), np.nan), "0 finite points of 300"),
        (
            RigidTransform([0, 0, 0.4]) @ cloud([]),
            "0.400 m in front of the expected wall",
        ),
        (RigidTransform([9, 0, 0]) @ cloud([]), "no region of 0.005 m² on the 2 x 2 m"),
    ],
)
def test_clouds_without_the_wall_are_refused(points, message):
    with pytest.raises(NoWallError, match=message):
        segment(points)


def test_setting_out_of_bounds_is_refused():
    with pytest.raises(ValueError, match=r"segmentation\.cell must be > 0"):
        segment(cloud([]), cell=0.0)
