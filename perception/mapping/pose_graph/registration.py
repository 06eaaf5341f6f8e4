"""Registers a new keyframe to older ones."""

from collections.abc import Sequence

import numpy as np
from pydrake.math import RigidTransform

from perception.depth_camera.depth import CameraIntrinsics
from perception.mapping.config import PoseGraphConfig
from perception.mapping.keyframes.keyframe import Keyframe
from perception.mapping.pose_graph.constraints import (
    ConstraintKind,
    PoseConstraint,
    constraint_by_appearance,
    constraint_by_geometry,
)
from perception.mapping.pose_graph.poses import angle_deg

_RECENT = 2
"""Keyframes back that a new one is always registered to."""
_CANDIDATES = 12
"""Nearest older keyframes whose overlap is evaluated."""
_OVERLAP = 0.3
"""Least share of an older keyframe's points in the new one's view."""
_GATE = 0.03
"""A constraint farther than this from the arm's relative pose, m, is rejected."""
_GATE_DEG = 2.0


def overlap(
    keyframe: Keyframe, X_CK: RigidTransform, intrinsics: CameraIntrinsics
) -> float:
    """Returns the share of a keyframe's points in the view of another camera pose.

    Args:
        keyframe: Whose points.
        X_CK: Its pose in the other camera frame.
        intrinsics: Of the camera.
    """
    if not keyframe.sample.size:
        return 0.0
    p_CQs = X_CK @ keyframe.sample.astype(float)
    p_CQs[2] = np.maximum(p_CQs[2], 1e-3)
    u, v = intrinsics.project(p_CQs)
    inside = (u >= 0) & (u < intrinsics.width) & (v >= 0) & (v < intrinsics.height)
    return float(inside.mean())


def find_constraints(
    keyframes: Sequence[Keyframe],
    poses: Sequence[RigidTransform],
    intrinsics: CameraIntrinsics,
    config: PoseGraphConfig,
) -> list[PoseConstraint]:
    """Registers the last keyframe to its predecessors and to older ones it overlaps.

    Args:
        keyframes: In order of time.
        poses: X_WC of each, as estimated so far.
        intrinsics: Of the camera.
        config: `max_links` and the sigmas are used.
    """
    if not config.max_links:
        return []
    index = len(keyframes) - 1
    first_recent = max(0, index - _RECENT)
    places = np.array([X.translation() for X in poses])
    away = np.linalg.norm(places[:first_recent] - places[index], axis=1)
    X_CW = poses[index].inverse()
    older = [
        (overlap(keyframes[k], X_CW @ poses[k], intrinsics), k)
        for k in np.argsort(away)[:_CANDIDATES].tolist()
    ]
    # Those that overlap most, but no two neighbours.
    chosen: list[int] = []
    for seen, k in sorted(older, reverse=True):
        if seen > _OVERLAP and all(abs(k - other) > 1 for other in chosen):
            chosen.append(k)
    chosen = [*range(first_recent, index), *chosen][: config.max_links]
    found = [
        _register(
            keyframes[k],
            keyframes[index],
            poses[k].inverse() @ poses[index],
            intrinsics,
            config,
            (k, index),
        )
        for k in chosen
    ]
    return [constraint for constraint in found if constraint is not None]


def _register(
    a: Keyframe,
    b: Keyframe,
    guess: RigidTransform,
    intrinsics: CameraIntrinsics,
    config: PoseGraphConfig,
    ends: tuple[int, int],
) -> PoseConstraint | None:
    """Registers two keyframes by appearance, or else by geometry."""
    constraint, _ = constraint_by_appearance(
        a.features, b.features, intrinsics, config, ends
    )
    if constraint is None:
        grids = a.grid(intrinsics), b.grid(intrinsics)
        constraint = constraint_by_geometry(*grids, guess, intrinsics, config, ends)
    if constraint is None:
        return None
    off = guess.inverse() @ constraint.X_ij
    arm = a.X_WN is not None and b.X_WN is not None
    if (arm or constraint.kind is ConstraintKind.GEOMETRY) and (
        np.linalg.norm(off.translation()) > _GATE
        or angle_deg(off.rotation()) > _GATE_DEG
    ):
        return None
    return constraint
