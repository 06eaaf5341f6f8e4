"""Reach of an arm whose workspace is known in closed form."""

import math

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix

from painter.planning.arm.kinematics import ArmKinematics, ArmLimits
from painter.planning.arm.reach_map import ReachTask, placement, tile_reach
from painter.planning.arm.scan_camera import Footprint
from painter.planning.config import TileConfig

R_AHEAD = RotationMatrix([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
ARM = ArmKinematics(
    shoulder_height=1.2,
    upper_arm=0.5,
    forearm=0.5,
    X_LG=RigidTransform(R_AHEAD, [0.2, 0.0, 0.0]),
    X_LC=RigidTransform(R_AHEAD, [0.1, 0.0, 0.0]),
)
WIDE = ArmLimits(
    q_min=np.full(5, -math.pi),
    q_max=np.full(5, math.pi),
    v_max=np.ones(5),
    a_max=np.ones(5),
    effort_max=np.ones(5),
)
TILE = TileConfig(width=2.0, height=2.0, bottom=0.2, distance=1.0)
# At 0.5 m with 90 x 90 deg.
PICTURE = Footprint(left=0.5, right=0.5, below=0.5, above=0.5)
TASK = ReachTask(standoff=0.3, scan_distance=0.5, footprint=PICTURE, margin=0.0)


def everywhere(q):
    return np.ones(len(q), dtype=bool)


def test_sprayed_is_a_disc_around_the_shoulder():
    reach = tile_reach(ARM, WIDE, TILE, TASK, is_free=everywhere)
    # The wrist stands 1.0 - 0.3 - 0.2 = 0.5 m ahead and has 1.0 m: sqrt(0.75) remain.
    x, y = np.meshgrid(reach.x, reach.y)
    distance = np.hypot(x - 1.0, y - 1.0)
    radius = math.sqrt(1.0 - 0.5**2)
    np.testing.assert_array_equal(reach.sprayed, distance < radius)
    # 41 x 41 points, each standing for 0.05 m squared: together a square of 2.05 m.
    share = math.pi * radius**2 / 2.05**2
    assert reach.spray_share == pytest.approx(share, abs=0.01)


def test_pictures_reach_half_their_size_beyond_the_camera():
    reach = tile_reach(ARM, WIDE, TILE, TASK, is_free=everywhere)
    # The camera's disc has the radius sqrt(1 - 0.4²) = 0.917 m, a picture 0.5 m more.
    assert not reach.camera_at[0, 20] and reach.seen[0, 20]
    assert reach.scan_share == 1.0


def test_a_picture_without_a_left_half_shows_nothing_to_the_left():
    """The base yaw is bound so that the camera stays within 4 cm of the middle."""
    ahead = WIDE.replace(
        q_min=np.array([-0.1, *[-math.pi] * 4]), q_max=np.array([0.1, *[math.pi] * 4])
    )
    task = TASK.replace(footprint=PICTURE.replace(left=0.0, below=0.1))
    reach = tile_reach(ARM, ahead, TILE, task, is_free=everywhere)
    cameras_y, cameras_x = np.nonzero(reach.camera_at)
    seen_y, seen_x = np.nonzero(reach.seen)
    left = (reach.x[cameras_x].min() - reach.x[seen_x]).max()
    right = (reach.x[seen_x] - reach.x[cameras_x].max()).max()
    below = (reach.y[cameras_y].min() - reach.y[seen_y]).max()
    above = (reach.y[seen_y] - reach.y[cameras_y].max()).max()
    np.testing.assert_allclose([left, right], [0.0, 0.5], atol=1e-9)
    assert below <= 0.1 + 1e-9 and above <= 0.5 + 1e-9


def test_joint_limits_and_collisions_take_away():
    narrow = WIDE.replace(q_min=np.array([-0.1, *[-math.pi] * 4]))
    reach = tile_reach(ARM, narrow, TILE, TASK, is_free=everywhere)
    # Base yaw of -0.1 rad brings the wrist, 0.5 m ahead, 5 cm to the right (T x up).
    inside = reach.x < 1.0 + 0.5 * math.tan(0.1) + 1e-9
    assert not reach.sprayed[:, ~inside].any() and reach.sprayed[20, inside].any()
    blocked = tile_reach(ARM, WIDE, TILE, TASK, is_free=lambda q: q[:, 0] > 10.0)
    assert blocked.spray_share == blocked.scan_share == 0.0


def test_the_margin_is_to_be_seen_but_not_sprayed():
    task = TASK.replace(margin=0.05)
    reach = tile_reach(ARM, WIDE, TILE, task, is_free=everywhere, around=0.2)
    assert reach.x[0] == pytest.approx(-0.2) and reach.x[-1] == pytest.approx(2.2)
    assert reach.on_tile.sum() == 41 * 41
    assert reach.to_see.sum() == 43 * 43


def test_raising_the_shoulder_lowers_the_tile():
    moved = placement(TILE, distance=1.3, raised=0.15)
    assert (moved.distance, moved.bottom) == (1.3, pytest.approx(0.05))
    assert (moved.width, moved.height) == (TILE.width, TILE.height)
