"""Film of strokes on a tile as it was seen: shaded by what stands out, fast to vary.

`deposition` gives the film on a bare plane. Here the fan lands on a height field, row
by row: along the fan's long axis a ray lands on the first column in its way, in closed
form, and across it the fan's thickness blurs the stroke's ends. A stroke may be
slanted; its fan stays level, so each row gets the same fan at another place. Film is
given as a share of the nominal film.
"""

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.special import betainc

from painter.planning.config import TipConfig
from painter.planning.film.deposition import half_axes
from painter.planning.spray_path import Stroke
from perception.ground import BoolArray, FloatArray, FrozenValue, IntArray

MARGIN = 0.14  # m around the tile on which film is counted: more than half a fan.
_STANDS_OUT = 0.02  # m in front of the wall; less than that hardly shades it.
_TABLE = np.linspace(-1.0, 1.0, 2001)
_BLOCK = 16  # Rows of a line that are made together.


def margin_cells(cell: float) -> int:
    """Returns how many cells of edge `cell`, m, the margin is wide."""
    return int(np.ceil(MARGIN / cell))


@dataclass(frozen=True, eq=False)
class Site(FrozenValue):
    """A tile and a margin around it, for planning its film.

    Attributes:
        paintable: (ny, nx) bool, to be painted.
        keepout: (ny, nx) bool, the rest of the tile.
        height: (ny, nx) m, along T z.
        nearest: (ny, nx) m, least stand-off from which the arm can spray there.
        cell: Edge of a cell, m; cell (0, 0) begins at -`border` cells in T.
        border: Cells of margin on each side.
    """

    paintable: BoolArray
    keepout: BoolArray
    height: FloatArray
    nearest: FloatArray
    cell: float
    border: int

    @classmethod
    def of_tile(
        cls,
        mask: BoolArray,
        cell: float,
        height: FloatArray | None = None,
        nearest: FloatArray | None = None,
    ) -> "Site":
        """Makes the site of a tile.

        Args:
            mask: (ny, nx) bool, True = to be painted.
            cell: Edge of a cell, m.
            height: (ny, nx) m along T z, NaN = nothing seen there; none is taken to
                lie farther back than `MARGIN`. None = a plane.
            nearest: (ny, nx) m, on the tile and the margin, the least stand-off that
                the arm's reach allows; None = any.
        """
        border = margin_cells(cell)
        paintable = np.pad(mask, border)
        flat = np.zeros(mask.shape) if height is None else np.where(mask, 0.0, height)
        return cls(
            paintable=paintable,
            keepout=np.pad(~mask, border),
            height=np.pad(np.fmax(flat, -MARGIN), border),
            nearest=np.zeros(paintable.shape) if nearest is None else nearest,
            cell=cell,
            border=border,
        )

    @functools.cached_property
    def stands_out(self) -> bool:
        """Whether anything on the tile stands out of the wall and shades it."""
        return bool((self.height > _STANDS_OUT).any())

    @functools.cached_property
    def deepest(self) -> float:
        """The lowest height, at most that of the wall, 0, m."""
        return min(float(self.height.min()), 0.0)

    @functools.cached_property
    def steps(self) -> BoolArray:
        """(ny, nx) bool, where the height differs from that of the row below."""
        steps = np.ones(self.height.shape, dtype=bool)
        steps[1:] = self.height[1:] != self.height[:-1]
        return steps

    def row(self, y: float) -> int:
        """Returns the row at `y`, m in T, at least 0 and at most the row count."""
        row = math.floor(y / self.cell) + self.border
        return min(max(row, 0), len(self.height))

    @functools.cached_property
    def x(self) -> FloatArray:
        """(nx,) m, centres of the columns in T."""
        return np.asarray(
            (np.arange(self.paintable.shape[1]) - self.border + 0.5) * self.cell
        )

    @functools.cached_property
    def y(self) -> FloatArray:
        """(ny,) m, centres of the rows in T."""
        return np.asarray(
            (np.arange(self.paintable.shape[0]) - self.border + 0.5) * self.cell
        )


@dataclass(frozen=True, eq=False)
class Line(FrozenValue):
    """The film that the fan leaves on each cell in passing along a line.

    Attributes:
        columns: First and end column of the window.
        first_row: First of the k rows of the site that it was made on.
        film: (k, n) film of an endless stroke with full flow.
        thickness: (k, n) m, half the fan's thickness as it passes over each cell.
    """

    columns: tuple[int, int]
    first_row: int
    film: FloatArray
    thickness: FloatArray

    def own(self, rows: slice) -> slice:
        """Returns rows of the site counted from the line's first row."""
        return slice(rows.start - self.first_row, rows.stop - self.first_row)


