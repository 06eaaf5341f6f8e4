"""Constraints between two keyframes, from appearance or geometry."""

import enum
from dataclasses import dataclass

import cv2
import numpy as np
from pydrake.math import RigidTransform

from perception.depth_camera.depth import CameraIntrinsics
from perception.ground import FloatArray, FrozenValue
from perception.mapping.config import PoseGraphConfig
from perception.mapping.keyframes.keyframe import BLOCK, PointGrid
from perception.mapping.keyframes.view import Features
from perception.mapping.pose_graph.poses import pose_of, skew

_LEVER = 0.4
"""Length that makes rotations comparable to displacements, m: half a view."""
_COMPLEXITY = 0.04
"""Directions along which normals give less than this share of the strongest
information are not observed. RTAB-Map's `Icp/PointToPlaneMinComplexity` is 0.02; the
edges of a window in a D435's depth pass that and move the camera along the wall."""
_NUMERICAL = 1e-6
"""Directions below this share of the strongest are rounding errors."""
_ICP_ROUNDS = 6
_ICP_GATE = 0.03
_ICP_POINTS = 3000
_RATIO = 0.85
"""Lowe's ratio test: distance of the best match over that of the second."""


class ConstraintKind(enum.StrEnum):
    """How a constraint was measured."""

    APPEARANCE = "appearance"
    GEOMETRY = "geometry"


@dataclass(frozen=True, eq=False)
class PoseConstraint(FrozenValue):
    """A measured pose of keyframe j in keyframe i.

    Attributes:
        i: Index of the older keyframe.
        j: Index of the newer one.
        kind: How it was measured.
        X_ij: Measured pose.
        information: (6, 6), of a step of X_ij (see `Poses`); zero along directions that
            are not observed.
        inliers: Matches or points used.
    """

    i: int
    j: int
    kind: ConstraintKind
    X_ij: RigidTransform
    information: FloatArray
    inliers: int

    @property
    def rank(self) -> int:
        """Directions observed, 0 to 6."""
        return int(np.linalg.matrix_rank(self.information, hermitian=True))


def floored(
    information: FloatArray, config: PoseGraphConfig, complexity: float = 0.0
) -> FloatArray:
    """Limits information: no direction is better than the sigmas of a constraint.

    Args:
        information: (6, 6) of rotation and displacement.
        config: `link_sigma` and `link_sigma_deg` are used.
        complexity: Directions with less than this share of the strongest are dropped.

    Returns:
        (6, 6).
    """
    scale = np.array([_LEVER] * 3 + [1.0] * 3)
    values, axes = np.linalg.eigh(information / np.outer(scale, scale))
    floor = config.link_sigma**2 + (np.deg2rad(config.link_sigma_deg) * _LEVER) ** 2
    kept = values > max(complexity * values[-1], 1e-9)
    capped = np.where(kept, 1.0 / (1.0 / np.where(kept, values, 1.0) + floor), 0.0)
    return np.asarray((axes * capped) @ axes.T * np.outer(scale, scale))


