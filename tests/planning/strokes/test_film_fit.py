"""Fitted strokes against the bounds asked."""

import math

import numpy as np
import pytest

from painter.planning.config import RasterConfig
from painter.planning.film.deposition import mean_film
from painter.planning.film.film_cost import FilmCost, stroke_cost
from painter.planning.film.film_model import FilmModel, Site
from painter.planning.strokes.cut_in import best_levels
from painter.planning.strokes.film_fit import LEAST_FLOW, FilmFit
from painter.planning.strokes.raster import fitted_strokes, plan_strokes
from painter.planning.strokes.spans import Span
from painter.planning.strokes.spray_settings import SpraySettings
from tests.planning.film_cases import (
    CELL,
    NOMINAL,
    RASTER,
    SPRAY,
    TIP,
    model,
    stroke,
    wall,
)


def figures(mask, strokes, height=None):
    dut = model(mask, height)
    film, site = dut.film(strokes), dut.site
    on, off = film[site.paintable], film[site.keepout]
    return {
        "coverage": np.mean(on >= 0.8),
        "overspray": 1.0 - on.sum() / film.sum(),
        "cv": on.std() / on.mean(),
        "keepout": np.mean(off >= 0.1) if off.size else 0.0,
    }


def test_a_slanted_stick_is_cut_in_along_its_sides():
    """A stick 4 cm wide and high that goes 1 to the right for 5 up.

    From 12 cm the film falls from covered to unpainted in half the fan's half width,
    2.5 cm: with a cell on either side no more than 4 cm stays bare on average.
    Upright strokes would end in stairs, 14 cm wide.
    """
    y, x = np.mgrid[0:200, 0:200] * CELL + 0.5 * CELL
    stick = (np.abs(x - 0.9 - 0.2 * (y - 1.0)) < 0.02) & (np.abs(y - 1.0) < 0.5)
    height = np.where(stick, 0.04, 0.0)
    strokes = plan_strokes(~stick, CELL, SPRAY, height=height)
    slants = [
        (s.end_T[0] - s.start_T[0]) / (s.end_T[1] - s.start_T[1]) for s in strokes
    ]
    assert sum(abs(slant - 0.2) < 0.05 for slant in slants) >= 2
    dut = model(~stick, height)
    film = dut.film(strokes)
    inner = slice(dut.site.border, -dut.site.border)
    bare = (film < 0.8)[inner, inner] & ~stick & (np.abs(y - 1.0) < 0.4)
    bare &= np.abs(x - 0.9 - 0.2 * (y - 1.0)) < 0.15
    assert bare.sum() * CELL**2 / (2 * 0.8) <= 0.04
    # Of four cells across the stick about one gets overspray.
    assert figures(~stick, strokes, height)["keepout"] <= 0.30


class PlainFit(FilmFit):
    """Weighs the whole site anew for every step, whether it was tried before or not."""

    def worth(self, spans):
        site = self._model.site
        strokes = [
            stroke(span.x_at(span.low), span.low, span.high).replace(
                end_T=np.array([span.x_at(span.high), span.high]),
                standoff=span.standoff,
                flow=span.flow,
            )
            for span in spans
        ]
        film = self._model.film(strokes)
        cost = self._cost.on(site.paintable, site.keepout)(film).sum() * site.cell**2
        return cost + sum(stroke_cost(span.high - span.low) for span in spans)

    def _try(self, index, step):
        spans = list(self.spans)
        trial = self._varied(self._laid[index], *step)
        if trial is None:
            return False
        varied = [*spans[:index], trial, *spans[index + 1 :]]
        if self.worth(spans) - self.worth(varied) < 1e-6:
            return False
        self._laid[index] = self._lay(trial, is_clear=True)
        return True

    def _drop(self):
        before = len(self._laid)
        for laid in list(self._laid):
            rest = [other for other in self._laid if other is not laid]
            if self.worth([other.span for other in rest]) < self.worth(self.spans):
                self._laid = rest
        return before - len(self._laid)


