"""Film with shading against ray casting."""

import itertools

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix
from scipy.special import betainc

from painter.planning.film.deposition import half_axes, predicted_film
from painter.planning.film.film_model import FilmModel, Site
from painter.planning.film.spray_cone import SprayCone, SpraySurface
from tests.planning.film_cases import CELL, NOMINAL, RASTER, TIP, model, stroke, wall


def flat_surface():
    """The site's grid as a surface for rays."""
    site = model(wall()).site
    origin = np.full(2, -site.border * CELL)
    return SpraySurface(np.zeros(site.paintable.shape), cell=CELL, origin=origin)


def nozzle_over(place, standoff):
    """Pose in T of a square nozzle over a point (2,) of the wall."""
    R_TG = RotationMatrix(np.diag([1.0, -1.0, -1.0]))
    return RigidTransform(R_TG, [*place, standoff])


def test_on_a_plane_it_is_the_closed_form():
    dut = model(wall())
    strokes = [stroke(0.7, 0.3, 1.2), stroke(1.1, 1.9, 0.2, standoff=0.15, flow=0.4)]
    exact = predicted_film(strokes, dut.site.x, dut.site.y, tip=TIP) / NOMINAL
    # Cells are means across x here, values at their centres there: 1 cm of 25 cm.
    np.testing.assert_allclose(dut.film(strokes), exact, atol=0.012)


@pytest.mark.parametrize("standoff", [0.12, 0.30])
def test_no_paint_is_made_or_lost_on_steps(standoff):
    height = np.zeros((200, 200))
    height[:, 103:110] = 0.05
    height[:, 90:97] = -0.10
    mask = height == 0.0
    line = model(mask, height).line(1.0, standoff)
    landed = line.film.sum(axis=1) * CELL * NOMINAL
    dose = TIP.flow * TIP.transfer_efficiency / RASTER.speed
    np.testing.assert_allclose(landed, dose, rtol=1e-6)


def test_a_board_shades_the_wall_behind_it():
    """A ray over the edge of a board 5 cm high, from 30 cm, lands 1.2 times as far."""
    height = np.zeros((200, 200))
    height[:, 105:107] = 0.05  # x = 1.05 to 1.07 m, 5 to 7 cm from the spray axis.
    line = model(height == 0.0, height).line(1.0, 0.30)
    film = line.film[100]
    column = line.columns[0] - model(wall()).site.border
    shaded_to = 1.0 + 0.07 * 0.30 / 0.25
    first_lit = int(np.floor(shaded_to / CELL)) - column
    assert (film[107 - column : first_lit] == 0.0).all()
    assert film[first_lit + 1] > 0.0


def test_a_slanted_stroke_leaves_what_rays_along_it_leave():
    """The gun goes 1 to the right for 4 up, its fan level all the way."""
    slant, low, high = 0.25, 0.4, 1.2
    dut = model(wall())
    slanted = stroke(0.8, low, high, standoff=0.2)
    slanted = slanted.replace(end_T=np.array([0.8 + slant * (high - low), high]))
    film = dut.film([slanted])
    cone, surface = SprayCone(TIP, ray_count=4096), flat_surface()
    count = 160
    shares = np.linspace(0.0, 1.0, count + 1)[:, None]
    places = slanted.start_T + shares * (slanted.end_T - slanted.start_T)
    landed = np.zeros(film.size)
    for here, there in itertools.pairwise(places):
        rays = cone.rays(*(nozzle_over(place, 0.2) for place in (here, there)))
        cells, volumes, _ = surface.land(*rays)
        landed += np.bincount(cells, weights=volumes, minlength=film.size)
    dose = TIP.flow * TIP.transfer_efficiency * slanted.length / slanted.speed
    exact = landed.reshape(film.shape) * dose / (count * 4096 * CELL**2 * NOMINAL)
    # Rays share their paint with the next cells: 1 cm of a fan of 17 cm.
    np.testing.assert_allclose(film, exact, atol=0.05 * film.max())
    assert film.sum() == pytest.approx(exact.sum(), rel=1e-3)


def test_a_line_is_the_same_on_some_rows_as_on_all():
    height = np.zeros((200, 200))
    height[60:140:3, 90:104] = 0.05
    dut = model(height == 0.0, height)
    rows = slice(70, 95)
    for slant in (0.0, 1e-6, 0.2):
        whole, some = dut.line(0.9, 0.2, slant), dut.line(0.9, 0.2, slant, rows)
        film = np.zeros(height.shape + 2 * np.array(dut.site.border))
        film[:, slice(*whole.columns)] = whole.film
        film[rows, slice(*some.columns)] -= some.film[some.own(rows)]
        assert np.abs(film[rows]).max() == 0.0
        # Half the fan's thickness is that of the same line, too.
        first = some.columns[0] - whole.columns[0]
        cut = whole.thickness[rows, first : first + some.film.shape[1]]
        np.testing.assert_array_equal(some.thickness[some.own(rows)], cut)


@pytest.mark.parametrize("slant", [0.0, 0.1])
@pytest.mark.parametrize("x_line", [-1.0, 3.0])
def test_a_line_beside_the_site_leaves_nothing_on_it(x_line, slant):
    assert not model(wall()).line(x_line, 0.3, slant).film.any()


def test_nearer_and_weaker_leaves_a_narrower_film_as_thick():
    near = model(wall()).film([stroke(1.0, 0.0, 2.0, standoff=0.12, flow=0.4)])
    far = model(wall()).film([stroke(1.0, 0.0, 2.0)])
    row = near.shape[0] // 2
    assert near[row].max() == pytest.approx(far[row].max(), rel=0.03)  # Cells of 1 cm.
    assert near[row].sum() == pytest.approx(0.4 * far[row].sum(), rel=1e-6)
    assert half_axes(TIP, 0.12)[0] == pytest.approx(0.05)


def test_a_recess_catches_the_end_of_a_stroke_farther_out():
    depth, standoff, end = 0.10, RASTER.standoff, 0.5
    mask = np.zeros((100, 60), dtype=bool)
    mask[:, 0] = True
    site = Site.of_tile(mask, CELL, np.full(mask.shape, -depth))
    dut = FilmModel(site, tip=TIP, speed=RASTER.speed, nominal=1e-4)
    line = dut.line(0.305, standoff)
    share = 1.0 - dut.below(line, slice(0, len(site.y)), end)
    # Under the axis the fan is as thick as it has become on its longer way.
    _, b = half_axes(TIP, standoff + depth)
    passed = betainc(
        TIP.beta2, TIP.beta2, 0.5 + 0.5 * np.clip((end - site.y) / b, -1, 1)
    )
    column = site.border + 30 - line.columns[0]
    np.testing.assert_allclose(
        share[site.border : -site.border, column],
        passed[site.border : -site.border],
        atol=2e-3,
    )
    rows = dut.rows(end, end, standoff)
    assert site.y[rows.stop - 1] >= end + b - CELL
