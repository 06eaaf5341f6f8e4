"""What one picture measures of a wall follows from the camera and its mount."""

import math

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix

from painter.errors import InputError
from painter.planning.arm.scan_camera import ScanCamera
from perception.config import StereoConfig

# C x to the right (L -y), y down, z ahead (L x).
R_LC = RotationMatrix([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
WIDTH, HEIGHT, BASELINE = 2.0, 1.0, 0.3  # m at 1 m, by 90 deg over 2 : 1 pixels.
STEREO = StereoConfig(width=200, height=100, hfov_deg=90.0, baseline=BASELINE)


def footprint(roll_deg=0.0, stereo=STEREO, distance=1.0):
    """Left, right, below, above of a camera turned about L x, m."""
    roll = RollPitchYaw(math.radians(roll_deg), 0.0, 0.0).ToRotationMatrix()
    camera = ScanCamera.mounted(stereo, RigidTransform(roll @ R_LC, [0.2, 0.0, 0.1]))
    found = camera.footprint(distance)
    return np.array([found.left, found.right, found.below, found.above])


@pytest.mark.parametrize(
    ("roll_deg", "expected"),
    [
        (0.0, [0.7, 1.0, 0.5, 0.5]),  # Blind on the left,
        (-90.0, [0.5, 0.5, 0.7, 1.0]),  # below where C x is up,
        (180.0, [1.0, 0.7, 0.5, 0.5]),
        (90.0, [0.5, 0.5, 1.0, 0.7]),
    ],
)
def test_the_strip_that_one_imager_misses_turns_with_the_camera(roll_deg, expected):
    np.testing.assert_allclose(footprint(roll_deg), expected, atol=1e-9)


def test_pictures_grow_with_distance_and_the_strip_does_not():
    np.testing.assert_allclose(
        footprint(distance=0.5), [0.5 - BASELINE, 0.5, 0.25, 0.25]
    )


@pytest.mark.parametrize("roll_deg", [-95.0, -3.0, 1.0, 8.0, 89.0, 182.0])
def test_a_tilted_picture_holds_its_upright_rectangle_and_no_larger_one(roll_deg):
    """All four corners lie on the picture's sides: in one axis of C or the other."""
    left, right, below, above = footprint(roll_deg)
    a = math.radians(roll_deg)
    # L x points into the wall, so a positive roll turns C x downwards.
    x_T, y_T = (
        np.array([math.cos(a), -math.sin(a)]),
        np.array([-math.sin(a), -math.cos(a)]),
    )
    corners = [(x, y) for x in (-left, right) for y in (-below, above)]
    edge = []
    for corner in corners:
        x, y = np.dot(x_T, corner), np.dot(y_T, corner)
        slack = [x + 1.0 - BASELINE, 1.0 - x, 0.5 - y, 0.5 + y]
        assert min(slack) >= -1e-9
        edge.append(min(slack))
    np.testing.assert_allclose(edge, 0.0, atol=1e-9)


def test_the_right_imager_lies_along_the_pictures_rows():
    for roll_deg, expected in ((0.0, [0.3, 0.0, 0.0]), (-90.0, [0.0, 0.3, 0.0])):
        roll = RollPitchYaw(math.radians(roll_deg), 0.0, 0.0).ToRotationMatrix()
        camera = ScanCamera.mounted(STEREO, RigidTransform(roll @ R_LC, np.zeros(3)))
        np.testing.assert_allclose(camera.imagers_T, [[0, 0, 0], expected], atol=1e-9)


@pytest.mark.parametrize("roll_deg", [45.0, -50.0])
def test_a_camera_that_is_neither_level_nor_upright_is_refused(roll_deg):
    with pytest.raises(InputError, match=r"camera_mount rolls it 4\d\.0 deg .* 90 deg"):
        footprint(roll_deg)


def test_a_blind_strip_as_wide_as_the_picture_is_refused():
    with pytest.raises(InputError, match=r"0\.200 m wide, at 0\.10 m .* 0\.3 m"):
        footprint(distance=0.1)
