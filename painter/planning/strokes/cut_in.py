"""Where to cut in: narrow strokes beside edges, found line by line.

On every candidate line the best spans to spray and their flow, given all other strokes,
follow from dynamic programming over the rows. The line that gains most is taken, and so
on until none gains anything.
"""

import itertools

import numpy as np
from scipy.ndimage import maximum_filter

from painter.planning.film.deposition import half_axes
from painter.planning.film.film_cost import FilmCost, stroke_cost
from painter.planning.film.film_model import FilmModel, Line, Site
from painter.planning.strokes.film_fit import FilmFit
from painter.planning.strokes.slanted import slanted_lines
from painter.planning.strokes.spans import Span
from painter.planning.strokes.spray_settings import SpraySettings
from perception.ground import BoolArray, FloatArray, IntArray

_SPACING = 0.02  # m, between candidate lines ...
_SPACING_IN_SPOTS = 0.01  # ... and where only some spots are touched up.
_ROUNDS = 10
# Multiples of the least stand-off that are tried as well. Beside a straight edge two
# strokes leave the most even film, the wider one from a bit over twice as far.
_WIDER = (2.3,)
# Flow of candidates, as share of what keeps the film's thickness at their stand-off.
_FLOWS = np.array([0.6, 0.75, 0.9, 1.05, 1.25])
_THIN = 0.9  # Film, as share of nominal, below which a line is worth evaluating.
_APART = 1.6  # Half fans between lines that are taken at once.
_MOSTLY_EDGE = 4.0  # m of edge a m² of wall.
_ROWS = 11
_NEVER = 1e3  # m², cost of the infeasible.


def find_cut_ins(
    fit: FilmFit,
    model: FilmModel,
    spray: SpraySettings,
    *,
    where: BoolArray | None = None,
) -> None:
    """Adds strokes where the film is thin.

    Args:
        fit: Gets the strokes.
        model: Film on the site.
        spray: `raster.cut_in_standoff` is the nearest to the wall. Wider strokes are
            tried as well, where things stand out from half way to `raster.standoff`.
        where: (ny, nx) of the site, cells to be covered, from `raster.standoff` too;
            None = those beside edges.
    """
    site = model.site
    tip, raster = spray
    near = raster.cut_in_standoff
    standoffs = [near]
    if site.stands_out:
        standoffs.append(0.5 * (near + raster.standoff))
    else:
        standoffs += [
            wider * near for wider in _WIDER if wider * near < raster.standoff
        ]
    if where is not None:
        standoffs.append(raster.standoff)
    spacing = _SPACING if where is None else _SPACING_IN_SPOTS
    width = (site.paintable.shape[1] - 2 * site.border) * site.cell
    places = np.linspace(0.0, width, round(width / spacing) + 1)[1:-1]
    fan = round(2.0 * half_axes(tip, raster.standoff)[0] / site.cell)
    cells = _beside_edges(site, fan) if where is None else where
    lines = [
        (0.0, places),
        *slanted_lines(site, 2.0 * half_axes(tip, near)[0], spacing),
    ]
    flows = {
        standoff: np.append(
            0.0, np.maximum(_FLOWS * standoff / raster.standoff, fit.least_flow)
        )
        for standoff in standoffs
    }
    candidates = [
        _Candidate(float(place), slant, standoff, clear, flows[standoff])
        for standoff, (slant, x) in itertools.product(standoffs, lines)
        for place, clear in zip(x, fit.clear_rows(x, standoff, slant).T, strict=True)
    ]
    for _ in range(_ROUNDS):
        found = _best_spans(candidates, fit, model, cells, raster.min_stroke)
        taken: list[tuple[float, list[Span]]] = []
        for gain, spans in sorted(found, key=lambda item: -item[0]):
            a, _ = half_axes(tip, spans[0].standoff)
            if gain > 0.0 and not any(_overlap(spans, a, *other) for other in taken):
                taken.append((a, spans))
                for span in spans:
                    fit.add(span)
        if not taken:
            return


def _beside_edges(site: Site, fan: int) -> BoolArray:
    """Returns the cells on which a cut-in is worth its time, (ny, nx).

    A wall that is mostly edge is cut in along all of its edges. Else these are the
    cells within a fan's width, `fan` cells, and a few rows of a keep-out: at the tile's
    own edges the raster alone does nearly as well.
    """
    steps = [np.diff(site.paintable.astype(np.int8), axis=axis) for axis in (0, 1)]
    edge = sum(np.abs(step).sum() for step in steps) * site.cell
    if edge > _MOSTLY_EDGE * site.paintable.sum() * site.cell**2:
        return np.ones_like(site.keepout)
    return np.asarray(maximum_filter(site.keepout, size=(_ROWS, 2 * fan + 1)))


def _overlap(spans: list[Span], a: float, other_a: float, others: list[Span]) -> bool:
    """Returns whether the films of two lines' spans overlap."""
    apart = _APART * 0.5 * (a + other_a)
    for one, other in itertools.product(spans, others):
        low, high = max(one.low, other.low), min(one.high, other.high)
        if low < high:
            gaps = [one.x_at(y) - other.x_at(y) for y in (low, high)]
            if max(gaps) > -apart and min(gaps) < apart:
                return True
    return False


