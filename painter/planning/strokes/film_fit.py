"""Strokes fitted to the film they are to leave.

Fitting varies one number of one stroke at a time (its place across, slant, ends, flow
and stand-off) and keeps what lowers the film's cost. Only cells whose film changes are
evaluated. A step that failed is tried again only if the slopes of the costs, as they
are by then, promise a gain.
"""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from scipy.ndimage import maximum_filter

from painter.planning.config import RasterConfig
from painter.planning.film.film_cost import FilmCost, stroke_cost
from painter.planning.film.film_model import FilmModel
from painter.planning.strokes.spans import Span, Window, reached, span_film
from perception.ground import BoolArray, FloatArray

# Steps across, along (m), of flow (share) and stand-off (m): coarse, then fine.
_STEPS = (
    (0.01, 0.01, 0.10, 0.03),
    (0.004, 0.005, 0.04, 0.01),
    (0.0015, 0.002, 0.012, 0.003),
)
# Finest of all along openings, where they make the film even: in the shade of what
# stands out it is uneven at any cost.
_FINEST = (0.0006, 0.001, 0.005, 0.001)
_PASSES = 6  # At most, with steps of one size.
_REPEATS = 3  # Of a step that helped.
# A shorter stroke is not slanted: its ends move instead. Beyond 0.3 m/m, 17 deg, the
# fan, which stays level, would be dragged too far along its own axis.
_SHORTEST_SLANTED = 0.15  # m
MOST_SLANT = 0.3
LEAST_FLOW = 0.08  # A valve does not dose less.
_GAIN = 2e-6  # m², least gain of a step.
# The part of a step's gain that slopes miss is taken to be what they missed when it
# failed, give or take this share.
DOUBT = 0.7
_EITHER_SIDE = 0.015  # Film, as share of nominal, over which a cost's slope is taken.
# The gun's half width and the clearance around it, m, and the clearance before it.
_GUN_REACH = 0.07
_GUN_FRONT = 0.05

_Step = tuple[str, float]  # A number of a span, and by how much it varies.


class _Failure(NamedTuple):
    """A step that did not lower the cost.

    Attributes:
        window: The cells whose film it would have changed.
        change: Of their film, as share of nominal.
        rest: Its gain less what the slopes of the costs promised, m².
    """

    window: Window
    change: FloatArray
    rest: float


