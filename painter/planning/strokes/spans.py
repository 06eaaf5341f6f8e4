"""Strokes while they are fitted, and the film that each leaves on a site."""

from typing import NamedTuple

import numpy as np

from painter.planning.film.film_model import FilmModel, Line
from perception.ground import BoolArray, FloatArray


class Span(NamedTuple):
    """A stroke while it is fitted; m, flow as share of nominal.

    It goes up from T y `low` to `high`, and `slant` m to the right for each metre up;
    `x` is where its line meets T y = 0.
    """

    x: float
    low: float
    high: float
    standoff: float
    flow: float
    slant: float = 0.0

    def x_at(self, y: float) -> float:
        """Returns T x at T y, m."""
        return self.x + self.slant * y

    @property
    def length(self) -> float:
        """From end to end along T y, m."""
        return self.high - self.low


class Window(NamedTuple):
    """Rows and columns of a site."""

    rows: slice
    columns: slice

    @property
    def shape(self) -> tuple[int, int]:
        """How many rows and columns it has."""
        rows, columns = self
        return rows.stop - rows.start, columns.stop - columns.start

    def hull(self, other: "Window") -> "Window":
        """Returns the least window that holds both."""
        (rows, columns), (other_rows, other_columns) = self, other
        return Window(
            slice(min(rows.start, other_rows.start), max(rows.stop, other_rows.stop)),
            slice(
                min(columns.start, other_columns.start),
                max(columns.stop, other_columns.stop),
            ),
        )

    def cut(self, rows: slice) -> "Window":
        """Returns its part in some rows; it may be empty."""
        start = max(self.rows.start, rows.start)
        stop = max(min(self.rows.stop, rows.stop), start)
        return Window(slice(start, stop), self.columns)

    def part(self, film: FloatArray, other: "Window") -> FloatArray:
        """Returns the part of a film on this window that lies in another one, too."""
        (rows, columns), (other_rows, other_columns) = self, other
        first, left = other_rows.start - rows.start, other_columns.start - columns.start
        return film[
            max(first, 0) : max(other_rows.stop - rows.start, 0),
            max(left, 0) : other_columns.stop - columns.start,
        ]


def runs(on: BoolArray) -> list[list[int]]:
    """Returns the runs of True in a row (n,): first index and end of each."""
    edges = np.flatnonzero(np.diff(on, prepend=False, append=False))
    pairs: list[list[int]] = edges.reshape(-1, 2).tolist()
    return pairs


def reached(model: FilmModel, span: Span) -> tuple[Line, Window]:
    """Returns a span's line and the cells that its film reaches."""
    rows = model.rows(span.low, span.high, span.standoff)
    line = model.line(span.x, span.standoff, span.slant, rows)
    return line, Window(rows, slice(*line.columns))


def span_film(model: FilmModel, span: Span, line: Line, window: Window) -> FloatArray:
    """Returns the film that a span leaves on its window, as share of nominal."""
    first, stop = window.rows.start, window.rows.stop
    film = np.asarray(span.flow * line.film[line.own(window.rows)])
    begun = model.rows(span.low, span.low, span.standoff)
    ended = model.rows(span.high, span.high, span.standoff)
    if begun.stop > ended.start:
        share = model.below(line, window.rows, span.low)
        share -= model.below(line, window.rows, span.high)
        film *= share
        return film
    # In between all of the fan passes over each cell.
    if first < begun.stop:
        rows = slice(first, min(begun.stop, stop))
        film[: rows.stop - first] *= model.below(line, rows, span.low)
    if ended.start < stop:
        rows = slice(max(first, ended.start), stop)
        film[rows.start - first :] *= 1.0 - model.below(line, rows, span.high)
    return film
