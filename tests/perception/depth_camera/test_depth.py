import math

import numpy as np
import pytest

from perception.config import MapConfig, StereoConfig
from perception.depth_camera.depth import CameraIntrinsics, depth_points, usable_pixels

CAMERA = CameraIntrinsics(fx=100.0, fy=110.0, cx=19.5, cy=14.5, width=40, height=30)


def wall(depth_mm: int = 700) -> np.ndarray:
    return np.full((30, 40), depth_mm, dtype=np.uint16)


def test_stereo_intrinsics_put_the_field_of_view_on_the_picture_borders():
    dut = CameraIntrinsics.from_stereo(StereoConfig())
    # Half a pixel outside the first pixel's centre lies the border.
    assert math.degrees(math.atan((dut.cx + 0.5) / dut.fx)) == pytest.approx(43.5)
    assert dut.fx == dut.fy
    assert (dut.cx, dut.cy) == (423.5, 239.5)


def test_points_project_back_to_their_pixels():
    depth_mm = np.random.default_rng(1).integers(300, 3000, (30, 40)).astype(np.uint16)
    p_CQs = depth_points(depth_mm, np.ones((30, 40), dtype=bool), CAMERA)
    row, column = np.divmod(np.arange(1200), 40)
    np.testing.assert_allclose(100 * p_CQs[0] / p_CQs[2] + 19.5, column, atol=1e-9)
    np.testing.assert_allclose(110 * p_CQs[1] / p_CQs[2] + 14.5, row, atol=1e-9)
    np.testing.assert_allclose(p_CQs[2], depth_mm.ravel() / 1000.0, atol=1e-12)


def test_a_pixel_off_the_axis_shows_a_point_by_similar_triangles():
    # 50 px right of and 22 px above the principal point: x = 50/100 z, y = -22/110 z.
    column, row, z = np.array([69.5]), np.array([-7.5]), np.array([2.0])
    p_CQs = CAMERA.backproject(column, row, z)
    np.testing.assert_allclose(p_CQs, [[1.0], [-0.4], [2.0]])
    np.testing.assert_allclose(CAMERA.project(p_CQs), [[69.5], [-7.5]])
    homogeneous = CAMERA.matrix @ p_CQs
    np.testing.assert_allclose(homogeneous[:2] / homogeneous[2], [[69.5], [-7.5]])


def test_stride_takes_every_so_many_th_usable_pixel():
    usable = np.ones((30, 40), dtype=bool)
    usable[0, 0] = False
    p_CQs = depth_points(wall(), usable, CAMERA, stride=3)
    assert p_CQs.shape == (3, 10 * 14 - 1)
    # The first point is pixel (0, 3).
    np.testing.assert_allclose(p_CQs[:, 0], [-0.165 * 0.7, -14.5 / 110 * 0.7, 0.7])


def test_pictures_of_another_size_are_refused():
    with pytest.raises(ValueError, match=r"\(30, 40\)"):
        depth_points(np.zeros((3, 3), np.uint16), np.zeros((3, 3), bool), CAMERA)


def test_near_side_of_an_edge_loses_half_the_window_and_far_side_one_pixel():
    depth_mm = wall(800)
    depth_mm[10:25, 10:30] = 600
    usable = usable_pixels(depth_mm, MapConfig(edge_window=7))
    assert usable[13:22, 13:27].all()
    assert not usable[10:25, 10:13].any()
    assert not usable[10:25, 27:30].any()
    assert not usable[10:13, 10:30].any()
    assert not usable[22:25, 10:30].any()
    assert not usable[9, 9:31].any()
    assert not usable[9:26, 30].any()
    assert usable[:9].all()
    assert usable[26:].all()
    assert usable[:, 31:].all()


def test_the_shadow_left_of_a_near_edge_counts_as_far():
    depth_mm = wall(800)
    depth_mm[:, 20:] = 600
    depth_mm[:, 12:20] = 0
    usable = usable_pixels(depth_mm, MapConfig(edge_window=7))
    assert usable[:, :12].all()
    assert not usable[:, 12:23].any()
    assert usable[:, 23:].all()


def test_holes_in_a_flat_wall_cost_nothing_but_themselves():
    depth_mm = wall()
    depth_mm[5:8, 20:24] = 0
    np.testing.assert_array_equal(usable_pixels(depth_mm, MapConfig()), depth_mm > 0)


def test_steps_that_are_lower_than_errors_of_stereo_are_kept():
    depth_mm = wall(700)
    depth_mm[:, 20:] = 694  # 0.014 / m is 6.9 mm at 0.7 m.
    assert usable_pixels(depth_mm, MapConfig()).all()
    depth_mm[:, 20:] = 690
    usable = usable_pixels(depth_mm, MapConfig(edge_window=7))
    assert usable[:, :19].all()
    assert not usable[:, 19:23].any()
    assert usable[:, 23:].all()


def test_far_away_the_share_of_depth_is_the_bound():
    depth_mm = wall(2000)
    depth_mm[:, 20:] = 1965  # 0.014 / m is 56 mm at 2 m, 2 % are 40 mm.
    assert usable_pixels(depth_mm, MapConfig()).all()
    depth_mm[:, 20:] = 1955
    assert not usable_pixels(depth_mm, MapConfig(edge_window=7))[:, 19:23].any()


def test_near_pixels_beside_a_lone_farther_one_are_kept():
    depth_mm = wall(700)
    depth_mm[15, 20] = 720
    usable = usable_pixels(depth_mm, MapConfig())
    assert np.argwhere(~usable).tolist() == [[15, 20]]


def test_a_lone_flying_pixel_is_dropped():
    depth_mm = wall(700)
    depth_mm[15, 20] = 600
    usable = usable_pixels(depth_mm, MapConfig())
    assert not usable[15, 20]


def test_depth_out_of_range_is_dropped():
    depth_mm = wall(700)
    depth_mm[:, :10] = 3200
    depth_mm[:, 30:] = 200
    usable = usable_pixels(depth_mm, MapConfig(edge_jump=100.0, edge_step=100.0))
    assert not usable[:, :10].any()
    assert not usable[:, 30:].any()
    assert usable[:, 10:30].all()
