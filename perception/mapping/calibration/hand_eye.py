"""Hand-eye calibration: the pose of the camera on the arm.

Uses pictures of a wall, best with a box on it, taken in many orientations of the wrist:
the mount of the pose graph, with a wide prior.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw

from perception.depth_camera.depth import CameraIntrinsics
from perception.errors import PerceptionError
from perception.ground import FloatArray, FrozenValue
from perception.io.frames import Frame
from perception.mapping.config import MapperConfig
from perception.mapping.keyframes.keyframe import find_features, make_keyframe
from perception.mapping.pose_graph.keyframe_graph import KeyframeGraph
from perception.mapping.pose_graph.observability import information_of

FEWEST = 8
"""Fewest pictures of a calibration."""
CONFIG = MapperConfig(
    arm_sigma=0.0003,
    arm_sigma_deg=0.02,
    mount_sigma=0.004,
    mount_sigma_deg=2.0,
    base_sigma=1e-6,
    base_sigma_deg=1e-4,
    max_links=4,
)
"""The base stands still and the arm is good; the mount is made to some mm and deg.
Where the pictures do not halve that it stays nominal: errors that they share, such as
the sensor's ripple, are then as large."""
_ROUNDS = 3
"""Registrations, each with the mount found before."""


class CalibrationError(PerceptionError):
    """The pictures do not determine the mount; the message gives the reason."""


@dataclass(frozen=True, eq=False)
class HandEye(FrozenValue):
    """A calibrated mount.

    Attributes:
        X_NC: Pose of the camera in the nominal camera frame of the arm's model.
        sigma: (6,) standard deviations of its rotation vector, rad, and translation, m;
            the prior's where it is not observed.
        observed: (6,) share of each that the pictures determine, 0 to 1; the rest is
            left at zero.
        pictures: Number used.
        residual: Root mean square residual, m (planes of a wall) or px (corners of a
            board).
    """

    X_NC: RigidTransform
    sigma: FloatArray
    observed: FloatArray
    pictures: int
    residual: float

    def report(self) -> dict[str, Any]:
        """Returns the figures as JSON values, deg and m."""
        turn = RollPitchYaw(self.X_NC.rotation()).vector()
        return {
            "pictures": self.pictures,
            "rotation_deg": np.degrees(turn).round(5).tolist(),
            "translation_m": self.X_NC.translation().round(7).tolist(),
            "rotation_sigma_deg": np.degrees(self.sigma[:3]).round(5).tolist(),
            "translation_sigma_m": self.sigma[3:].round(7).tolist(),
            "observed": self.observed.round(3).tolist(),
            "residual": float(f"{self.residual:.4g}"),
        }


def calibrate_on_wall(
    frames: Sequence[Frame],
    intrinsics: CameraIntrinsics,
    config: MapperConfig = CONFIG,
) -> HandEye:
    """Finds the mount from pictures of a scene that does not move.

    Args:
        frames: Pictures with the nominal poses of the arm's model.
        intrinsics: Of the camera.
        config: Sigmas and thresholds.

    Raises:
        CalibrationError: There are too few pictures, or they show no plane.
    """
    usable = [frame for frame in frames if frame.X_WC is not None]
    if len(usable) < FEWEST:
        raise CalibrationError(
            f"{len(usable)} pictures have a pose by the arm, {FEWEST} are needed.",
            code="PNT-CALIBRATE-002",
        )
    keyframes = [
        make_keyframe(
            frame, number, find_features(frame, intrinsics, config), intrinsics, config
        )
        for number, frame in enumerate(usable)
    ]
    if sum(bool(keyframe.planes) for keyframe in keyframes) < FEWEST:
        raise CalibrationError(
            f"fewer than {FEWEST} pictures show a plane: point the camera at a wall.",
            code="PNT-CALIBRATE-003",
        )
    mount = RigidTransform()
    for _ in range(_ROUNDS):
        graph = KeyframeGraph.empty(intrinsics, config)
        for keyframe in keyframes:
            assert keyframe.X_WN is not None  # `usable` has no others.
            graph = graph.extended(keyframe, keyframe.X_WN @ mount)
        solution = graph.solved()
        mount = solution.mount
    estimate = solution.estimate
    away = [
        plane[:3] @ (estimate.X_WC.R[s.k] @ s.sight.center + estimate.X_WC.p[s.k])
        - plane[3]
        for s in graph.sightings
        for plane in [estimate.planes[s.plane]]
    ]
    observed = np.clip(np.diag(estimate.mount_observed), 0.0, 1.0)
    prior = np.diag(information_of(config.mount_sigma, config.mount_sigma_deg)) ** -0.5
    found = np.sqrt(np.diag(estimate.mount_covariance))
    return HandEye(
        X_NC=mount,
        sigma=np.where(observed > 0.5, found, prior),
        observed=observed,
        pictures=len(keyframes),
        residual=float(np.sqrt(np.mean(np.square(away)))),
    )