def constraint_by_appearance(
    a: Features,
    b: Features,
    intrinsics: CameraIntrinsics,
    config: PoseGraphConfig,
    ends: tuple[int, int],
) -> tuple[PoseConstraint | None, int]:
    """Matches corners, finds the pose by PnP and refines it.

    Args:
        a: Features of the older keyframe.
        b: Of the newer one.
        intrinsics: Of the camera.
        config: Thresholds and sigmas.
        ends: Indices of the two keyframes.

    Returns:
        The constraint, or None if too few matches agree, and the number of inliers.
    """
    if min(len(a.uv), len(b.uv)) < config.min_inliers:
        return None, min(len(a.uv), len(b.uv))
    matcher = cv2.BFMatcher.create(cv2.NORM_HAMMING)
    pairs = matcher.knnMatch(a.descriptors, b.descriptors, k=2)
    good = [p[0] for p in pairs if p[0].distance < _RATIO * p[1].distance]
    if len(good) < config.min_inliers:
        return None, len(good)
    first = np.array([match.queryIdx for match in good])
    second = np.array([match.trainIdx for match in good])
    cv2.setRNGSeed(1)
    found, turn, shift, inliers = cv2.solvePnPRansac(
        a.p_Cs[first],
        b.uv[second],
        intrinsics.matrix,
        None,
        reprojectionError=3.0,
        iterationsCount=200,
        confidence=0.999,
        flags=cv2.SOLVEPNP_EPNP,
    )
    count = 0 if inliers is None else len(inliers)
    if not found or count < max(config.min_inliers, len(good) // 4):
        return None, count
    X_ji = pose_of(np.concatenate([turn.ravel(), shift.ravel()]))
    kept = inliers.ravel()
    X_ij, information = _refine(
        X_ji.inverse(), a, b, first[kept], second[kept], intrinsics, config
    )
    constraint = PoseConstraint(
        *ends, ConstraintKind.APPEARANCE, X_ij, floored(information, config), count
    )
    return constraint, count


def _refine(
    X_ij: RigidTransform,
    a: Features,
    b: Features,
    first: FloatArray,
    second: FloatArray,
    intrinsics: CameraIntrinsics,
    config: PoseGraphConfig,
) -> tuple[RigidTransform, FloatArray]:
    """Minimises the reprojection error in both pictures and the difference in depth."""
    focal = np.array([intrinsics.fx, intrinsics.fy])
    information = np.zeros((6, 6))
    for _ in range(4):
        information[:] = 0.0
        slope = np.zeros(6)
        R = X_ij.rotation().matrix()
        # Points of b seen by camera a: the step moves them by R (v - p x a).
        moved = b.p_Cs[second] @ R.T + X_ij.translation()
        by_step = np.concatenate(
            [-R @ skew(b.p_Cs[second]), np.tile(R, (len(moved), 1, 1))], axis=2
        )
        # Points of a seen by camera b: they move the other way.
        back = (a.p_Cs[first] - X_ij.translation()) @ R
        back_step = np.concatenate(
            [skew(back), np.tile(-np.eye(3), (len(back), 1, 1))], 2
        )
        for points, jacobian, features, index in (
            (moved, by_step, a, first),
            (back, back_step, b, second),
        ):
            z = points[:, 2]
            residual = np.empty((len(z), 3))
            residual[:, :2] = intrinsics.project(points.T).T - features.uv[index]
            residual[:, 2] = z - features.p_Cs[index, 2]
            project = np.zeros((len(z), 3, 3))
            project[:, 0, 0], project[:, 1, 1] = focal[0] / z, focal[1] / z
            project[:, 0, 2] = -focal[0] * points[:, 0] / z**2
            project[:, 1, 2] = -focal[1] * points[:, 1] / z**2
            project[:, 2, 2] = 1.0
            sigma = np.empty((len(z), 3))
            sigma[:, :2] = config.pixel_sigma
            sigma[:, 2] = 0.004 * z**2  # A D435's: 0.08 px of disparity.
            rows = (project @ jacobian / sigma[:, :, None]).reshape(-1, 6)
            errors = (residual / sigma).ravel()
            weight = 1.0 / np.maximum(1.0, np.abs(errors) / 1.5)  # Huber's.
            information += rows.T @ (rows * weight[:, None]) / 2.0
            slope += rows.T @ (errors * weight) / 2.0
        step = -np.linalg.solve(information + 1e-6 * np.eye(6), slope)
        X_ij = X_ij @ pose_of(step)
    return X_ij, information


def constraint_by_geometry(
    a: PointGrid,
    b: PointGrid,
    X_ij: RigidTransform,
    intrinsics: CameraIntrinsics,
    config: PoseGraphConfig,
    ends: tuple[int, int],
) -> PoseConstraint | None:
    """Registers points to planes along the directions that the normals determine.

    Source: Chen and Medioni, "Object modelling by registration of multiple range
    images", 1992 (point to plane); Zhang et al., "On degeneracy of optimization-based
    state estimation problems", 2016 (steps along determined directions only).

    Args:
        a: Grid of the older keyframe.
        b: Of the newer one.
        X_ij: First guess; directions that are not determined keep its value.
        intrinsics: Of the camera.
        config: `link_sigma` and `link_sigma_deg` are used.
        ends: Indices of the two keyframes.

    Returns:
        The constraint, or None if the two overlap too little.
    """
    points = b.points[b.valid]
    points = points[:: max(1, len(points) // _ICP_POINTS)]
    scale = np.ones(6)
    information, to_center = np.zeros((6, 6)), np.eye(6)
    kept = np.zeros((6, 0))
    count, rms = 0, 0.0
    for _ in range(_ICP_ROUNDS):
        found = _correspond(a, points, X_ij, intrinsics)
        count = len(found[0])
        if count < max(100, len(points) // 10):
            return None
        p_j, n_j, e = found
        # About the points' centre, which decouples rotation and translation best.
        center = p_j.mean(axis=0)
        to_center[3:, :3] = -skew(center)
        scale[:3] = np.sqrt(np.mean(np.sum((p_j - center) ** 2, axis=1)))
        rows = np.hstack([np.cross(p_j - center, n_j), n_j]) / scale
        weight = 1.0 / np.maximum(1.0, np.abs(e) / (2.0 * np.median(np.abs(e)) + 1e-4))
        information = rows.T @ (rows * weight[:, None])
        values, axes = np.linalg.eigh(information)
        kept = axes[:, values > _COMPLEXITY * values[-1]]
        # The shortest step of the camera that solves the kept directions.
        to_kept = kept.T * scale @ to_center / scale
        kept_step = np.linalg.solve(
            kept.T @ information @ kept, kept.T @ (rows.T @ (e * weight))
        )
        step = -np.linalg.pinv(to_kept) @ kept_step / scale
        rms = float(np.sqrt(np.average(e**2, weights=weight)))
        X_ij = X_ij @ pose_of(step)
        if np.linalg.norm(step * scale) < 2e-5:
            break
    # A quarter of the points are independent, as for planes.
    determined = kept @ kept.T @ information @ kept @ kept.T
    information = determined * np.outer(scale, scale) / (4.0 * max(rms, 5e-4) ** 2)
    limited = to_center.T @ floored(information, config, _NUMERICAL) @ to_center
    return PoseConstraint(*ends, ConstraintKind.GEOMETRY, X_ij, limited, count)


def _correspond(
    a: PointGrid, points: FloatArray, X_ij: RigidTransform, intrinsics: CameraIntrinsics
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Finds the point of i on the same ray as each point of j.

    Returns:
        p_Cjs (n, 3), normals of the other points (n, 3) in j, and distances along them.
    """
    R = X_ij.rotation().matrix()
    moved = points @ R.T + X_ij.translation()
    x, y, z = moved.T
    z = np.maximum(z, 1e-3)
    column, row = intrinsics.project(np.stack([x, y, z])) / BLOCK
    height, width = a.valid.shape
    inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
    column, row = column[inside].astype(int), row[inside].astype(int)
    normals = a.normals[row, column]
    away = moved[inside] - a.points[row, column]
    distance = np.sum(normals * away, axis=1)
    near = np.linalg.norm(away, axis=1) < _ICP_GATE * (1.0 + z[inside])
    near &= (np.abs(distance) < _ICP_GATE) & normals.any(axis=1)
    return points[inside][near], normals[near] @ R, distance[near]
