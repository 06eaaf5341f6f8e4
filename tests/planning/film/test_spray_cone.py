"""Rays against the fan's closed form, and shadows against straight lines."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix

from painter.planning.config import TipConfig
from painter.planning.film.spray_cone import SprayCone, SpraySurface

TIP = TipConfig()
CELL = 0.01
N = 100
# Square on the surface: fan along S x, spray along -z.
R_SG = RotationMatrix(np.diag([1.0, -1.0, -1.0]))


def gun(x, y, z=0.30, R=R_SG):
    return RigidTransform(R, [x, y, z])


def surface(height=None, origin=(0.0, 0.0)):
    height = np.zeros((N, N)) if height is None else height
    return SpraySurface(height, cell=CELL, origin=np.array(origin))


def landed(dut, rays):
    """Shares of all rays, (ny, nx), and the share that missed."""
    cells, shares, missed = dut.land(*rays)
    count = rays[0].shape[1]
    film = np.bincount(cells, weights=shares, minlength=np.prod(dut.shape))
    return film.reshape(dut.shape) / count, missed / count


@pytest.mark.parametrize("gamma", [1.0, 2.0])
def test_rays_have_the_fans_moments(gamma):
    """E[u²] = 1 / (2 gamma + 3), E[y²] = b² E[s²] E[1 - u²]; both axes symmetric."""
    cone = SprayCone(TipConfig(gamma=gamma), ray_count=4096)
    x, y, z = cone.directions_G * TIP.fan_distance
    u2 = 1.0 / (2.0 * gamma + 3.0)
    s2 = 1.0 / (2.0 * TIP.beta2 + 1.0)
    assert np.mean((x / 0.125) ** 2) == pytest.approx(u2, rel=2e-3)
    assert np.mean((y / 0.025) ** 2) == pytest.approx(s2 * (1.0 - u2), rel=5e-3)
    assert np.mean(x) == pytest.approx(0.0, abs=1e-6)
    assert np.mean(y) == pytest.approx(0.0, abs=1e-5)
    np.testing.assert_allclose(z, TIP.fan_distance)


@pytest.mark.parametrize("z", [0.30, 0.15])
def test_footprint_scales_with_distance(z):
    cone = SprayCone(TIP)
    film, missed = landed(surface(), cone.rays(gun(0.5, 0.5, z), gun(0.5, 0.5, z)))
    assert missed == 0.0 and film.sum() == pytest.approx(1.0, abs=1e-12)
    rows, columns = np.nonzero(film)
    # Half axes, and one cell of sharing with the neighbours.
    half_width = 0.125 * z / 0.30
    assert abs((columns.max() - columns.min() + 1) * CELL - 2 * half_width) < 3 * CELL
    assert rows.max() - rows.min() + 1 <= 2 * 0.025 * z / 0.30 / CELL + 3


def test_paint_is_spread_evenly_along_a_long_motion():
    cone = SprayCone(TIP, ray_count=4096)
    film, _ = landed(surface(), cone.rays(gun(0.5, 0.2), gun(0.5, 0.8)))
    along = film.sum(axis=1)[25:75]
    # 68 rays a row, each shared among three rows.
    np.testing.assert_allclose(along, CELL / 0.6, rtol=0.04)


def test_volume_is_kept_on_a_rugged_surface():
    rng = np.random.default_rng(2)
    height = rng.choice([0.0, 0.004, 0.08, -0.1, np.nan], size=(N, N))
    cone = SprayCone(TIP)
    tilted = R_SG @ RotationMatrix(RollPitchYaw(0.2, -0.3, 0.1))
    rays = cone.rays(gun(0.9, 0.5), gun(0.9, 0.55, 0.28, tilted))
    film, missed = landed(surface(height), rays)
    assert film.sum() + missed == pytest.approx(1.0, abs=1e-12)
    assert np.all(film >= 0.0) and film[np.isnan(height)].sum() == 0.0


def test_a_box_shades_what_is_behind_it():
    """A ray over the edge at x = 0.55, 0.1 m up, meets the wall at 0.575 (0.3 up)."""
    height = np.zeros((N, N))
    height[:, 53:55] = 0.1
    cone = SprayCone(TIP, ray_count=4096)
    film, _ = landed(surface(height), cone.rays(gun(0.5, 0.45), gun(0.5, 0.55)))
    flat, _ = landed(surface(), cone.rays(gun(0.5, 0.45), gun(0.5, 0.55)))
    columns, flat_columns = film.sum(axis=0), flat.sum(axis=0)
    assert columns[55:57].sum() == 0.0
    # Beyond the shadow and left of the box as on a flat wall; the box has the rest.
    np.testing.assert_allclose(columns[59:], flat_columns[59:], atol=1e-4)
    np.testing.assert_allclose(columns[:51], flat_columns[:51], atol=1e-12)
    # Its rays span 0.53 (at its foot) to 0.575 on the wall behind it: by quantiles.
    foot = cone.directions_G[0] * 0.3 + 0.5
    caught = np.mean((foot > 0.53) & (foot < 0.575))
    assert columns[53:55].sum() == pytest.approx(caught, abs=2e-3)


def test_rays_that_meet_a_side_land_on_the_obstacle():
    """All rays right of the axis meet the wall of a cliff close by."""
    height = np.zeros((N, N))
    height[:, 50:] = 0.29
    cone = SprayCone(TIP, ray_count=1024)
    film, _ = landed(surface(height), cone.rays(gun(0.4999, 0.5), gun(0.4999, 0.5)))
    assert film[:, 50:].sum() == pytest.approx(0.5, abs=2e-3)
    # Only the 1 cm under the nozzle reaches its top, within 4 mm of the edge.
    assert film[:, 51:].sum() < 0.01


def test_no_paint_crosses_a_step():
    """Half the fan on a sill 5 cm high, gun over its edge: two even halves."""
    height = np.zeros((N, N))
    height[:, :50] = 0.05
    cone = SprayCone(TIP, ray_count=1024)
    film, _ = landed(surface(height), cone.rays(gun(0.5, 0.5), gun(0.5, 0.5)))
    assert film[:, :50].sum() == pytest.approx(0.5, abs=1e-12)


def test_rays_beyond_the_grid_and_over_holes_miss():
    cone = SprayCone(TIP, ray_count=1024)
    film, missed = landed(surface(), cone.rays(gun(0.0, 0.5), gun(0.0, 0.5)))
    assert missed == pytest.approx(0.5, abs=1e-12)
    height = np.zeros((N, N))
    height[:, 50:] = np.nan
    film, missed = landed(surface(height), cone.rays(gun(0.5, 0.5), gun(0.5, 0.5)))
    assert missed == pytest.approx(0.5, abs=1e-12)
    assert film.sum() == pytest.approx(0.5, abs=1e-12)


@pytest.mark.parametrize("x", [5.0, -5.0])
def test_far_off_all_rays_miss(x):
    cone = SprayCone(TIP)
    film, missed = landed(surface(), cone.rays(gun(x, 0.5), gun(x, 0.5)))
    assert missed == 1.0 and film.sum() == 0.0


def test_a_gun_that_looks_away_misses():
    cone = SprayCone(TIP)
    away = gun(0.5, 0.5, R=RotationMatrix())
    film, missed = landed(surface(), cone.rays(away, away))
    assert missed == 1.0 and film.sum() == 0.0


@pytest.mark.parametrize(
    "bad",
    [
        {"height": np.full((3, 3), np.nan)},
        {"height": np.zeros(3)},
        {"cell": 0.0},
        {"origin": np.zeros(3)},
    ],
)
def test_bad_surfaces_are_refused(bad):
    good = {"height": np.zeros((3, 3)), "cell": 0.01, "origin": np.zeros(2)}
    with pytest.raises(ValueError, match="must be"):
        SpraySurface(**(good | bad))
