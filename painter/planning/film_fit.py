"""Strokes fitted to the film they are to leave.

Fitting varies one number of one stroke at a time (its place across, ends, flow and
stand-off) and keeps what lowers the film's cost. Only the cells in the fan's reach are
looked at, so a tile's strokes take about a second.
"""

from typing import NamedTuple

import numpy as np
from scipy.ndimage import maximum_filter

from painter.planning.config import RasterConfig
from painter.planning.film_cost import FilmCost, stroke_cost
from painter.planning.film_model import FilmModel
from perception.values import BoolArray, FloatArray

# Steps across, along (m), of flow (share) and stand-off (m): coarse, then fine.
_STEPS = ((0.01, 0.01, 0.10, 0.03), (0.004, 0.005, 0.04, 0.0))
_PASSES = 6  # At most, with steps of one size.
_REPEATS = 4  # Of a step that helped.
_LEAST_FLOW = 0.08  # A valve does not dose less.
_GAIN = 1e-6  # m², least gain of a step.
# The gun's half width and the clearance around it, m, and the clearance before it.
_GUN_REACH = 0.07
_GUN_FRONT = 0.05


class Span(NamedTuple):
    """A stroke while it is fitted: along T y at `x`; m, flow as share of nominal."""

    x: float
    low: float
    high: float
    standoff: float
    flow: float


