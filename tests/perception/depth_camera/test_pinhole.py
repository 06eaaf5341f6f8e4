import numpy as np

from perception.depth_camera.depth import CameraIntrinsics, depth_points
from perception.depth_camera.pinhole import PinholeMap

WANTED = CameraIntrinsics(fx=446.0, fy=446.0, cx=423.5, cy=239.5, width=848, height=480)
TAKEN = CameraIntrinsics(fx=425.2, fy=424.7, cx=427.9, cy=236.1, width=848, height=480)
# A plane z = z0 + a x + b y, m, in C.
Z0, A, B = 0.7, 0.12, -0.08


def picture_of(camera):
    column, row = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    x = (column - camera.cx) / camera.fx
    y = (row - camera.cy) / camera.fy
    return np.rint(1000.0 * Z0 / (1.0 - A * x - B * y)).astype(np.uint16)


def test_points_lie_where_they_were():
    mapped = PinholeMap(TAKEN, WANTED).apply(picture_of(TAKEN))
    x, y, z = depth_points(mapped, mapped > 0, WANTED)
    # Half a pixel of the taking camera at 0.7 to 0.9 m on this slope, and 0.5 mm of the
    # picture's rounding.
    half_pixel = 0.5 * z / TAKEN.fx
    off = np.abs(z - (Z0 + A * x + B * y))
    assert np.all(off <= half_pixel * (abs(A) + abs(B)) + 0.8e-3)


def test_without_the_map_they_would_not():
    x, y, z = depth_points(picture_of(TAKEN), np.ones((480, 848), dtype=bool), WANTED)
    assert np.abs(z - (Z0 + A * x + B * y)).max() > 5e-3


def test_rays_that_were_not_seen_have_no_depth():
    narrow = CameraIntrinsics(
        fx=900.0, fy=900.0, cx=423.5, cy=239.5, width=848, height=480
    )
    mapped = PinholeMap(narrow, WANTED).apply(picture_of(narrow))
    seen = mapped > 0
    # The narrow camera sees 424 / 900 of the way to the side, so 446 / 900 of 848.
    assert abs(seen[240].sum() - 848 * 446 / 900) <= 2
    assert abs(seen[:, 424].sum() - 480 * 446 / 900) <= 2
    assert not seen[0].any()


def test_the_same_camera_changes_nothing():
    picture = picture_of(WANTED)
    assert PinholeMap(WANTED, WANTED).apply(picture) is picture