class _Ground(NamedTuple):
    """The ground under an upright line: the j distinct rows of its k rows.

    Attributes:
        columns: First and end column of the window.
        edges: (2 `reach` + 2,) edges, in columns, of the columns that rays reach.
        height: (j, 2 `reach` + 1) m, of these columns.
        recess: (j, n) m, heights of the window that are below the wall, else 0.
        which: (k,) which of the j distinct rows each row equals.
    """

    columns: tuple[int, int]
    edges: IntArray
    height: FloatArray
    recess: FloatArray
    which: IntArray

    def on_rows(self, values: FloatArray) -> FloatArray:
        """Returns (j, n) values on all k rows, (k, n)."""
        if len(values) > 1:
            return np.asarray(values[self.which])
        return np.broadcast_to(values, (self.which.size, values.shape[1]))


def _ground_under(site: Site, middle: int, reach: int, low: int, high: int) -> _Ground:
    """Returns the ground under an upright line over a column, on rows of a site."""
    count = site.paintable.shape[1]
    first = min(max(middle - reach, 0), count - 1)
    end = min(max(middle + reach, first) + 1, count)
    # A row that equals the one below it is evaluated once.
    new: BoolArray = np.array(site.steps[low:high, first:end].any(axis=1))
    new[0] = True
    rows = low + np.flatnonzero(new)
    edges = np.arange(middle - reach, middle + reach + 2)
    inside = np.minimum(np.maximum(edges[:-1], 0), count - 1)
    return _Ground(
        (first, end),
        edges,
        site.height[rows[:, None], inside],
        np.minimum(site.height[rows, first:end], 0.0),
        np.cumsum(new) - 1,
    )


