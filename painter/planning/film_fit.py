"""Strokes fitted to the film they are to leave.

Fitting varies one number of one stroke at a time (its place across, ends, flow and
stand-off) and keeps what lowers the film's cost. Only the cells whose film changes are
looked at, and what failed once is tried again only where the film has changed since.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.ndimage import maximum_filter

from painter.planning.config import RasterConfig
from painter.planning.film_cost import FilmCost, stroke_cost
from painter.planning.film_model import FilmModel
from painter.planning.spans import Span, Window, reached, span_film
from perception.values import BoolArray, FloatArray

# Steps across, along (m), of flow (share) and stand-off (m): coarse, then fine.
_STEPS = (
    (0.01, 0.01, 0.10, 0.03),
    (0.004, 0.005, 0.04, 0.01),
    (0.0015, 0.003, 0.015, 0.004),
)
_PASSES = 6  # At most, with steps of one size.
_REPEATS = 4  # Of a step that helped.
# A shorter stroke need not lean: its ends move instead. Beyond 0.3 m/m, 17 deg, the
# fan, which stays level, would be dragged too far along its own axis.
_SHORTEST_LEANING = 0.15  # m
MOST_LEAN = 0.3
LEAST_FLOW = 0.08  # A valve does not dose less.
_GAIN = 1e-6  # m², least gain of a step.
# A step that failed is tried again once the film on its cells has changed by more than
# its loss over this, all changes of all cells added up. Of 364 steps that helped at a
# later try none would be missed with 2, ten with 1 and 20 with 1/2.
_LOSS_FOR_CHANGE = 2.0
# The gun's half width and the clearance around it, m, and the clearance before it.
_GUN_REACH = 0.07
_GUN_FRONT = 0.05

_Step = tuple[str, float]  # A number of a span, and by how much it varies.


class _Loss(NamedTuple):
    """What a step lost when it was tried.

    Attributes:
        area: m²
        window: The cells that it would have changed.
        moved: By how much the film had changed there until then, m².
        moved_in_all: And everywhere.
    """

    area: float
    window: Window
    moved: float
    moved_in_all: float


class _Laid:
    """A span with the film that it leaves, and the steps of it that did not help."""

    def __init__(
        self, span: Span, window: Window, film: FloatArray, has_room: bool
    ) -> None:
        """Takes a span, its film on the cells that it reaches, and if it has room."""
        self.span, self.window, self.film = span, window, film
        self.has_room = has_room
        # What steps lost that were tried in vain; None: they cannot be made.
        self.failed: dict[_Step, _Loss | None] = {}
        # What dropping it lost.
        self.kept: _Loss | None = None


class FilmFit:
    """Spans on a site and the film they leave; spans are added, then fitted."""

    def __init__(
        self,
        model: FilmModel,
        cost: FilmCost,
        *,
        raster: RasterConfig,
        film: FloatArray | None = None,
        least_flow: float = LEAST_FLOW,
    ) -> None:
        """Begins with none.

        Args:
            model: Film on the site.
            cost: Of the film.
            raster: Gives stand-offs and the shortest stroke.
            film: (ny, nx) of the site, what is there already; None = nothing.
            least_flow: That a span may have.
        """
        site = model.site
        self.least_flow = least_flow
        self.film: FloatArray = np.zeros(site.wanted.shape)
        if film is not None:
            self.film += film
        self._laid: list[_Laid] = []
        self._model, self._cost, self._raster = model, cost, raster
        self._cell_costs = cost.on(site.wanted, site.clean)
        size = 2 * round(_GUN_REACH / site.cell) + 1
        self._tops = maximum_filter(site.height, size=size) + _GUN_FRONT
        self._tops[self._tops <= _GUN_FRONT] = 0.0  # The wall has its own clearance.
        self._tops = np.maximum(self._tops, site.nearest)
        # While spans are fitted: what each cell costs, and by how much its film has
        # changed, all changes added up.
        self._costs: FloatArray = np.zeros(site.wanted.shape)
        self._moved: FloatArray = np.zeros(site.wanted.shape)
        self._moved_in_all = 0.0  # The same of all cells, m².

    @property
    def spans(self) -> tuple[Span, ...]:
        """The spans as they are now."""
        return tuple(laid.span for laid in self._laid)

    def room(self, x: FloatArray, standoff: float, lean: float = 0.0) -> BoolArray:
        """Returns the rows on which the gun clears what stands out and is in reach.

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
        laid = self._lay(span, self._has_room(span))
        self._laid.append(laid)
        self.film[laid.window] += laid.film

    def fit(self) -> None:
        """Varies the spans until nothing helps; drops those that are worth nothing."""
        self._costs = self._cell_costs(self.film)
        for across, along, flow, standoff in _STEPS:
            for _ in range(_PASSES):
                changes = sum(
                    self._fit_span(index, across, along, flow, standoff)
                    for index in range(len(self._laid))
                )
                changes += self._drop()
                if changes < 3:
                    break

    def _fit_span(
        self, index: int, across: float, along: float, flow: float, standoff: float
    ) -> int:
        """Tries steps of one span; returns how many helped."""
        span = self._laid[index].span
        steps = [("x", across), ("low", along), ("high", along)]
        if span.standoff < self._raster.standoff:
            if span.length > _SHORTEST_LEANING:
                steps.append(("lean", 2.0 * across / (span.length)))
            if standoff:
                steps.append(("standoff", standoff))
        steps.append(("flow", flow * span.standoff / self._raster.standoff))
        helped = 0
        for name, step in steps:
            for signed in (step, -step):
                before = helped
                while helped - before < _REPEATS and self._try(index, (name, signed)):
                    helped += 1
                if helped > before:
                    break  # The step back would only undo the last one.
        return helped

    def _varied(self, laid: _Laid, name: str, step: float) -> Span | None:
        """Returns a span with one number varied, or None if it cannot be."""
        raster, span = self._raster, laid.span
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
        if not self.least_flow <= trial.flow <= 1.0 + 1e-9:
            return None
        if trial.length < raster.min_stroke:
            return None
        is_on_line = laid.has_room and name in ("flow", "low", "high")
        if is_on_line and trial.low >= span.low and trial.high <= span.high:
            return trial
        return trial if self._has_room(trial) else None

    def _has_room(self, span: Span) -> bool:
        site = self._model.site
        nx = site.wanted.shape[1]
        rows = slice(site.row(span.low), site.row(span.high))
        if rows.start >= rows.stop:
            return False
        if span.lean == 0.0:
            column = math.floor(span.x / site.cell) + site.border
            if not 0 <= column < nx:
                return False
            return bool(self._tops[rows, column].max() <= span.standoff)
        places = span.x + span.lean * site.y[rows]
        columns = np.floor(places / site.cell).astype(int) + site.border
        if columns.min() < 0 or columns.max() >= nx:
            return False
        tops = self._tops[np.arange(rows.start, rows.stop), columns]
        return bool(tops.max() <= span.standoff)

    def _try(self, index: int, step: _Step) -> bool:
        """Takes a step of a span if that costs less."""
        laid = self._laid[index]
        if step in laid.failed:
            last = laid.failed[step]
            if last is None or self._still_loses(last):
                return False
        span, trial = laid.span, self._varied(laid, *step)
        if trial is None:
            laid.failed[step] = None
            return False
        name, size = step
        if name == "flow":
            changed = laid.window
            film = self.film[changed] - laid.film
            film += laid.film * (trial.flow / span.flow)
        else:
            line, new = reached(self._model, trial)
            changed = laid.window.hull(new)
            if name in ("low", "high"):
                # The film beyond the blur of the end that moves is as it was.
                low, high = sorted((getattr(span, name), getattr(trial, name)))
                rows = self._model.rows(low, high, span.standoff)
                changed, new = changed.cut(rows), new.cut(rows)
            film = self.film[changed].copy()
            part = changed.part(film, laid.window)
            part -= laid.window.part(laid.film, changed)
            part = changed.part(film, new)
            part += span_film(self._model, trial, line, new)
        costs = self._cell_costs(film, changed)
        gain = float((self._costs[changed] - costs).sum()) * self._model.site.cell**2
        gain += stroke_cost(span.length) - stroke_cost(trial.length)
        if gain < _GAIN:
            laid.failed[step] = self._loss(-gain, changed)
            return False
        self._change(changed, film, costs)
        laid = self._laid[index] = self._lay(trial, has_room=True)
        # The step back would only undo this one.
        laid.failed[name, -size] = self._loss(gain, changed)
        return True

    def _drop(self) -> int:
        """Drops spans without which the film costs no more; returns how many."""
        kept: list[_Laid] = []
        for laid in self._laid:
            if laid.kept is None or not self._still_loses(laid.kept):
                film = self.film[laid.window] - laid.film
                costs = self._cell_costs(film, laid.window)
                loss = float((costs - self._costs[laid.window]).sum())
                loss *= self._model.site.cell**2
                loss -= stroke_cost(laid.span.length)
                if loss < 0.0:
                    self._change(laid.window, film, costs)
                    continue
                laid.kept = self._loss(loss, laid.window)
            kept.append(laid)
        dropped = len(self._laid) - len(kept)
        self._laid = kept
        return dropped

    def _change(self, window: Window, film: FloatArray, costs: FloatArray) -> None:
        """Takes over a film and its costs on a window."""
        moved = np.abs(film - self.film[window])
        self._moved[window] += moved
        self._moved_in_all += float(moved.sum()) * self._model.site.cell**2
        self.film[window], self._costs[window] = film, costs

    def _loss(self, area: float, window: Window) -> _Loss:
        return _Loss(area, window, self._moved_on(window), self._moved_in_all)

    def _still_loses(self, last: _Loss) -> bool:
        """Tells that the film has changed too little for a step to help now."""
        moved = self._moved_in_all - last.moved_in_all
        if last.area >= _LOSS_FOR_CHANGE * moved:
            return True  # Not even if all of it was there, which is soon told.
        moved = self._moved_on(last.window) - last.moved
        return last.area >= _LOSS_FOR_CHANGE * moved

    def _moved_on(self, window: Window) -> float:
        return float(self._moved[window].sum()) * self._model.site.cell**2

    def _lay(self, span: Span, has_room: bool) -> _Laid:
        line, window = reached(self._model, span)
        return _Laid(span, window, span_film(self._model, span, line, window), has_room)
