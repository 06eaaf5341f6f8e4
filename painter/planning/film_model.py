"""Film of strokes on what was seen of a tile: shaded by what stands out, fast to vary.

`deposition` gives the film on a bare plane. Here the fan lands on a height field, row
by row: along the fan's long axis a ray lands on the first column in its way, in closed
form, and across it the fan's thickness blurs the stroke's ends. Film is given as a
share of the nominal film.
"""

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import betainc

from painter.planning.config import TipConfig
from painter.planning.deposition import half_axes
from painter.planning.spray_path import Stroke
from perception.values import BoolArray, FloatArray, FrozenValue

# Beyond the tile's edges by so much the film is looked at, m: more than half a fan.
MARGIN = 0.14
_TABLE = np.linspace(-1.0, 1.0, 2001)


def margin_cells(cell: float) -> int:
    """Returns how many cells of edge `cell`, m, the margin is wide."""
    return int(np.ceil(MARGIN / cell))


@dataclass(frozen=True, eq=False)
class Site(FrozenValue):
    """A tile and a margin around it, as far as spraying is concerned.

    Attributes:
        wanted: (ny, nx) bool, to be painted.
        clean: (ny, nx) bool, in the tile and to stay clean.
        height: (ny, nx) m, along T z.
        cell: Edge of a cell, m; cell (0, 0) begins at -`border` cells in T.
        border: Cells of margin on each side.
    """

    wanted: BoolArray
    clean: BoolArray
    height: FloatArray
    cell: float
    border: int

    @classmethod
    def of_tile(
        cls, mask: BoolArray, cell: float, height: FloatArray | None = None
    ) -> "Site":
        """Makes the site of a tile.

        Args:
            mask: (ny, nx) bool, True = to be painted.
            cell: Edge of a cell, m.
            height: (ny, nx) m along T z, NaN = nothing seen there; what lies
                farther back than the margin is taken there. None = a plane.
        """
        border = margin_cells(cell)
        flat = np.zeros(mask.shape) if height is None else np.where(mask, 0.0, height)
        return cls(
            wanted=np.pad(mask, border),
            clean=np.pad(~mask, border),
            height=np.pad(np.fmax(flat, -MARGIN), border),
            cell=cell,
            border=border,
        )

    @functools.cached_property
    def x(self) -> FloatArray:
        """(nx,) m, centres of the columns in T."""
        return np.asarray(
            (np.arange(self.wanted.shape[1]) - self.border + 0.5) * self.cell
        )

    @functools.cached_property
    def y(self) -> FloatArray:
        """(ny,) m, centres of the rows in T."""
        return np.asarray(
            (np.arange(self.wanted.shape[0]) - self.border + 0.5) * self.cell
        )


@dataclass(frozen=True, eq=False)
class Line(FrozenValue):
    """What the fan leaves on each cell in passing along a line.

    Attributes:
        columns: First and end column of the window.
        film: (ny, n) film of an endless stroke with full flow.
        thickness: (n,) m, half the fan's thickness at each column.
    """

    columns: tuple[int, int]
    film: FloatArray
    thickness: FloatArray

    @functools.cached_property
    def blur(self) -> float:
        """How far from a stroke's end its film is not yet or still whole, m."""
        return float(self.thickness.max())


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
        self._cdf = betainc(tip.gamma + 1.0, tip.gamma + 1.0, 0.5 + 0.5 * _TABLE)
        self._across = betainc(tip.beta2, tip.beta2, 0.5 + 0.5 * _TABLE)
        self._lines: dict[tuple[float, float], Line] = {}

    def line(self, x_line: float, standoff: float) -> Line:
        """Returns the line at `x_line`, m in T, sprayed from `standoff`, m."""
        key = (round(x_line, 4), round(standoff, 4))
        if key not in self._lines:
            self._lines[key] = self._make_line(*key)
        return self._lines[key]

    def passed(self, line: Line, y: FloatArray, low: float, high: float) -> FloatArray:
        """Returns the share of a line's film that a stroke of it leaves.

        Args:
            line: The line.
            y: (k,) m, rows.
            low: Where the stroke begins or ends, m.
            high: Where it ends or begins, m.

        Returns:
            (k, n): the share of the fan's thickness that has passed over each cell.
        """
        ends = [(y[:, None] - end) / line.thickness for end in (low, high)]
        below, above = (np.interp(end, _TABLE, self._across) for end in ends)
        return np.asarray(below - above)

    def film(self, strokes: Sequence[Stroke]) -> FloatArray:
        """Returns the film of strokes on the site, (ny, nx), as share of nominal."""
        film = np.zeros(self.site.wanted.shape)
        for stroke in strokes:
            line = self.line(float(stroke.start_T[0]), stroke.standoff)
            low, high = sorted((float(stroke.start_T[1]), float(stroke.end_T[1])))
            share = self.passed(line, self.site.y, low, high)
            scale = stroke.flow * self._speed / stroke.speed
            film[:, slice(*line.columns)] += scale * line.film * share
        return film

    def _make_line(self, x_line: float, standoff: float) -> Line:
        site, cell = self.site, self.site.cell
        a, b = half_axes(self._tip, standoff)
        middle = int(np.floor(x_line / cell)) + site.border
        # What lies back is reached by rays that went past the fan's width on the wall.
        spread = 1.0 - min(float(site.height.min()), 0.0) / standoff
        reach = int(np.ceil(spread * a / cell)) + 1
        count = site.wanted.shape[1]
        first, end = max(middle - reach, 0), min(middle + reach + 1, count)
        # Rows that are as the one below them are looked at once.
        height = site.height[:, first:end]
        new = np.append(True, (height[1:] != height[:-1]).any(axis=1))
        back = np.cumsum(new) - 1
        drop = np.maximum(standoff - height[new], 1e-6)
        edges = (np.arange(first, end + 1) - site.border) * cell - x_line
        # The steepest ray that has landed by each column's far edge, on either side;
        # a column higher than the nozzle stops them all.
        split = min(max(middle - first, 0), end - first)
        share = np.zeros_like(drop)
        right = self._landed(edges[split + 1 :], drop[:, split:], standoff / a)
        left = self._landed(
            -edges[: split + 1][::-1], drop[:, : split + 1][:, ::-1], standoff / a
        )
        share[:, split:] += right
        share[:, : split + 1] += left[:, ::-1]
        centres = site.x[first:end] - x_line
        thin = b * np.sqrt(np.clip(1.0 - (centres / a) ** 2, 1e-4, None))
        film = share[back] * (self._dose / cell)
        return Line((first, end), film, thin)

    def _landed(self, far: FloatArray, drop: FloatArray, scale: float) -> FloatArray:
        """Returns the flow's share on each column outwards from the spray axis.

        Args:
            far: (n,) m, far edges of the columns.
            drop: (k, n) m, nozzle over each column.
            scale: From a ray's slope to the fan's coordinate u.
        """
        steepest = np.maximum.accumulate(far / drop, axis=1) * scale
        flow = np.interp(np.maximum(steepest, 0.0), _TABLE, self._cdf)
        return np.diff(flow, axis=1, prepend=0.5)
