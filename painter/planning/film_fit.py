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
from painter.planning.film_model import FilmModel, Line
from perception.values import BoolArray, FloatArray

# Steps across, along (m), of flow (share) and stand-off (m): coarse, then fine.
_STEPS = ((0.01, 0.01, 0.10, 0.03), (0.004, 0.005, 0.04, 0.0))
_PASSES = 6  # At most, with steps of one size.
_REPEATS = 4  # Of a step that helped.
# A shorter stroke need not lean: its ends move instead. Beyond 0.3 m/m, 17 deg, the
# fan, which stays level, would be dragged too far along its own axis.
_SHORTEST_LEANING = 0.15  # m
MOST_LEAN = 0.3
LEAST_FLOW = 0.08  # A valve does not dose less.
_GAIN = 1e-6  # m², least gain of a step.
# The gun's half width and the clearance around it, m, and the clearance before it.
_GUN_REACH = 0.07
_GUN_FRONT = 0.05


class Span(NamedTuple):
    """A stroke while it is fitted; m, flow as share of nominal.

    It goes up from T y `low` to `high`, and by `lean` to the right for each metre up;
    `x` is where its line meets T y = 0.
    """

    x: float
    low: float
    high: float
    standoff: float
    flow: float
    lean: float = 0.0

    def x_at(self, y: float) -> float:
        """Returns the place across at T y, m."""
        return self.x + self.lean * y


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

    def room(self, x: FloatArray, standoff: float, lean: float = 0.0) -> BoolArray:
        """Returns the rows on which the gun clears what stands out.

        Args:
            x: (n,) m, lines, where they meet T y = 0.
            standoff: Nozzle to wall, m.
            lean: Of the lines, m/m.

        Returns:
            (ny, n); False where a line is off the site.
        """
        site = self._model.site
        ny, nx = site.wanted.shape
        places = x + lean * site.y[:, None]
        columns = np.floor(places / site.cell).astype(int) + site.border
        inside = (columns >= 0) & (columns < nx)
        tops = self._tops[np.arange(ny)[:, None], np.clip(columns, 0, nx - 1)]
        return np.asarray(inside & (tops <= standoff))

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
        span = self.spans[index]
        steps = [("x", across), ("low", along), ("high", along)]
        if span.standoff < self._raster.standoff:
            if span.high - span.low > _SHORTEST_LEANING:
                steps.append(("lean", 2.0 * across / (span.high - span.low)))
            if standoff:
                steps.append(("standoff", standoff))
        steps.append(("flow", flow * span.standoff))
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
        if name == "lean":
            # About the middle.
            middle = 0.5 * (span.low + span.high)
            trial = trial._replace(x=span.x_at(middle) - trial.lean * middle)
            if abs(trial.lean) > MOST_LEAN:
                return None
        if name == "standoff":
            # The flow goes with the fan's width: the film's thickness stays.
            trial = trial._replace(flow=span.flow * trial.standoff / span.standoff)
            if not raster.cut_in_standoff <= trial.standoff <= raster.standoff:
                return None
        if not LEAST_FLOW <= trial.flow <= 1.0 + 1e-9:
            return None
        if trial.high - trial.low < raster.min_stroke:
            return None
        return trial if self._has_room(trial) else None

    def _has_room(self, span: Span) -> bool:
        site = self._model.site
        nx = site.wanted.shape[1]
        rows = np.arange(*(self._row(y) for y in span[1:3]))
        places = span.x + span.lean * site.y[rows]
        columns = np.floor(places / site.cell).astype(int) + site.border
        if columns.size == 0 or columns.min() < 0 or columns.max() >= nx:
            return False
        return bool((self._tops[rows, columns] <= span.standoff).all())

    def _try(self, index: int, trial: Span) -> bool:
        """Takes the trial for the span if it costs less."""
        span = self.spans[index]
        old, new = self._rows(span), self._rows(trial)
        first, end = min(old.start, new.start), max(old.stop, new.stop)
        if trial.x == span.x and trial.flow == span.flow and trial.lean == span.lean:
            # Only one end has moved: the film beyond its blur is as it was.
            line = self._line(span)
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

    def _line(self, span: Span) -> Line:
        return self._model.line(span.x, span.standoff, span.lean)

    def _row(self, y: float) -> int:
        site = self._model.site
        row = int(np.floor(y / site.cell)) + site.border
        return int(min(max(row, 0), site.wanted.shape[0]))

    def _rows(self, span: Span) -> slice:
        blur = self._line(span).blur
        return slice(self._row(span.low - blur), self._row(span.high + blur) + 1)

    def _patch(
        self, span: Span, rows: slice | None = None
    ) -> tuple[slice, slice, FloatArray]:
        """Returns a span's film on the rows and columns that it reaches."""
        rows = rows or self._rows(span)
        line = self._line(span)
        passed = self._model.passed(line, rows, span.low, span.high)
        film = span.flow * line.film[rows] * passed
        return rows, slice(*line.columns), film
