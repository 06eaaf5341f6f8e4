"""The voxel map on hand-made points and on pictures of a wall by the stereo model."""

import functools

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix

from perception.config import MapConfig, StereoConfig
from perception.depth_camera.depth import CameraIntrinsics, depth_points, usable_pixels
from perception.depth_camera.stereo import StereoModel
from perception.mapping.fusion.voxel_map import VoxelMap
from perception.values import SurfaceMap

# A wall across W x at 1.05 m: T x = -W y, T y = W z, T z = -W x.
R_WT = RotationMatrix([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
X_WT = RigidTransform(R_WT, [1.05, 0.5, 0.2])
R_WC = RotationMatrix([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
p_WC = np.array([0.35, 0.0, 0.7])


def make_map(**settings) -> VoxelMap:
    return VoxelMap.empty(X_WT, 1.0, 1.0, MapConfig(**settings))


def in_W(p_TQs) -> np.ndarray:
    return X_WT @ np.array(p_TQs, dtype=float).T


def test_points_of_one_voxel_become_their_mean():
    dut = make_map(min_count=3)
    points = [
        [0.5011, 0.3012, 0.002],
        [0.5031, 0.3032, -0.004],
        [0.5021, 0.3042, 0.005],
    ]
    dut = dut.fuse(in_W(points), p_WC)
    surface = dut.surface_map
    np.testing.assert_allclose(surface.p_WQs[:, 0], in_W(np.mean(points, axis=0)))
    assert surface.counts.tolist() == [3]
    assert surface.variances[0] == pytest.approx(np.var([2e-3, -4e-3, 5e-3]), rel=1e-4)
    assert (surface.frames, dut.frame_count) == (1, 1)


def test_fusing_in_two_parts_equals_fusing_at_once():
    rng = np.random.default_rng(1)
    p_WQs = in_W(rng.uniform([0.0, 0.0, -0.1], [0.1, 0.1, 0.1], (5000, 3)))
    both = make_map().fuse(p_WQs, p_WC)
    first = make_map().fuse(p_WQs[:, 1::2], p_WC)
    parts = first.fuse(p_WQs[:, ::2], p_WC)
    np.testing.assert_array_equal(parts.voxels.keys, both.voxels.keys)
    np.testing.assert_array_equal(parts.voxels.counts, both.voxels.counts)
    np.testing.assert_allclose(parts.voxels.p_VQs, both.voxels.p_VQs, atol=1e-12)
    assert (np.diff(parts.voxels.keys) > 0).all()
    assert parts.voxels.counts.sum() == 5000
    assert parts.voxels.frames.max() == 2
    assert first.voxels.counts.sum() == 2500  # It stayed as it was.


def test_points_outside_the_box_are_left_out():
    dut = make_map(margin=0.1, depth_range=0.5, min_count=1)
    inside = [[-0.09, 0.5, 0.0], [1.09, 0.5, 0.0], [0.5, -0.09, 0.0], [0.5, 0.5, 0.49]]
    outside = [[-0.11, 0.5, 0.0], [1.11, 0.5, 0.0], [0.5, 1.11, 0.0], [0.5, 0.5, -0.52]]
    assert dut.fuse(in_W(inside + outside), p_WC).voxels.counts.sum() == len(inside)


def test_an_empty_map_has_an_empty_surface_and_prints_nothing(capfd):
    for dut in (make_map(), make_map().fuse(np.zeros((3, 0)), p_WC)):
        assert isinstance(dut.surface_map, SurfaceMap)
        assert dut.surface_map.p_WQs.shape == (3, 0)
    assert dut.frame_count == dut.surface_map.frames == 1
    assert capfd.readouterr() == ("", "")  # `--json` is alone on stdout.


def test_a_surface_on_the_border_of_two_layers_is_one_point_a_column():
    rng = np.random.default_rng(1)
    z = 0.0075 + 0.002 * rng.standard_normal(400)  # Layers meet at 7.5 mm.
    points = np.stack([rng.uniform(0.5, 0.505, 400), rng.uniform(0.5, 0.505, 400), z])
    surface = make_map().fuse(X_WT @ points, p_WC).surface_map
    assert surface.counts.tolist() == [400]
    assert -(surface.p_WQs[0, 0] - 1.05) == pytest.approx(z.mean())


def test_two_surfaces_10_mm_apart_in_one_column_stay_apart():
    points = np.full((3, 40), 0.5)
    points[2] = np.repeat([0.002, 0.012], 20)
    surface = make_map().fuse(X_WT @ points, p_WC).surface_map
    np.testing.assert_allclose(np.sort(1.05 - surface.p_WQs[0]), [0.002, 0.012])


def test_voxels_seen_much_less_than_their_neighbours_are_outliers():
    wall = np.full((3, 20), 0.5012)
    wall[2] = 0.0
    outlier = np.array([[0.5062], [0.5012], [0.1]])  # The next column.
    dut = make_map(min_count=1, outlier_share=0.15)
    for frame in range(10):
        points = np.hstack([wall, outlier]) if frame == 0 else wall
        dut = dut.fuse(X_WT @ points, p_WC)
    assert dut.surface_map.counts.tolist() == [200]
    seen_again = dut
    for _ in range(3):
        seen_again = seen_again.fuse(X_WT @ np.repeat(outlier, 20, axis=1), p_WC)
    assert seen_again.surface_map.counts.tolist() == [200, 61]


def test_normals_point_to_the_camera_that_saw_the_surface():
    rng = np.random.default_rng(1)
    flat = np.zeros((3, 20000))
    flat[:2] = rng.uniform(0.2, 0.4, (2, 20000))
    # A reveal: the plane T x = 0.6, seen from its right.
    reveal = np.full((3, 20000), 0.6)
    reveal[1] = rng.uniform(0.2, 0.4, 20000)
    reveal[2] = rng.uniform(-0.2, -0.05, 20000)
    dut = make_map().fuse(X_WT @ flat, p_WC)
    dut = dut.fuse(X_WT @ reveal, X_WT @ np.array([0.9, 0.3, 0.7]))
    surface = dut.surface_map
    of_reveal = 1.05 - surface.p_WQs[0] < -0.03
    cosine = X_WT.rotation().matrix().T @ surface.normals_W
    np.testing.assert_allclose(np.linalg.norm(cosine, axis=0), 1.0, atol=1e-5)
    assert (cosine[2, ~of_reveal] > 0.99).all()
    assert np.median(cosine[0, of_reveal]) > 0.99


def test_the_same_pictures_give_the_same_map_to_the_bit():
    p_WQs = in_W(np.random.default_rng(1).uniform(0.0, 0.1, (5000, 3)))
    first, second = (make_map().fuse(p_WQs, p_WC).surface_map for _ in range(2))
    np.testing.assert_array_equal(first.p_WQs, second.p_WQs)
    np.testing.assert_array_equal(first.normals_W, second.normals_W)


@functools.cache
def scanned_plates() -> SurfaceMap:
    """A map of 12 pictures from 0.7 m, 5 cm apart, of a wall with two raised plates.

    In T: one of 10 mm at x 0.2 to 0.4 and one of 60 mm at x 0.6 to 0.8, both at y 0.4
    to 0.6; they have no sides.
    """
    camera = StereoConfig()
    intrinsics = CameraIntrinsics.from_stereo(camera)
    model, config = StereoModel(camera, 1), MapConfig()
    x = (np.arange(camera.width) - intrinsics.cx) / intrinsics.fx
    y = ((np.arange(camera.height) - intrinsics.cy) / intrinsics.fy)[:, np.newaxis]
    dut = make_map()
    for frame in range(12):
        p_TC = np.array([0.25 + 0.05 * frame, 0.45, 0.7])
        depth = np.full((camera.height, camera.width), 0.7)
        for left, height in ((0.2, 0.01), (0.6, 0.06)):
            z = 0.7 - height
            p_TQ_x, p_TQ_y = p_TC[0] + z * x, p_TC[1] - z * y
            hit = (left < p_TQ_x) & (p_TQ_x < left + 0.2)
            hit = hit & (p_TQ_y > 0.4) & (p_TQ_y < 0.6)
            depth = np.where(hit, z, depth)
        depth = depth.astype(np.float32)
        depth_mm = model.measure(depth, depth, np.random.default_rng([1, frame]))
        usable = usable_pixels(depth_mm, config)
        p_CQs = depth_points(depth_mm, usable, intrinsics, config.stride)
        X_WC = RigidTransform(R_WC, X_WT @ p_TC)
        dut = dut.fuse(X_WC @ p_CQs, X_WC.translation())
    return dut.surface_map


def points_in(left: float, right: float, bottom: float, top: float) -> np.ndarray:
    """Returns the points of that part of the tile, (3, N) in T."""
    p_TQs = X_WT.inverse() @ scanned_plates().p_WQs
    inside = (p_TQs[0] > left) & (p_TQs[0] < right)
    return p_TQs[:, inside & (p_TQs[1] > bottom) & (p_TQs[1] < top)]


def test_the_map_of_a_flat_wall_is_thin_and_unbiased():
    z = points_in(0.2, 0.8, 0.65, 0.8)[2]
    assert z.size == pytest.approx(120 * 30, rel=0.02)  # One point a 5 mm column.
    low, high = np.percentile(z, [5, 95])
    assert high - low < 0.005
    # Ripple and the noise's fixed part bias by 0.02 px and some of 0.08 px: 0.9 mm.
    assert abs(z.mean()) < 0.0009


def test_a_step_of_10_mm_stands_out_of_the_noise():
    plate = points_in(0.21, 0.39, 0.41, 0.59)[2]
    around = points_in(0.21, 0.39, 0.62, 0.75)[2]
    assert np.median(plate) - np.median(around) == pytest.approx(0.01, abs=0.0015)
    assert np.percentile(plate, 1) > np.percentile(around, 99)


def test_edges_of_a_plate_are_where_they_are():
    p_TQs = points_in(0.5, 0.9, 0.45, 0.55)
    plate = p_TQs[:, p_TQs[2] > 0.03]
    # Within a voxel: the matcher's 5 mm of growth are taken off again.
    assert plate[0].min() == pytest.approx(0.6, abs=0.005)
    assert plate[0].max() == pytest.approx(0.8, abs=0.005)


def test_nothing_hangs_between_plate_and_wall_or_stands_off_them():
    z = points_in(0.1, 0.9, 0.3, 0.8)[2]
    assert not ((z > 0.02) & (z < 0.05)).any()
    assert z.max() < 0.065
    assert z.min() > -0.005
