"""The wall's own surface on shapes given in closed form."""

import numpy as np
import pytest

from perception.wall_surface import fit_wall_surface, neighbour_noise

CELL = 0.01
NOISE = 0.0005
X, Y = np.meshgrid(*[(np.arange(200) + 0.5) * CELL] * 2)


def fit(true, off=0.0, *, seed=0):
    """Fits to a surface with noise; `off` is what stands before it."""
    rng = np.random.default_rng(seed)
    depth = true + off + rng.normal(0.0, NOISE, X.shape)
    return fit_wall_surface(depth, np.isfinite(depth), cell=CELL, rng=rng)


@pytest.mark.parametrize(
    "true",
    [
        0.0 * X,
        0.03 * (X - 1.0) - 0.02 * Y,  # Tilt
        0.02 * (X - 1.0) * (Y - 1.0),  # Twist
        0.02 * ((X - 1.0) ** 2 + (Y - 1.0) ** 2),  # Bulge, 4 cm deep
        0.008 * np.sin(2.0 * np.pi * X),  # Waves of 1 m
    ],
    ids=["flat", "tilt", "twist", "bulge", "waves"],
)
def test_even_walls_are_followed_within_a_millimetre(true):
    surface = fit(true)
    assert np.abs(surface.height - true).max() < 1e-3
    slope_y, slope_x = np.gradient(true, CELL)
    normals = np.stack([-slope_x, -slope_y, np.ones_like(true)], axis=-1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    inner = (slice(10, -10),) * 2
    cosine = np.sum(surface.normals * normals, axis=-1)[inner]
    # A millimetre over half a knot's distance is 8 mrad; noise adds little.
    assert np.degrees(np.arccos(np.minimum(cosine, 1.0))).max() < 0.6


def test_plate_and_door_are_bridged_and_not_climbed():
    plate = np.where((abs(X - 0.5) < 0.1) & (abs(Y - 0.5) < 0.1), 0.010, 0.0)
    door = np.where((X > 1.0) & (X < 1.9) & (Y < 1.9), -0.020, 0.0)
    surface = fit(0.0 * X, plate + door)
    assert np.abs(surface.height).max() < 1e-3


def test_surface_reaches_where_nothing_was_seen():
    true = 0.01 * (X - 1.0) ** 2
    unseen = np.where((abs(X - 1.0) < 0.3) & (abs(Y - 1.0) < 0.3), np.nan, 0.0)
    assert np.abs(fit(true, unseen).height - true).max() < 1e-3


def test_noise_is_measured_in_spite_of_steps_and_slopes():
    rng = np.random.default_rng(1)
    depth = 0.05 * X + np.where(X > 1.0, 0.1, 0.0) + rng.normal(0.0, 0.002, X.shape)
    # 40000 differences give the median of their size to about 1 %.
    assert neighbour_noise(depth, np.ones(X.shape, bool)) == pytest.approx(
        0.002, rel=0.05
    )


def test_nothing_seen_is_refused():
    with pytest.raises(ValueError, match="no cell of the wall has a depth"):
        fit_wall_surface(
            np.full((9, 9), np.nan),
            np.ones((9, 9), bool),
            cell=CELL,
            rng=np.random.default_rng(0),
        )