def fitted(kind, *, rounds=1, **settings):
    """Returns a fit, of a `kind`, of strokes around a thing; one is to be dropped."""
    mask = np.ones((70, 70), dtype=bool)
    mask[25:45, 30:42] = False
    site = Site.of_tile(mask, CELL, np.where(mask, 0.0, 0.04))
    film = FilmModel(site, tip=TIP, speed=RASTER.speed, nominal=NOMINAL)
    dut = kind(film, FilmCost.fine(site), raster=RASTER, **settings)
    for span in [
        *(Span(x, 0.0, 0.7, RASTER.standoff, 1.0) for x in (0.05, 0.2)),
        *(
            Span(x, 0.12, 0.55, 0.15, 0.4, slant)
            for x, slant in ((0.2, 0.1), (0.5, 0.0))
        ),
        *(Span(0.36, low, high, 0.2, 0.6) for low, high in ((0.0, 0.2), (0.5, 0.7))),
        Span(0.62, 0.0, 0.7, RASTER.standoff, 0.9),
        Span(0.36, 0.33, 0.37, 0.12, 0.1),  # On the keep-out.
    ]:
        dut.add(span)
    for _ in range(rounds):
        dut.fit()
    return dut


def test_strokes_are_fitted_as_if_the_whole_site_were_weighed_each_time():
    # Nothing is ruled out.
    one, other = fitted(FilmFit, doubt=math.inf).spans, fitted(PlainFit).spans
    assert len(one) == 7
    np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-12)


def test_hardly_anything_is_lost_by_what_slopes_rule_out():
    """Of what fitting gains; some steps that are not tried would have helped."""
    spans = {rounds: fitted(FilmFit, rounds=rounds).spans for rounds in (0, 1)}
    plain = fitted(PlainFit)
    before, least = plain.worth(spans[0]), plain.worth(plain.spans)
    assert before - plain.worth(spans[1]) >= 0.99 * (before - least)


@pytest.mark.parametrize("coats", [2, 3])
def test_coats_share_the_film_and_alternate_their_lines(coats):
    mask = wall()
    raster = RasterConfig(coats=coats)
    strokes = plan_strokes(mask, CELL, SpraySettings(TIP, raster))
    assert {stroke.coat for stroke in strokes} == set(range(1, coats + 1))
    assert min(stroke.flow for stroke in strokes) >= LEAST_FLOW
    dut = model(mask)
    # One coat alone leaves its share, all over the tile.
    for coat in range(1, coats + 1):
        film = coats * dut.film([s for s in strokes if s.coat == coat])
        assert np.mean(film[dut.site.paintable] >= 0.8) >= 0.97
        assert film[dut.site.paintable].mean() == pytest.approx(1.0, abs=0.03)
    # Away from the sides lines lie half way between those of the coat before.
    first, second = (
        np.array([s.start_T[0] for s in strokes if s.coat == coat]) for coat in (1, 2)
    )
    middles = 0.5 * (first[1:] + first[:-1])[3:-3]
    nearest = np.abs(middles[:, None] - second).min(axis=1)
    assert nearest.max() <= 0.010  # The fit's first step across is 10 mm.
    one = figures(mask, plan_strokes(mask, CELL, SPRAY))
    all_ = figures(mask, strokes)
    assert all_["coverage"] >= one["coverage"]
    assert all_["cv"] < one["cv"]
    assert all_["overspray"] <= 0.04


def test_switching_is_paid_for_once_a_run():
    # One line, off or one level: rows 1-3 gain 1 each, row 5 gains half.
    gain = np.array([-0.1, 1.0, 1.0, 1.0, -0.2, 0.5])
    cost = np.stack([np.zeros(6), -gain], axis=-1)[None]
    levels, saved = best_levels(cost, 0.4)
    assert levels.tolist() == [[0, 1, 1, 1, 1, 1]]
    assert saved == pytest.approx([3.0 - 0.2 + 0.5 - 0.4])
    levels, saved = best_levels(cost, 0.1)
    assert levels.tolist() == [[0, 1, 1, 1, 0, 1]]
    assert saved == pytest.approx([3.0 - 0.1 + 0.5 - 0.1])


def test_cost_of_single_cells():
    dut = FilmCost.fine(model(wall((0.5, 0.5, 1.0, 1.0))).site)
    film, wall_cells = (
        np.array([1.0, 0.5, 0.0, 0.0]),
        np.array([True, True, False, False]),
    )
    cost = dut.on(wall_cells, ~wall_cells)(film)
    assert cost[0] == 0.0 and cost[1] > 1.0
    assert cost[2:].tolist() == [0.0, 0.0]