class _Candidate:
    """A line on which to cut in, and the cost of each flow on each row."""

    def __init__(
        self,
        x: float,
        slant: float,
        standoff: float,
        clear_rows: BoolArray,
        flows: FloatArray,
    ) -> None:
        self.x, self.slant, self.standoff = x, slant, standoff
        self._clear_rows, self._flows = clear_rows, flows
        # As last evaluated, row by row: the film, its costs, and if it is thin.
        self._film: FloatArray | None = None
        self._table = np.zeros((clear_rows.size, flows.size))
        self._thin = np.zeros(clear_rows.size, dtype=bool)

    def table(
        self,
        fit: FilmFit,
        model: FilmModel,
        cost: FilmCost,
        cells: BoolArray,
        min_stroke: float,
    ) -> FloatArray | None:
        """Returns costs (ny, flows), m², or None where nothing on the line is thin.

        Only rows on which the film under the line has changed are evaluated again.
        """
        site = model.site
        line = model.line(self.x, self.standoff, self.slant)
        window = slice(*line.columns)
        film = fit.film[:, window]
        if self._film is None:
            self._film, rows = film.copy(), np.arange(len(film))
        else:
            rows = np.flatnonzero((film != self._film).any(axis=1))
            self._film[rows] = film[rows]
        if rows.size:
            self._evaluate(rows, line, window, site, cost, cells)
        if self._thin.sum() * site.cell < min_stroke:
            return None
        return self._table

    def _evaluate(
        self,
        rows: IntArray,
        line: Line,
        window: slice,
        site: Site,
        cost: FilmCost,
        cells: BoolArray,
    ) -> None:
        """Finds the costs on some rows."""
        assert self._film is not None
        film, full = self._film[rows], line.film[rows]
        paintable, keepout = site.paintable[rows, window], site.keepout[rows, window]
        thin = paintable & (film < _THIN) & cells[rows, window] & (full > 0.0)
        on = thin.any(axis=1)
        trial = film[on] + self._flows[:, None, None] * full[on]
        costs = cost.on(paintable[on], keepout[on])(trial)
        table = np.zeros((rows.size, self._flows.size))
        table[on] = costs.sum(axis=2).T * site.cell**2
        table[~(on & self._clear_rows[rows]), 1:] = _NEVER
        table[:, 1:] += (stroke_cost(1.0) - stroke_cost(0.0)) * site.cell
        self._table[rows], self._thin[rows] = table, on

    def spans(self, levels: IntArray, site: Site, min_stroke: float) -> list[Span]:
        """Returns the spans of flows (ny,), given by their number."""
        ends = np.flatnonzero(np.diff(levels, prepend=0, append=0) != 0)
        return [
            Span(
                self.x,
                (a - site.border) * site.cell,
                (b - site.border) * site.cell,
                self.standoff,
                float(min(self._flows[levels[a]], 1.0)),
                self.slant,
            )
            for a, b in itertools.pairwise(ends)
            if levels[a] and (b - a) * site.cell >= min_stroke
        ]


def _best_spans(
    candidates: list[_Candidate],
    fit: FilmFit,
    model: FilmModel,
    cells: BoolArray,
    min_stroke: float,
) -> list[tuple[float, list[Span]]]:
    """Returns what candidate lines gain, m², and the spans that gain it."""
    cost = FilmCost.coarse(model.site)
    lines, tables = [], []
    for line in candidates:
        table = line.table(fit, model, cost, cells, min_stroke)
        if table is not None:
            lines.append(line)
            tables.append(table)
    if not lines:
        return []
    levels, gains = best_levels(np.stack(tables), stroke_cost(0.0))
    found = [
        (float(gain), line.spans(level, model.site, min_stroke))
        for line, level, gain in zip(lines, levels, gains, strict=True)
    ]
    return [(gain, spans) for gain, spans in found if spans]


def best_levels(cost: FloatArray, begun: float) -> tuple[IntArray, FloatArray]:
    """Finds the cheapest level on each row where opening the gun has a cost of its own.

    Args:
        cost: (n, rows, levels), level 0 is off; an open gun stays at its level or
            closes.
        begun: Cost of opening the gun.

    Returns:
        Levels (n, rows) and what they save against all off (n,).
    """
    count, rows, levels = cost.shape
    best = np.full((count, levels), np.inf)
    best[:, 0] = 0.0
    from_off = np.zeros((rows, count, levels), dtype=bool)
    off_from = np.zeros((rows, count), dtype=np.int64)
    every = np.arange(count)
    for row in range(rows):
        off_from[row] = best.argmin(axis=1)
        off = best[every, off_from[row]]
        start = best[:, :1] + begun
        from_off[row] = start < best
        best = np.minimum(start, best) + cost[:, row]
        best[:, 0] = off + cost[:, row, 0]
    level = best.argmin(axis=1)
    saved = cost[:, :, 0].sum(axis=1) - best[every, level]
    path = np.zeros((count, rows), dtype=np.int64)
    for row in range(rows - 1, -1, -1):
        path[:, row] = level
        begins = (level > 0) & from_off[row, every, level]
        level = np.where(level == 0, off_from[row], np.where(begins, 0, level))
    return path, saved