class FilmModel:
    """Film on a site, by line, stroke and program; lines are made once."""

    def __init__(
        self, site: Site, *, tip: TipConfig, speed: float, nominal: float
    ) -> None:
        """Takes the site.

        Args:
            site: Tile and margin.
            tip: The spray tip, its fan's long axis along T x.
            speed: Of strokes, m/s.
            nominal: Film that counts as 1, m.
        """
        self.site = site
        self._tip = tip
        self._dose = tip.flow * tip.transfer_efficiency / (speed * nominal)
        self._speed = speed
        _, self._spread = half_axes(tip, 1.0)  # Half the fan's thickness at 1 m.
        self._cdf = betainc(tip.gamma + 1.0, tip.gamma + 1.0, 0.5 + 0.5 * _TABLE)
        self._across = betainc(tip.beta2, tip.beta2, 0.5 + 0.5 * _TABLE)
        self._lines: dict[tuple[float, float, float, int, int], Line] = {}
        self._ground: dict[tuple[int, int, int, int], _Ground] = {}

    def rows(self, low: float, high: float, standoff: float) -> slice:
        """Returns the rows that a stroke's film reaches.

        Args:
            low: Where it begins or ends, m in T y.
            high: Where it ends or begins, m in T y.
            standoff: From which it is sprayed, m.
        """
        site = self.site
        b = self._spread * (standoff - site.deepest)
        return slice(site.row(low - b), site.row(high + b) + 1)

    def line(
        self,
        x_line: float,
        standoff: float,
        slant: float = 0.0,
        rows: slice | None = None,
    ) -> Line:
        """Returns a line.

        Args:
            x_line: Where it meets T y = 0, m in T.
            standoff: From which it is sprayed, m.
            slant: How far it goes to the right, m per m up.
            rows: Rows of the site to make it on; None = all.
        """
        first, stop = 0, len(self.site.y)
        if rows is not None:
            first = rows.start // _BLOCK * _BLOCK
            stop = min(-(-rows.stop // _BLOCK) * _BLOCK, stop)
        key = (round(x_line, 4), round(standoff, 4), round(slant, 4), first, stop)
        if key not in self._lines:
            self._lines[key] = self._make_line(*key)
        return self._lines[key]

    def below(self, line: Line, rows: slice, end: float) -> FloatArray:
        """Returns the share of the fan that lies below each cell.

        A stroke leaves the share of a line's film that lies below the fan at its upper
        end, less the share that lies below it at its lower end.

        Args:
            line: The line.
            rows: Rows of the site, k of them.
            end: Where on the line the spray axis is, m in T y.

        Returns:
            (k, n) 0 to 1, by flow.
        """
        offset = self.site.y[rows, None] - end
        return np.asarray(
            np.interp(offset / line.thickness[line.own(rows)], _TABLE, self._across)
        )

    def film(self, strokes: Sequence[Stroke]) -> FloatArray:
        """Returns the film of strokes on the site, (ny, nx), as share of nominal."""
        film = np.zeros(self.site.paintable.shape)
        for stroke in strokes:
            x, y = (float(value) for value in stroke.start_T)
            x_end, y_end = (float(value) for value in stroke.end_T)
            slant = (x_end - x) / (y_end - y)
            low, high = min(y, y_end), max(y, y_end)
            rows = self.rows(low, high, stroke.standoff)
            line = self.line(x - slant * y, stroke.standoff, slant, rows)
            share = self.below(line, rows, low) - self.below(line, rows, high)
            scale = stroke.flow * self._speed / stroke.speed
            film[rows, slice(*line.columns)] += (
                scale * line.film[line.own(rows)] * share
            )
        return film

    def _make_line(
        self, x_line: float, standoff: float, slant: float, low: int, high: int
    ) -> Line:
        """Makes a line on the rows from `low` up to `high`."""
        a, _ = half_axes(self._tip, standoff)
        # A recess is reached by rays beyond the fan's width on the wall.
        reach = math.ceil((1.0 - self.site.deepest / standoff) * a / self.site.cell) + 1
        if slant == 0.0:
            return self._make_upright(x_line, standoff, reach, low, high)
        return self._make_slanted(x_line, standoff, slant, reach, low, high)

    def _make_upright(
        self, x_line: float, standoff: float, reach: int, low: int, high: int
    ) -> Line:
        """Makes an upright line: all rows have the same columns."""
        site, cell = self.site, self.site.cell
        middle = math.floor(x_line / cell) + site.border
        key = (middle, reach, low, high)
        if key not in self._ground:
            self._ground[key] = _ground_under(site, *key)
        ground = self._ground[key]
        first, end = ground.columns
        edges = np.asarray((ground.edges - site.border) * cell - x_line)
        share = self._shares(standoff - ground.height, edges, standoff, reach)
        share *= self._dose / cell
        landed = _between(share, middle - reach, first, end)
        thickness = self._thickness(
            site.x[first:end] - x_line, standoff - ground.recess
        )
        return Line(
            ground.columns, low, ground.on_rows(landed), ground.on_rows(thickness)
        )

    def _make_slanted(
        self,
        x_line: float,
        standoff: float,
        slant: float,
        reach: int,
        low: int,
        high: int,
    ) -> Line:
        """Makes a slanted line: each row has its own columns."""
        site, cell = self.site, self.site.cell
        count = site.paintable.shape[1]
        axis = (x_line + slant * site.y[low:high])[:, None]
        middle = np.floor(axis / cell).astype(int) + site.border
        columns = middle + np.arange(-reach, reach + 1)
        inside = np.minimum(np.maximum(columns, 0), count - 1)
        height = np.take_along_axis(site.height[low:high], inside, axis=1)
        edges = (columns[:, :1] - site.border) * cell - axis
        edges = edges + cell * np.arange(2 * reach + 2)
        share = self._shares(standoff - height, edges, standoff, reach)
        # A metre of a slanted stroke is less than a metre up.
        share *= math.hypot(1.0, slant) * self._dose / cell

        leftmost, rightmost = sorted((int(middle[0, 0]), int(middle[-1, 0])))
        first = min(max(leftmost - reach, 0), count - 1)
        end = min(max(rightmost + reach, first) + 1, count)
        begin = leftmost - reach
        film = np.zeros((high - low, rightmost + reach + 1 - begin))
        np.put_along_axis(film, columns - begin, share, axis=1)
        film = _between(film, begin, first, end)
        drop = standoff - np.minimum(site.height[low:high, first:end], 0.0)
        thickness = self._thickness(site.x[first:end] - axis, drop)
        return Line((first, end), low, film, thickness)

    def _thickness(self, offset: FloatArray, drop: FloatArray) -> FloatArray:
        """Returns half the fan's thickness, m, on cells.

        Args:
            offset: Of the cells from the fan's axis, m.
            drop: Nozzle over each, m: the farther, the thicker the fan. What stands
                out counts as wall: its sides catch the rays that would pass it.
        """
        a, b = half_axes(self._tip, 1.0)
        off = offset / (a * drop)
        return np.asarray(b * drop * np.sqrt(np.maximum(1.0 - off**2, 1e-4)))

    def _shares(
        self, drop: FloatArray, edges: FloatArray, standoff: float, reach: int
    ) -> FloatArray:
        """Returns the flow's share on each column.

        Args:
            drop: (k, 2 `reach` + 1) m, nozzle over each column.
            edges: (k or none, 2 `reach` + 2) m, of the columns, from the spray axis,
                which is over the middle one.
            standoff: Nozzle to wall, m.
            reach: Columns on either side of the axis.
        """
        a, _ = half_axes(self._tip, standoff)
        drop = np.maximum(drop, 1e-6)
        # The steepest ray that has landed by each column's far edge, on either side of
        # the axis; a column higher than the nozzle stops all rays.
        steepest = np.empty((2, len(drop), reach + 1))
        np.divide(edges[..., reach + 1 :], drop[:, reach:], out=steepest[0])
        np.divide(-edges[..., reach::-1], drop[:, reach::-1], out=steepest[1])
        np.maximum.accumulate(steepest, axis=-1, out=steepest)
        steepest *= standoff / a
        flow = np.interp(np.maximum(steepest, 0.0, out=steepest), _TABLE, self._cdf)
        right, left = np.diff(flow, axis=-1, prepend=0.5)
        share = np.concatenate([left[:, :0:-1], right], axis=1)
        share[:, reach] += left[:, 0]
        return share


def _between(share: FloatArray, begin: int, first: int, end: int) -> FloatArray:
    """Returns the columns from `first` up to `end` of shares that start at `begin`."""
    film = np.zeros((len(share), end - first))
    left, right = max(begin, first), min(begin + share.shape[1], end)
    if left < right:
        film[:, left - first : right - first] = share[:, left - begin : right - begin]
    return film
