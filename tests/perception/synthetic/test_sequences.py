import itertools

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix

from perception.config import StereoConfig
from perception.depth_camera.depth import CameraIntrinsics
from perception.synthetic.sequences import (
    SequenceConfig,
    WallKind,
    cast_rays,
    distance_to_surface,
    render_sequence,
)

QUIET = StereoConfig(subpixel=0.0, ripple=0.0, quantum=1e-4, dropout=0.0)


def first_frames(count, **settings):
    config = SequenceConfig(**settings)
    return list(itertools.islice(render_sequence(config, 7), count))


def test_depth_is_the_distance_to_the_wall_along_the_axis():
    settings = {"vibration": 0.0, "vibration_deg": 0.0, "stereo": QUIET}
    frame, X_WC = first_frames(1, wall=WallKind.BLANK, **settings)[0]
    # The camera looks straight at the plane, so each pixel's depth is its distance.
    seen = frame.depth_mm[frame.depth_mm > 0]
    np.testing.assert_allclose(seen, 700.0, atol=1.0)
    assert X_WC.translation()[2] == pytest.approx(0.7)


def test_recess_and_boxes_are_cast_at_their_depth():
    camera = CameraIntrinsics.from_stereo(QUIET)
    at = {(1.05, 1.2): 0.82, (0.325, 0.4): 0.64, (1.62, 1.25): 0.66, (1.9, 0.2): 0.7}
    for (x, y), depth in at.items():
        looking = RigidTransform(np.diag([1.0, -1.0, -1.0, 1.0])).rotation()
        cast, hit_x, hit_y = cast_rays(
            RigidTransform(looking, [x, y, 0.7]), camera, True
        )
        assert cast[240, 424] == pytest.approx(depth, abs=1e-4)
        assert (hit_x[240, 424], hit_y[240, 424]) == pytest.approx((x, y), abs=2e-3)


def test_what_is_cast_lies_on_a_surface():
    camera = CameraIntrinsics.from_stereo(StereoConfig())
    looking = RotationMatrix(np.diag([1.0, -1.0, -1.0]))
    R_WC = looking @ RollPitchYaw(0.1, -0.2, 0.3).ToRotationMatrix()
    X_WC = RigidTransform(R_WC, [1.0, 1.0, 0.9])
    depth, x, y = cast_rays(X_WC, camera, True)
    u = (np.arange(camera.width) - camera.cx) / camera.fx
    v = (np.arange(camera.height) - camera.cy)[:, None] / camera.fy
    rays = np.stack([*np.broadcast_arrays(u, v), np.ones_like(depth)])
    height = 0.9 + depth * np.tensordot(R_WC.matrix()[2], rays, axes=1)
    assert np.ptp(height) > 0.15  # Into the recess, and onto a box.
    hit = np.stack([x, y, height]).reshape(3, -1).astype(float)
    assert distance_to_surface(hit, WallKind.WINDOW).max() < 1e-5


def test_points_beside_the_surfaces_are_as_far_as_they_are():
    # Before the front; in the recess, 0.75 to 1.35 m, by its left side and its back;
    # above a box's front, 6 cm out; inside the box, 1 cm under its front.
    p_TQs = np.array(
        [
            [1.8, 1.8, 0.03],
            [0.76, 1.2, -0.06],
            [1.0, 1.2, -0.10],
            [0.3, 0.4, 0.08],
            [0.3, 0.4, 0.05],
        ]
    ).T
    away = distance_to_surface(p_TQs, WallKind.WINDOW)
    np.testing.assert_allclose(away, [0.03, 0.01, 0.02, 0.02, 0.01], atol=1e-12)
    bare = distance_to_surface(p_TQs, WallKind.BLANK)
    np.testing.assert_allclose(bare, np.abs(p_TQs[2]))


def test_the_arm_is_off_by_what_was_injected():
    quiet = {"arm_error": 0.0, "arm_error_deg": 0.0}
    errors = {"base_shift": 0.005, "base_shift_deg": 0.3}
    small = StereoConfig(width=64, height=48)
    config = SequenceConfig(wall=WallKind.BLANK, stereo=small, **quiet, **errors)
    pairs = [(f.X_WC, X) for f, X in render_sequence(config, 3)]
    half = len(pairs) // 2
    X_BA = [X @ X_arm.inverse() for X_arm, X in pairs]  # World to the arm's world.
    assert X_BA[half - 1].IsNearlyEqualTo(RigidTransform(), 1e-12)
    for k in (half, len(pairs) - 1):
        angle = X_BA[k].rotation().ToAngleAxis().angle()
        assert np.rad2deg(angle) == pytest.approx(0.3, rel=0.01)
    config = SequenceConfig(
        wall=WallKind.BLANK,
        stereo=small,
        mount_error=0.003,
        mount_error_deg=0.3,
        **quiet,
    )
    for frame, X_WC in itertools.islice(render_sequence(config, 3), 5):
        X_mount = frame.X_WC.inverse() @ X_WC
        assert np.linalg.norm(X_mount.translation()) == pytest.approx(0.003)


def test_arm_errors_have_the_size_asked_for():
    small = StereoConfig(width=64, height=48)
    config = SequenceConfig(wall=WallKind.BLANK, stereo=small)
    offsets = [
        np.linalg.norm(frame.X_WC.translation() - X.translation())
        for frame, X in render_sequence(config, 5)
    ]
    # Rotation about the camera moves it not; a few periods are not the full mean.
    assert np.sqrt(np.mean(np.square(offsets))) == pytest.approx(0.0008, rel=0.35)


def test_a_seed_repeats_its_frames():
    (a, _), (b, _) = first_frames(1)[0], first_frames(1)[0]
    np.testing.assert_array_equal(a.depth_mm, b.depth_mm)
    np.testing.assert_array_equal(a.color, b.color)
