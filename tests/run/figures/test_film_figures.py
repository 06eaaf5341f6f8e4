"""Figures of the film, against films whose figures are counted by hand."""

import numpy as np
import pytest
from pydrake.math import RigidTransform

from painter.run.figures.film_figures import (
    edge_distance,
    film_figures,
    mass_balance_error,
    overspray,
)
from painter.run.folder.values import Film


def make_film(thickness, paintable=None, **volumes):
    thickness = np.asarray(thickness, dtype=float)
    paintable = np.ones(thickness.shape, bool) if paintable is None else paintable
    landed = float(thickness.sum() * 0.1**2)
    volumes = {"sprayed": 2 * landed, "landed": landed, "missed": 0.0} | volumes
    return Film(
        thickness=thickness,
        kind=np.where(paintable, 1, 5).astype(np.uint8),
        truth_paintable=paintable,
        truth_keepout=~paintable,
        cell=0.1,
        x0=0.0,
        y0=0.0,
        **volumes,
    )


def test_coverage_counts_cells_at_80_and_50_percent():
    film = make_film([[100.0, 80.0, 79.0, 50.0, 49.0]])
    figures = film_figures(film, nominal=100.0, fan_width=0.1)
    assert figures["coverage"] == pytest.approx(2 / 5)
    assert figures["coverage_half"] == pytest.approx(4 / 5)


def test_variation_of_two_levels_is_half_their_difference_over_their_mean():
    film = make_film([[0.8, 1.2], [1.2, 0.8]])
    figures = film_figures(film, nominal=1.0, fan_width=0.1)
    assert figures["thickness_cv"] == pytest.approx(0.2)


def test_interior_leaves_out_cells_near_an_edge():
    thickness = np.full((9, 9), 0.5)
    thickness[3:6, 3:6] = 1.0
    # A cell n-th from the edge has its centre (n - 1/2) 0.1 m away: from the third on
    # at half of a 0.7 m fan or more there are 3 x 3.
    figures = film_figures(make_film(thickness), nominal=1.0, fan_width=0.7)
    assert figures["thickness_cv_interior"] == 0.0
    assert figures["thickness_cv"] > 0.1
    wide = film_figures(make_film(thickness), nominal=1.0, fan_width=1.2)
    assert wide["thickness_cv_interior"] is None


def test_edge_distance_is_to_the_side_of_the_next_cell():
    paintable = np.ones((1, 5), bool)
    np.testing.assert_allclose(edge_distance(paintable, 0.1), np.full((1, 5), 0.05))
    paintable = np.ones((7, 7), bool)
    assert edge_distance(paintable, 0.1)[3, 3] == pytest.approx(0.35)
    paintable[3, 3] = False
    assert edge_distance(paintable, 0.1)[3, 3] == 0.0


def test_overspray_is_what_landed_elsewhere():
    paintable = np.array([[True, True, False, False]])
    film = make_film([[3.0, 3.0, 1.0, 1.0]], paintable)
    assert overspray(film) == pytest.approx(2 / 8)
    figures = film_figures(film, nominal=3.0, fan_width=0.1)
    assert figures["keepout_paint"] == 1.0


def test_keepout_paint_counts_cells_at_10_percent():
    paintable = np.array([[True, False, False, False]])
    film = make_film([[100.0, 10.0, 9.0, 0.0]], paintable)
    figures = film_figures(film, nominal=100.0, fan_width=0.1)
    assert figures["keepout_paint"] == pytest.approx(1 / 3)


def test_blank_wall_has_no_keepout_figure():
    figures = film_figures(make_film([[1.0]]), nominal=1.0, fan_width=0.1)
    assert figures["keepout_paint"] is None


def test_nothing_sprayed_has_no_shares():
    film = make_film(np.zeros((2, 2)))
    assert overspray(film) is None
    assert mass_balance_error(film, 0.65) is None
    assert film_figures(film, nominal=1.0, fan_width=0.1)["thickness_cv"] is None


def test_mass_balance_compares_with_what_left_the_gun():
    film = make_film([[1.0]], sprayed=10.0, landed=6.0, missed=0.4)
    assert mass_balance_error(film, 0.65) == pytest.approx(0.1 / 10.0)
    assert mass_balance_error(film, 0.64) == pytest.approx(0.0, abs=1e-12)


def test_nominal_thickness_must_be_positive():
    with pytest.raises(ValueError, match=r"> 0 m, got 0\.0"):
        film_figures(make_film([[1.0]]), nominal=0.0, fan_width=0.1)


def test_only_cells_inside_the_robots_tile_count():
    shape = (4, 6)
    kind = np.ones(shape, dtype=np.uint8)
    kind[2, 3] = 5
    film = Film.on_tile(
        thickness=np.zeros(shape),
        kind=kind,
        paintable=kind == 1,
        cell=1.0,
        x0=-1.0,
        y0=-1.0,
        X_ST=RigidTransform([1.0, 0.0, 0.0]),
        tile_size=(3.0, 2.0),
        sprayed=0.0,
        landed=0.0,
        missed=0.0,
    )
    # The tile is x 1 to 4, y 0 to 2 in S: columns 2 to 4, rows 1 and 2.
    inside = np.zeros(shape, bool)
    inside[1:3, 2:5] = True
    np.testing.assert_array_equal(film.truth_paintable | film.truth_keepout, inside)
    np.testing.assert_array_equal(np.argwhere(film.truth_keepout), [[2, 3]])
