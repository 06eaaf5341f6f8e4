"""Prior of an arm's pose, and the directions in which measurements improve it."""

import numpy as np

from perception.ground import FloatArray
from perception.mapping.config import PoseGraphConfig


def prior_sigmas(config: PoseGraphConfig) -> FloatArray:
    """Returns (6,) standard deviations of an arm's pose, mount error included."""
    turn = np.deg2rad(np.hypot(config.arm_sigma_deg, config.mount_sigma_deg))
    shift = np.hypot(config.arm_sigma, config.mount_sigma)
    return np.array([turn] * 3 + [shift] * 3)


def observed_directions(information: FloatArray, config: PoseGraphConfig) -> FloatArray:
    """Finds the directions that constraints and planes determine.

    A direction is observed if the information reduces the arm's standard deviation
    along it to `observed_ratio` of the prior.

    Args:
        information: (6, 6) of one keyframe, from constraints and planes.
        config: Sigmas of arm and mount.

    Returns:
        (6, 6) projection onto the observed directions, of steps in units of
        `prior_sigmas`; symmetric.
    """
    sigma = prior_sigmas(config)
    values, axes = np.linalg.eigh(information * np.outer(sigma, sigma))
    kept = axes[:, values > 1.0 / config.observed_ratio**2 - 1.0]
    return np.asarray(kept @ kept.T)


def information_of(sigma: float, sigma_deg: float) -> FloatArray:
    """Returns (6, 6) of a step with these sigmas, m and deg."""
    turn = np.deg2rad(sigma_deg)
    return np.diag([turn**-2.0] * 3 + [sigma**-2.0] * 3)
