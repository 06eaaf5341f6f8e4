import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw

from perception.mapping.config import MapperConfig
from perception.mapping.keyframes import keyframe
from perception.mapping.keyframes.keyframe import find_features
from perception.mapping.pose_graph.constraints import (
    constraint_by_appearance,
    constraint_by_geometry,
    floored,
)

CONFIG = MapperConfig()


def depth_of(intrinsics, planes, X_WC):
    """The nearest of planes n . p = d in W, mm, without noise."""
    u = (np.arange(intrinsics.width) - intrinsics.cx) / intrinsics.fx
    v = (np.arange(intrinsics.height) - intrinsics.cy) / intrinsics.fy
    rays = np.stack([*np.meshgrid(u, v), np.ones((v.size, u.size))], axis=-1)
    depth = np.full(rays.shape[:2], np.inf)
    for *n, d in planes:
        n_C = X_WC.rotation().matrix().T @ n
        away = (d - np.dot(n, X_WC.translation())) / (rays @ n_C)
        depth = np.where(away > 0, np.minimum(depth, away), depth)
    return np.rint(1000 * depth).astype(np.uint16)


def grid_of(intrinsics, planes, X_WC):
    depth_mm = depth_of(intrinsics, planes, X_WC)
    z = keyframe.mean_depth(depth_mm, depth_mm > 0)
    return keyframe.grid_of(z, intrinsics)


WALL = [(0.0, 0.0, 1.0, 0.8)]
# Three planes that meet in a corner ahead: all six directions are determined.
CORNER = [(0.8, 0.0, 0.6, 0.6), (-0.8, 0.1, 0.6, 0.6), (0.0, 0.8, 0.6, 0.6)]
OFFSET = RigidTransform(RollPitchYaw(0.004, -0.006, 0.003), [0.004, -0.003, 0.005])


def test_a_corner_determines_all_directions(intrinsics):
    X_ij = RigidTransform(RollPitchYaw(0.02, 0.03, -0.01), [0.05, 0.02, 0.01])
    a, b = (grid_of(intrinsics, CORNER, X) for X in (RigidTransform(), X_ij))
    constraint = constraint_by_geometry(a, b, X_ij @ OFFSET, intrinsics, CONFIG, (0, 1))
    assert constraint.rank == 6
    off = X_ij.inverse() @ constraint.X_ij
    # Depth is rounded to whole mm, and the grid's points are the mean of 64 pixels.
    assert np.linalg.norm(off.translation()) < 1e-3
    assert off.rotation().ToAngleAxis().angle() < 1.5e-3


def test_a_wall_corrects_distance_and_tilt_and_leaves_the_rest(intrinsics):
    X_ij = RigidTransform([0.05, 0.02, 0.01])
    a, b = (grid_of(intrinsics, WALL, X) for X in (RigidTransform(), X_ij))
    constraint = constraint_by_geometry(a, b, X_ij @ OFFSET, intrinsics, CONFIG, (0, 1))
    assert constraint.rank == 3
    off = X_ij.inverse() @ constraint.X_ij
    assert off.translation()[2] == pytest.approx(0.0, abs=3e-4)
    np.testing.assert_allclose(
        off.translation()[:2], OFFSET.translation()[:2], atol=2e-4
    )
    normal = off.rotation().matrix()[:, 2]
    assert np.degrees(np.arccos(normal[2])) < 0.02
    turn = off.rotation().ToAngleAxis()
    assert turn.angle() * turn.axis()[2] == pytest.approx(0.003, abs=2e-4)


def test_views_that_share_nothing_are_not_linked(intrinsics):
    a = grid_of(intrinsics, WALL, RigidTransform())
    assert (
        constraint_by_geometry(
            a, a, RigidTransform([3, 0, 0]), intrinsics, CONFIG, (0, 1)
        )
        is None
    )


def test_information_never_passes_its_floor():
    sharp = floored(1e15 * np.eye(6), CONFIG)
    assert np.sqrt(1.0 / np.linalg.eigvalsh(sharp).max()) >= CONFIG.link_sigma
    partial = floored(np.diag([0, 0, 0, 1.0, 1.0, 1e6]), CONFIG, complexity=0.1)
    assert np.linalg.matrix_rank(partial) == 1


def test_texture_gives_the_pose_between_two_frames(textured_scan, intrinsics):
    (a, X_Wa), (b, X_Wb) = textured_scan[0], textured_scan[2]
    seen = [find_features(frame, intrinsics, CONFIG) for frame in (a, b)]
    constraint, inliers = constraint_by_appearance(*seen, intrinsics, CONFIG, (0, 1))
    off = (X_Wa.inverse() @ X_Wb).inverse() @ constraint.X_ij
    assert inliers > 50
    # Tilt and displacement of a plane are told apart by depth alone, pixel by pixel.
    assert np.linalg.norm(off.translation()) < 3e-3
    assert np.degrees(off.rotation().ToAngleAxis().angle()) < 0.2


def test_noise_is_no_texture(blank_scan, intrinsics):
    seen = [find_features(f, intrinsics, CONFIG) for f, _ in blank_scan[:2]]
    assert constraint_by_appearance(*seen, intrinsics, CONFIG, (0, 1))[0] is None
