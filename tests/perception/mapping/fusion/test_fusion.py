import numpy as np
import open3d as o3d
import pytest
from pydrake.math import RigidTransform

from perception.io.frames import Frame
from perception.mapping.config import MapperConfig
from perception.mapping.fusion.fusion import fuse, write_map, write_mesh, write_voxels
from perception.mapping.keyframes.keyframe import make_keyframe, mean_depth
from perception.mapping.keyframes.view import Features, ThinPicture, View

# Nine pixels a voxel at 0.7 m: the test's camera has a pixel every 3.1 mm.
CONFIG = MapperConfig(stride=2, cell=0.02)
NOTHING = Features(np.zeros((0, 2)), np.zeros((0, 3)), np.zeros((0, 32), np.uint8))
# V's z looks back at the camera, which looks along W's z.
X_WV = RigidTransform(np.diag([1.0, -1.0, -1.0, 1.0]))


def keyframe_of(intrinsics, k, depth_mm):
    color = np.full((*depth_mm.shape, 3), [200, 100, 50], dtype=np.uint8)
    frame = Frame(float(k), depth_mm.astype(np.uint16), color, RigidTransform())
    return make_keyframe(frame, k, NOTHING, intrinsics, CONFIG)


def fused_of(intrinsics, pictures):
    keyframes = [keyframe_of(intrinsics, k, d) for k, d in enumerate(pictures)]
    poses = [RigidTransform()] * len(keyframes)
    return fuse(keyframes, poses, X_WV, intrinsics, CONFIG)


def flat(intrinsics, mm):
    return np.full((intrinsics.height, intrinsics.width), mm)


def test_variance_counts_and_colours_are_those_of_the_pixels(intrinsics):
    # Two frames 4 mm apart: the mean lies between, the variance is (2 mm)².
    fused = fused_of(intrinsics, [flat(intrinsics, 698), flat(intrinsics, 702)])
    # A pixel on a voxel's edge may fall into two voxels, so most and not all.
    assert np.median(fused.p_WQs[2]) == pytest.approx(0.7, abs=1e-4)
    assert np.median(np.sqrt(fused.variances)) == pytest.approx(0.002, rel=0.02)
    np.testing.assert_array_equal(fused.colors, [[200, 100, 50]] * len(fused.colors))
    np.testing.assert_allclose(fused.normals_W[2], -1.0, atol=1e-3)
    assert np.median(fused.frames) == 2
    # Points with fewer than three pixels are left out; all else is counted.
    pixels = 2 * (intrinsics.height // 2) * (intrinsics.width // 2)
    assert 0.8 * pixels < fused.counts.sum() <= pixels


def test_later_frames_carve_what_they_see_through(intrinsics):
    outlier = flat(intrinsics, 700)
    outlier[60:180, 150:270] = 500
    fused = fused_of(intrinsics, [outlier, outlier, *[flat(intrinsics, 700)] * 7])
    assert fused.carved > 100
    assert fused.p_WQs[2].min() > 0.69
    kept = fused_of(intrinsics, [outlier] * 4)  # A permanent surface stays.
    assert kept.p_WQs[2].min() < 0.51


def test_a_voxel_that_one_frame_of_ten_saw_beside_a_surface_is_an_outlier(intrinsics):
    hole, outlier = flat(intrinsics, 700), flat(intrinsics, 700)
    # A voxel is 7 pixels wide; nothing else is seen at the outlier.
    hole[100:107, 200:207], outlier[100:107, 200:207] = 0, 685
    with_hole, with_outlier = (
        keyframe_of(intrinsics, 0, picture).replace(source=all_of(picture))
        for picture in (hole, outlier)
    )

    def nearest(count):
        keyframes = [with_outlier] * count + [with_hole] * (10 - count)
        poses = [RigidTransform()] * 10
        return fuse(keyframes, poses, X_WV, intrinsics, CONFIG).p_WQs[2].min()

    assert nearest(1) > 0.695
    assert nearest(3) < 0.69  # A fifth of them is enough.


def all_of(picture):
    """A view of all pixels, also those that lie by a step."""
    depth_mm = picture.astype(np.uint16)
    thin = ThinPicture.of(depth_mm, depth_mm > 0, CONFIG.stride)
    return View(mean_depth(depth_mm, depth_mm > 0), NOTHING, thin)


def test_a_step_stays_two_surfaces(intrinsics):
    step = flat(intrinsics, 700)
    step[:, 212:] = 670
    fused = fused_of(intrinsics, [step] * 2)
    np.testing.assert_allclose(np.unique(fused.p_WQs[2].round(3)), [0.67, 0.70])


def test_voxels_are_the_cubes_that_hold_points(intrinsics, tmp_path):
    fused = fused_of(intrinsics, [flat(intrinsics, 705)] * 2)
    count = write_voxels(tmp_path / "voxels.npz", fused, 0.05)
    with np.load(tmp_path / "voxels.npz") as file:
        index, edge = file["index"], float(file["edge"])
        assert file["count"].sum() == fused.counts.sum()
    # V's z looks back at the camera: the wall is 0.705 m behind, in the 15th layer.
    assert set(index[:, 2]) == {-15}
    width = 0.705 * intrinsics.width / intrinsics.fx
    height = 0.705 * intrinsics.height / intrinsics.fy
    assert count == len(index) == pytest.approx(width * height / edge**2, rel=0.12)


def test_files_hold_the_map(intrinsics, tmp_path):
    fused = fused_of(intrinsics, [flat(intrinsics, 700)])
    write_map(tmp_path / "map.ply", fused)
    cloud = o3d.t.io.read_point_cloud(tmp_path / "map.ply")
    np.testing.assert_allclose(cloud.point.positions.numpy().T, fused.p_WQs)
    np.testing.assert_array_equal(cloud.point["count"].numpy()[:, 0], fused.counts)
    assert write_mesh(tmp_path / "mesh.ply", fused, depth=6) > 100
