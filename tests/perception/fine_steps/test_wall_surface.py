"""The wall's own surface on shapes given in closed form."""

import numpy as np
import pytest
from scipy.interpolate import BSpline

from perception.fine_steps.spline_surface import SplineSurface
from perception.fine_steps.wall_surface import fit_wall_surface, neighbour_noise

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


DOOR = (X > 1.0) & (X < 1.9) & (Y < 1.9)
WINDOW = (X > 0.3) & (X < 0.7) & (Y > 1.0) & (Y < 1.6)


@pytest.mark.parametrize("along", ["x", "y", "both"])
@pytest.mark.parametrize(("length", "height"), [(0.7, 0.010), (0.9, 0.020)])
def test_waves_beside_a_door_and_a_window_are_followed(along, length, height):
    # Before, the surface climbed down into the door, which is as large as the wall.
    k = 2.0 * np.pi / length
    waves = {"x": np.sin(k * X + 1.0), "y": np.sin(k * Y + 1.0)}
    waves["both"] = waves["x"] * waves["y"]
    true = height * waves[along]
    off = np.where(DOOR, -0.07, 0.0) - np.where(WINDOW, 0.12, 0.0)
    surface = fit(true, off)
    error = np.abs(surface.height - true)[~DOOR & ~WINDOW]
    assert np.quantile(error, 0.99) < 0.003
    # Beside the door is a strip of 10 cm alone; 5 mm is the least step.
    assert (error > 0.005).mean() < 0.005


@pytest.mark.parametrize("turn_deg", [-30.0, 20.0, 40.0])
@pytest.mark.parametrize("slant", [0.0, 0.3])
def test_two_walls_that_meet_in_the_tile_have_each_their_normals(turn_deg, slant):
    across = np.hypot(1.0, slant)
    beyond = (X + slant * Y - 1.2 - slant) / across  # Distance from the edge.
    true = np.tan(np.radians(turn_deg)) * np.maximum(0.0, beyond)
    surface = fit(true, np.where(WINDOW, -0.12, 0.0))
    error = np.abs(surface.height - true)
    # In the one cell that the edge runs through both are right.
    assert error[np.abs(beyond) > CELL].max() < 1.5e-3
    tilt = np.degrees(np.arccos(surface.normals[..., 2]))
    np.testing.assert_allclose(tilt[beyond < -0.1], 0.0, atol=0.6)
    np.testing.assert_allclose(tilt[beyond > 0.1], abs(turn_deg), atol=0.6)


def wedge():
    """A board that leans on the wall: without a step below, with steps at its sides."""
    on = (abs(X - 1.3) < 0.4) & (Y > 0.5) & (Y < 1.3)
    return np.where(on, 0.4 * (Y - 0.5), 0.0)


def square_corner():
    """A wall at right angles, 2 m deep, that fills a few cells only."""
    return np.where(X > 1.7, 40.0 * (X - 1.7), 0.0)


def moulding():
    """A rounded strip 2 cm high and 6 cm wide across the wall."""
    return 0.02 * np.sqrt(np.maximum(0.0, 1.0 - ((Y - 1.23) / 0.03) ** 2))


@pytest.mark.parametrize("thing", [wedge, square_corner, moulding])
def test_what_is_no_wall_in_a_corner_does_not_bend_the_surface(thing):
    height = fit(0.0 * X, thing()).height
    assert np.abs(height[thing() == 0.0]).max() < 2e-3  # Well below the least step.


def test_gentle_moulding_is_followed():
    true = 0.03 * np.exp(-0.5 * ((Y - 1.0) / 0.3) ** 2)
    assert np.abs(fit(true).height - true).max() < 1.5e-3


def test_splines_of_a_facade_solve_as_dense_least_squares_do():
    rng = np.random.default_rng(2)
    y, x = np.linspace(0.0, 1.3, 27), np.linspace(0.0, 0.9, 19)
    within = np.array([[0.0, 1.3], [0.0, 0.9]])
    dut = SplineSurface(y, x, within=within, knot=0.2)
    weight, values = rng.random((2, 27, 19))
    height = dut.heights(dut.solve(weight, values, 0.1))

    def basis(at, high):
        count = int(np.ceil(high / 0.2))
        knots = high / count * np.arange(-3, count + 4)
        inside = np.minimum(at, high - 1e-9)
        return BSpline.design_matrix(inside, knots, 3).toarray()

    along, across = basis(y, 1.3), basis(x, 0.9)
    design = np.kron(along, across)
    rough = [np.diff(np.eye(part.shape[1]), n=3, axis=0) for part in (along, across)]
    rough = [
        np.kron(rough[0], np.eye(across.shape[1])),
        np.kron(np.eye(along.shape[1]), rough[1]),
    ]
    root = np.sqrt(weight.ravel())
    rows = np.concatenate([root[:, None] * design, *(0.1**0.5 * r for r in rough)])
    right = np.zeros(len(rows))
    right[: root.size] = root * values.ravel()
    solved, *_ = np.linalg.lstsq(rows, right, rcond=None)
    # The small ridge that keeps the band regular is 1e-6 of a cell's weight.
    np.testing.assert_allclose(height.ravel(), design @ solved, atol=1e-5)


def test_splines_of_a_long_wall_are_those_of_a_high_one_turned():
    rng = np.random.default_rng(3)
    long, short = np.linspace(0.0, 2.0, 40), np.linspace(0.0, 0.5, 11)
    within = np.array([[0.0, 0.5], [0.0, 2.0]])
    weight, values = rng.random((2, 11, 40))
    wide = SplineSurface(short, long, within=within, knot=0.2)
    high = SplineSurface(long, short, within=within[::-1], knot=0.2)
    np.testing.assert_allclose(
        wide.heights(wide.solve(weight, values, 1.0)),
        high.heights(high.solve(weight.T, values.T, 1.0)).T,
        atol=1e-9,
    )
    coefficients = wide.solve(weight, values, 1.0)
    np.testing.assert_allclose(
        wide.heights_at(short, long, coefficients), wide.heights(coefficients)
    )