def test_cost_is_a_parabola_and_a_ramp():
    """Weights 2, 3 and 5; ramps from 0.9 down to 0.7 and from 0.1 up to 0.2."""
    dut = FilmCost(2.0, 3.0, (0.9, 0.7), (0.1, 0.2), 5.0)
    film = np.array([1.4, 0.8, 0.2])
    everywhere = np.array([True, True, True])
    nowhere = ~everywhere
    expected = [2.0 * 0.4**2, 2.0 * 0.2**2 + 0.5, 2.0 * 0.8**2 + 1.0]
    np.testing.assert_allclose(dut.on(everywhere, nowhere)(film), expected)
    film = np.array([0.05, 0.16, 0.5])
    painted = 3.0 * film + [0.0, 5.0 * 0.6, 5.0]
    np.testing.assert_allclose(dut.on(nowhere, everywhere)(film), painted)
    np.testing.assert_allclose(dut.on(nowhere, nowhere)(film), 3.0 * film)
    # On some of the cells, as on all.
    cells = dut.on(np.array([[True, False]] * 2), np.array([[False, True]] * 2))
    films = np.array([[1.4, 0.16], [0.8, 0.5]])
    window = (slice(1, 2), slice(0, 2))
    np.testing.assert_array_equal(cells(films[1:], window), cells(films)[1:])


def test_blank_wall_keeps_to_the_raster():
    mask = wall()
    strokes = plan_strokes(mask, CELL, SPRAY)
    assert len(strokes) == 14
    assert all(s.standoff == RASTER.standoff for s in strokes)
    found = figures(mask, strokes)
    assert found["coverage"] >= 0.97 and found["overspray"] <= 0.04


def test_a_window_is_cut_in_within_the_bounds():
    mask = wall((0.45, 0.60, 1.10, 1.00))
    strokes = plan_strokes(mask, CELL, SPRAY)
    plain = plan_strokes(mask, CELL, SpraySettings(TIP, RasterConfig(cut_in=False)))
    found, before = figures(mask, strokes), figures(mask, plain)
    assert found["coverage"] >= 0.96 and found["overspray"] <= 0.05
    assert found["cv"] <= 0.12 and found["keepout"] <= 0.03
    assert before["keepout"] > 2.0 * found["keepout"]
    assert before["coverage"] < found["coverage"]
    near = [s for s in strokes if s.kind == "cut_in"]
    assert near and all(s.standoff < 0.3 and s.flow < 1.0 for s in near)


def test_small_cubes_get_no_overspray():
    height = np.zeros((200, 200))
    for x, y in ((40, 40), (120, 60), (80, 140)):
        height[y : y + 10, x : x + 10] = 0.10
    mask = height == 0.0
    strokes = plan_strokes(mask, CELL, SPRAY, height=height)
    found = figures(mask, strokes, height)
    assert found["coverage"] >= 0.95 and found["overspray"] <= 0.06
    assert found["keepout"] <= 0.10
    # The gun is 2.3 cm in radius and keeps 4 cm clear of what stands 10 cm out.
    for s in strokes:
        low, high = sorted((s.start_T[1], s.end_T[1]))
        for x, y in ((0.40, 0.40), (1.20, 0.60), (0.80, 1.40)):
            beside = x - 0.06 < s.start_T[0] < x + 0.16
            if beside and low < y + 0.16 and high > y - 0.06:
                assert s.standoff >= 0.14


def test_strokes_keep_to_the_stand_offs_that_the_arm_reaches():
    mask = wall((0.20, 0.0, 0.9, 1.85))
    nearest = np.zeros(model(mask).site.paintable.shape)
    nearest[:40] = 0.20  # The margin's 15 rows and 25 cm of the tile.
    strokes = plan_strokes(mask, CELL, SPRAY, nearest=nearest)
    low = [s for s in strokes if min(s.start_T[1], s.end_T[1]) < 0.25 - 1e-6]
    assert min(s.standoff for s in low) >= 0.20
    assert min(s.standoff for s in strokes) < 0.15


def test_nominal_film_is_flow_over_speed_and_pitch():
    assert SPRAY.nominal_film(2.0) == mean_film(TIP, speed=0.6, pitch=2.0 / 14)


def test_spans_of_nearly_one_line_are_joined_only_where_they_meet():
    """A span that lies left of and above another is not one with it."""
    upper = Span(0.088, 1.83, 2.01, 0.315, 1.0)
    lower = Span(0.089, 0.00, 1.62, 0.315, 1.0)
    apart = fitted_strokes([upper, lower], SPRAY)
    assert sum(s.length for s in apart) == pytest.approx(0.18 + 1.62)
    (joined,) = fitted_strokes([upper, lower._replace(high=1.825)], SPRAY)
    assert joined.length == pytest.approx(2.01)