class FilmFit:
    """Spans on a site and the film they leave; spans are added, then fitted."""

    def __init__(
        self,
        model: FilmModel,
        cost: FilmCost,
        *,
        raster: RasterConfig,
        film: FloatArray | None = None,
    ) -> None:
        """Begins with none.

        Args:
            model: Film on the site.
            cost: Of the film.
            raster: Gives stand-offs and the shortest stroke.
            film: (ny, nx) of the site, what is there already; None = nothing.
        """
        site = model.site
        self.spans: list[Span] = []
        self.film: FloatArray = np.zeros(site.wanted.shape)
        if film is not None:
            self.film += film
        self._model, self._cost, self._raster = model, cost, raster
        size = 2 * round(_GUN_REACH / site.cell) + 1
        self._tops = maximum_filter(site.height, size=size) + _GUN_FRONT
        self._tops[self._tops <= _GUN_FRONT] = 0.0  # The wall has its own clearance.

    def room(self, x: FloatArray, standoff: float) -> BoolArray:
        """Returns the rows on which the gun clears what stands out.

        Args:
            x: (n,) m, lines.
            standoff: Nozzle to wall, m.

        Returns:
            (ny, n).
        """
        site = self._model.site
        columns = np.floor(x / site.cell).astype(int) + site.border
        return np.asarray(self._tops[:, columns] <= standoff)

    def add(self, span: Span) -> None:
        """Adds a span and its film."""
        self.spans.append(span)
        rows, columns, film = self._patch(span)
        self.film[rows, columns] += film

    def fit(self) -> None:
        """Varies the spans until nothing helps; drops those that are worth nothing."""
        for across, along, flow, standoff in _STEPS:
            for _ in range(_PASSES):
                changes = sum(
                    self._fit_span(index, across, along, flow, standoff)
                    for index in range(len(self.spans))
                )
                changes += self._drop()
                if changes < 3:
                    break

    def _fit_span(
        self, index: int, across: float, along: float, flow: float, standoff: float
    ) -> int:
        """Tries steps of one span; returns how many helped."""
        helped = 0
        steps = [("x", across), ("low", along), ("high", along)]
        near = self.spans[index].standoff < self._raster.standoff
        if near and standoff:
            steps.append(("standoff", standoff))
        steps.append(("flow", flow * self.spans[index].standoff))
        for name, step in steps:
            for signed in (step, -step):
                if name == "flow":
                    signed /= self._raster.standoff
                for _ in range(_REPEATS):
                    trial = self._varied(self.spans[index], name, signed)
                    if trial is None or not self._try(index, trial):
                        break
                    helped += 1
        return helped

    def _varied(self, span: Span, name: str, step: float) -> Span | None:
        """Returns the span with one number varied, or None if it cannot be."""
        raster = self._raster
        trial = span._replace(**{name: getattr(span, name) + step})
        if name == "standoff":
            # The flow goes with the fan's width: the film's thickness stays.
            trial = trial._replace(flow=span.flow * trial.standoff / span.standoff)
            if not raster.cut_in_standoff <= trial.standoff <= raster.standoff:
                return None
        if not _LEAST_FLOW <= trial.flow <= 1.0 + 1e-9:
            return None
        if trial.high - trial.low < raster.min_stroke:
            return None
        return trial if self._has_room(trial) else None

    def _has_room(self, span: Span) -> bool:
        site = self._model.site
        rows = slice(*(int(y / site.cell) + site.border for y in span[1:3]))
        column = int(np.floor(span.x / site.cell)) + site.border
        if not 0 <= column < site.wanted.shape[1]:
            return False
        return bool((self._tops[rows, column] <= span.standoff).all())

    def _try(self, index: int, trial: Span) -> bool:
        """Takes the trial for the span if it costs less."""
        span = self.spans[index]
        old, new = self._rows(span), self._rows(trial)
        first, end = min(old.start, new.start), max(old.stop, new.stop)
        if trial.x == span.x and trial.flow == span.flow:
            # Only one end has moved: the film beyond its blur is as it was.
            line = self._model.line(span.x, span.standoff)
            ends = (trial.low, span.low) if trial.low != span.low else ()
            ends = ends or (trial.high, span.high)
            first = max(first, self._row(min(ends) - line.blur))
            end = min(end, self._row(max(ends) + line.blur) + 1)
        rows = slice(first, end)
        (_, left, without), (_, right, with_) = (
            self._patch(span, rows),
            self._patch(trial, rows),
        )
        columns = slice(min(left.start, right.start), max(left.stop, right.stop))
        before = self.film[rows, columns]
        after = before.copy()
        after[:, left.start - columns.start : left.stop - columns.start] -= without
        after[:, right.start - columns.start : right.stop - columns.start] += with_
        gain = self._area_cost(before, rows, columns) - self._area_cost(
            after, rows, columns
        )
        gain += stroke_cost(span.high - span.low) - stroke_cost(trial.high - trial.low)
        if gain < _GAIN:
            return False
        self.film[rows, columns] = after
        self.spans[index] = trial
        return True

    def _drop(self) -> int:
        """Drops spans without which the film costs no more; returns how many."""
        kept: list[Span] = []
        for span in self.spans:
            rows, columns, film = self._patch(span)
            before = self.film[rows, columns]
            loss = self._area_cost(before - film, rows, columns) - self._area_cost(
                before, rows, columns
            )
            if loss < stroke_cost(span.high - span.low):
                self.film[rows, columns] = before - film
            else:
                kept.append(span)
        dropped = len(self.spans) - len(kept)
        self.spans = kept
        return dropped

    def _area_cost(self, film: FloatArray, rows: slice, columns: slice) -> float:
        site = self._model.site
        cost = self._cost(film, site.wanted[rows, columns], site.clean[rows, columns])
        return float(cost.sum()) * site.cell**2

    def _row(self, y: float) -> int:
        site = self._model.site
        row = int(np.floor(y / site.cell)) + site.border
        return int(min(max(row, 0), site.wanted.shape[0]))

    def _rows(self, span: Span) -> slice:
        blur = self._model.line(span.x, span.standoff).blur
        return slice(self._row(span.low - blur), self._row(span.high + blur) + 1)

    def _patch(
        self, span: Span, rows: slice | None = None
    ) -> tuple[slice, slice, FloatArray]:
        """Returns a span's film on the rows and columns that it reaches."""
        rows = rows or self._rows(span)
        line = self._model.line(span.x, span.standoff)
        passed = self._model.passed(line, self._model.site.y[rows], span.low, span.high)
        film = span.flow * line.film[rows] * passed
        return rows, slice(*line.columns), film