class _Laid:
    """A span with the film that it leaves, and its steps that did not help."""

    def __init__(
        self, span: Span, window: Window, film: FloatArray, is_clear: bool
    ) -> None:
        """Takes a span, its film on its window, and whether the gun is clear there."""
        self.span, self.window, self.film = span, window, film
        self.is_clear = is_clear
        # Steps that did not lower the cost; None: infeasible.
        self.failed: dict[_Step, _Failure | None] = {}
        self.kept: _Failure | None = None  # Dropping it.


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
        doubt: float = DOUBT,
    ) -> None:
        """Begins without spans.

        Args:
            model: Film on the site.
            cost: Of the film.
            raster: Gives stand-offs and the shortest stroke.
            film: (ny, nx) of the site, what is there already; None = nothing.
            least_flow: Least flow of a span, as share of nominal.
            doubt: See `DOUBT`; infinity = every step is tried again.
        """
        site = model.site
        self.least_flow = least_flow
        self.film: FloatArray = np.zeros(site.paintable.shape)
        if film is not None:
            self.film += film
        self._doubt = doubt
        self._laid: list[_Laid] = []
        self._model, self._cost, self._raster = model, cost, raster
        self._cell_costs = cost.on(site.paintable, site.keepout)
        size = 2 * round(_GUN_REACH / site.cell) + 1
        self._tops = maximum_filter(site.height, size=size) + _GUN_FRONT
        self._tops[self._tops <= _GUN_FRONT] = 0.0  # The wall has its own clearance.
        self._tops = np.maximum(self._tops, site.nearest)
        # While spans are fitted: what each cell costs, and the slope of that.
        self._costs: FloatArray = np.zeros(site.paintable.shape)
        self._slopes: FloatArray = np.zeros(site.paintable.shape)

    @property
    def spans(self) -> tuple[Span, ...]:
        """The spans so far."""
        return tuple(laid.span for laid in self._laid)

    def clear_rows(
        self, x: FloatArray, standoff: float, slant: float = 0.0
    ) -> BoolArray:
        """Returns the rows on which the gun is in reach and clears what stands out.

        Args:
            x: (n,) m, lines, where they meet T y = 0.
            standoff: Nozzle to wall, m.
            slant: Of the lines, m/m.

        Returns:
            (ny, n); False where a line is off the site.
        """
        site = self._model.site
        ny, nx = site.paintable.shape
        places = x + slant * site.y[:, None]
        columns = np.floor(places / site.cell).astype(int) + site.border
        inside = (columns >= 0) & (columns < nx)
        tops = self._tops[np.arange(ny)[:, None], np.clip(columns, 0, nx - 1)]
        return np.asarray(inside & (tops <= standoff))

    def add(self, span: Span) -> None:
        """Adds a span and its film."""
        laid = self._lay(span, self._is_clear(span))
        self._laid.append(laid)
        self.film[laid.window] += laid.film

    def fit(self) -> None:
        """Varies the spans until nothing helps; drops those that gain nothing."""
        everywhere = Window(*(slice(0, count) for count in self.film.shape))
        self._change(everywhere, self.film, self._cell_costs(self.film))
        site = self._model.site
        has_openings = site.keepout.any() and not site.stands_out
        finest = (_FINEST,) if has_openings else ()
        for across, along, flow, standoff in (*_STEPS, *finest):
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
            if span.length > _SHORTEST_SLANTED:
                steps.append(("slant", 2.0 * across / span.length))
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
        """Returns a span with one number varied, or None if that is infeasible."""
        raster, span = self._raster, laid.span
        trial = span._replace(**{name: getattr(span, name) + step})
        if name == "slant":
            # About the middle.
            middle = 0.5 * (span.low + span.high)
            trial = trial._replace(x=span.x_at(middle) - trial.slant * middle)
            if abs(trial.slant) > MOST_SLANT:
                return None
        if name == "standoff":
            # The flow goes with the fan's width: the film's thickness stays.
            trial = trial._replace(flow=span.flow * trial.standoff / span.standoff)
            if not raster.cut_in_standoff <= trial.standoff <= raster.standoff:
                return None
        if not self.least_flow <= trial.flow <= 1.0 + 1e-9:
            return None
        if trial.high - trial.low < raster.min_stroke:
            return None
        is_on_line = laid.is_clear and name in ("flow", "low", "high")
        if is_on_line and trial.low >= span.low and trial.high <= span.high:
            return trial
        return trial if self._is_clear(trial) else None

    def _is_clear(self, span: Span) -> bool:
        """Returns whether the gun is in reach and clear all along a span."""
        site = self._model.site
        rows = slice(site.row(span.low), site.row(span.high))
        if rows.start >= rows.stop:
            return False
        if span.slant == 0.0:
            columns = np.array([math.floor(span.x / site.cell) + site.border])
        else:
            places = span.x + span.slant * site.y[rows]
            columns = np.floor(places / site.cell).astype(int) + site.border
        if columns.min() < 0 or columns.max() >= site.paintable.shape[1]:
            return False
        tops = self._tops[np.arange(rows.start, rows.stop), columns]
        return bool(tops.max() <= span.standoff)

    def _try(self, index: int, step: _Step) -> bool:
        """Takes a step of a span if that lowers the cost."""
        laid = self._laid[index]
        if step in laid.failed:
            failure = laid.failed[step]
            if failure is None or self._is_hopeless(failure):
                return False
        span, trial = laid.span, self._varied(laid, *step)
        if trial is None:
            laid.failed[step] = None
            return False
        name, size = step
        if name == "flow":
            window = laid.window
            change = laid.film * (trial.flow / span.flow - 1.0)
        else:
            line, new = reached(self._model, trial)
            old = laid.window
            if name in ("low", "high"):
                # The film beyond the blur of the end that moves is as it was.
                low, high = sorted((getattr(span, name), getattr(trial, name)))
                rows = self._model.rows(low, high, span.standoff)
                old, new = old.cut(rows), new.cut(rows)
            window = old.hull(new)
            change = np.zeros(window.shape)
            part = window.part(change, new)
            part += span_film(self._model, trial, line, new)
            part = window.part(change, old)
            part -= laid.window.part(laid.film, old)
        film, costs, gain = self._weigh(window, change)
        gain += stroke_cost(span.length) - stroke_cost(trial.length)
        if gain < _GAIN:
            laid.failed[step] = self._failure(window, change, gain)
            return False
        self._change(window, film, costs)
        laid = self._laid[index] = self._lay(trial, is_clear=True, failed=laid.failed)
        # The step back would only undo this one.
        laid.failed[name, -size] = self._failure(window, -change, -gain)
        return True

    def _drop(self) -> int:
        """Drops spans without which the film costs no more; returns how many."""
        kept: list[_Laid] = []
        for laid in self._laid:
            if laid.kept is None or not self._is_hopeless(laid.kept):
                window, change = laid.window, -laid.film
                film, costs, gain = self._weigh(window, change)
                gain += stroke_cost(laid.span.length)
                if gain > 0.0:
                    self._change(window, film, costs)
                    continue
                laid.kept = self._failure(window, change, gain)
            kept.append(laid)
        dropped = len(self._laid) - len(kept)
        self._laid = kept
        return dropped

    def _weigh(
        self, window: Window, change: FloatArray
    ) -> tuple[FloatArray, FloatArray, float]:
        """Returns the film with a change, its costs, and what the change gains, m²."""
        film = self.film[window] + change
        costs = self._cell_costs(film, window)
        gain = float((self._costs[window] - costs).sum()) * self._model.site.cell**2
        return film, costs, gain

    def _change(self, window: Window, film: FloatArray, costs: FloatArray) -> None:
        """Replaces the film and its costs on a window."""
        self.film[window], self._costs[window] = film, costs
        above = self._cell_costs(film + _EITHER_SIDE, window)
        below = self._cell_costs(film - _EITHER_SIDE, window)
        self._slopes[window] = (above - below) / (2.0 * _EITHER_SIDE)

    def _failure(self, window: Window, change: FloatArray, gain: float) -> _Failure:
        return _Failure(window, change, gain - self._promise(window, change))

    def _promise(self, window: Window, change: FloatArray) -> float:
        """Returns what a change of the film gains by the slopes of the costs, m²."""
        rise = float(np.einsum("ij,ij", self._slopes[window], change))
        return -rise * self._model.site.cell**2

    def _is_hopeless(self, failure: _Failure) -> bool:
        """Returns whether a failed step would still gain nothing, by the slopes."""
        gain = self._promise(failure.window, failure.change) + failure.rest
        return gain + self._doubt * abs(failure.rest) < _GAIN

    def _lay(
        self,
        span: Span,
        is_clear: bool,
        failed: Mapping[_Step, _Failure | None] = MappingProxyType({}),
    ) -> _Laid:
        """Returns a span with its film; `failed` are the steps of its predecessor."""
        line, window = reached(self._model, span)
        film = span_film(self._model, span, line, window)
        laid = _Laid(span, window, film, is_clear)
        laid.failed = {step: why for step, why in failed.items() if why is not None}
        return laid
