"""Film under a gun that is not square: planned and sprayed against the closed form.

A ray that goes xi to the side and eta up for 1 ahead, in G, carries the flow

    f(xi, eta) = (1 - u²)^(gamma - 1/2) (1 - s²)^(beta2 - 1)
                 / (A B beta(1/2, beta2) beta(1/2, gamma + 1)),
    u = xi / A,  s = eta / (B sqrt(1 - u²)),

with A and B the fan's half axes 1 m ahead. On a plane of normal n, at r from the
nozzle, an area dA takes in d(xi) d(eta) = |n r| / r_z³ dA of them (r_z along the spray
axis): tilted, the fan is wider on one side and thinner there.
"""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from scipy.special import beta

from painter.planning.config import TipConfig
from painter.planning.film.deposition import half_axes
from painter.planning.film.film_model import FilmModel, Site
from painter.planning.film.spray_cone import SprayCone, SpraySurface

TIP = TipConfig()
CELL = 0.01
STANDOFF = 0.3
SQUARE = RotationMatrix(np.diag([1.0, -1.0, -1.0]))
SPEED, NOMINAL = 0.6, 1e-4


def flow(xi, eta):
    """Share of the flow by slope, f above."""
    a, b = half_axes(TIP, 1.0)
    wide = np.clip(1.0 - (xi / a) ** 2, 1e-12, None)
    thick = np.clip(1.0 - (eta / b) ** 2 / wide, 0.0, None)
    inside = np.abs(xi) < a
    return (
        inside
        * wide ** (TIP.gamma - 0.5)
        * thick ** (TIP.beta2 - 1.0)
        / (a * b * beta(0.5, TIP.beta2) * beta(0.5, TIP.gamma + 1.0))
    )


def side_flow(xi):
    """The same over all eta: (1 - u²)^gamma / (A beta(1/2, gamma + 1))."""
    a, _ = half_axes(TIP, 1.0)
    wide = np.clip(1.0 - (xi / a) ** 2, 0.0, None)
    return wide**TIP.gamma / (a * beta(0.5, TIP.gamma + 1.0))


@pytest.mark.parametrize(
    ("roll", "pitch"), [(0.0, 0.0), (0.0, 0.35), (0.35, 0.0), (-0.25, 0.2)]
)
def test_sprayed_film_is_that_of_a_tilted_gun(roll, pitch):
    """Roll is about the fan's long axis, pitch about its short one, rad."""
    R_SG = RotationMatrix(RollPitchYaw(roll, pitch, 0.0)) @ SQUARE
    aim = np.array([0.5, 0.5, 0.0])
    p_SG = aim - STANDOFF * R_SG.col(2)
    X_SG = RigidTransform(R_SG, p_SG)
    surface = SpraySurface(np.zeros((100, 100)), cell=CELL, origin=np.zeros(2))
    count = 16384
    rays = SprayCone(TIP, ray_count=count).rays(X_SG, X_SG)
    cells, shares, missed = surface.land(*rays)
    assert missed == 0
    film = np.bincount(cells, weights=shares, minlength=10_000).reshape(100, 100)
    film /= count

    fine = 0.1 * CELL
    places = (np.arange(1000) + 0.5) * fine
    xs, ys = np.meshgrid(places, places)
    r_S = np.stack([xs, ys, np.zeros_like(xs)], axis=-1) - p_SG
    r_G = r_S @ R_SG.matrix()
    ahead = r_G[..., 2]
    rate = flow(r_G[..., 0] / ahead, r_G[..., 1] / ahead) * p_SG[2] / ahead**3
    exact = rate * fine**2
    assert exact.sum() == pytest.approx(1.0, abs=1e-3)
    # Where on average, in x and y: pitch throws paint far out on one side.
    for axis, at in ((0, places), (1, places)):
        mean = np.sum(film.sum(axis=axis) * (np.arange(100) + 0.5) * CELL)
        assert mean == pytest.approx(np.sum(exact.sum(axis=axis) * at), abs=1e-4)
    # By strips of 2 cm across each axis. Rays share with neighbours half a cell away.
    for axis in (0, 1):
        strips = film.sum(axis=axis).reshape(50, 2).sum(axis=1)
        wanted = exact.sum(axis=axis).reshape(50, 20).sum(axis=1)
        np.testing.assert_allclose(strips, wanted, atol=0.06 * wanted.max())


@pytest.mark.parametrize("slope", [0.0, 0.15, -0.3])
def test_planned_film_is_that_of_a_wall_askew_to_the_fan(slope):
    """A plane that rises by `slope` to the right, before a gun square to T.

    The ray of slope xi meets it at x = xi (d - slope x). What it leaves on the other
    side, in the film of an endless stroke, is f over all eta times d(xi)/dx.
    """
    shape = (40, 100)
    x = (np.arange(shape[1]) + 0.5) * CELL - 0.5
    height = np.broadcast_to(slope * x, shape)
    # As what stays clean: a wall's own unevenness is not planned for.
    site = Site.of_tile(np.zeros(shape, dtype=bool), CELL, height)
    dut = FilmModel(site, tip=TIP, speed=SPEED, nominal=NOMINAL)
    line = dut.line(0.5, STANDOFF)
    film = np.zeros(site.paintable.shape[1])
    film[slice(*line.columns)] = line.film[site.border + 20]
    film = film[site.border : -site.border]
    distance = STANDOFF - slope * x
    xi = x / distance
    dose = TIP.flow * TIP.transfer_efficiency / (SPEED * NOMINAL)
    exact = dose * side_flow(xi) * STANDOFF / distance**2
    # Columns have flat tops: a ray lands up to half a column's step too early.
    np.testing.assert_allclose(film, exact, atol=0.03 * exact.max())
    assert film.sum() * CELL == pytest.approx(dose, rel=1e-6)
    # More of it, and thinner, lies on the side that falls away.
    if slope > 0.0:
        assert np.sum(film * x) < 0.0
