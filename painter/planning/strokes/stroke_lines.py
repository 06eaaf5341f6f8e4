"""Where the lines of a raster lie: the shortest way across the tile.

All strokes lie on one set of lines over the whole tile; restarting the lines beside
every opening would break the overlap that makes the film even. An edge of the wall that
runs along the lines needs one at the right distance: nearer, the fan paints the
keep-out; farther, a strip stays bare. `place_lines` weighs that for all edges at once.
What two neighbouring lines leave bare depends on these two alone, so the best set is a
shortest path from the tile's left edge to its right one, which dynamic programming
finds exactly.
"""

import math

import numpy as np
from scipy.special import beta

from painter.planning.config import TipConfig
from painter.planning.film.deposition import flow_share, half_axes
from painter.planning.film.figures import COVERED
from painter.planning.strokes.spray_settings import SpraySettings
from painter.planning.tile import cell_centres
from perception.ground import BoolArray, FloatArray, IntArray

# Costs are areas. Wall left bare counts once. Paint beside the wall counts by the area
# that it could have painted, times the first weight: a higher one trades coverage for
# less overspray. Wall whose film is uneven counts by the square of that, times the
# second.
# Source: chosen by benchmarks/findings/strokes.py so that every named scene keeps clear
# of both bounds.
_OVERSPRAY_WEIGHT = 1.85
_UNEVENNESS_WEIGHT = 0.25
# Steps that a pitch is divided into, the closest lines in steps, and how far the pitch
# may exceed the widest: the film's variation then grows by less than one percentage
# point at gamma = 2 (`raster_cv`).
_STEPS = 64
_CLOSEST = 40
_PITCH_SLACK = 0.02


EDGE_FLOW = 0.55  # Share of the nominal flow; see `lines_between`.


def wall_share(
    mask: BoolArray, cell: float, lines: FloatArray, *, tip: TipConfig, standoff: float
) -> FloatArray:
    """Returns the share of the fan's flow that lands on wall to be painted.

    Args:
        mask: (ny, nx) bool, True = to be painted; all outside it is not.
        cell: Edge of a cell, m.
        lines: (n,) m, x of the spray axis in T.
        tip: The spray tip, its fan's long axis along T x.
        standoff: Nozzle to wall, m.

    Returns:
        (ny, n) shares, one a row and line.
    """
    a, _ = half_axes(tip, standoff)
    x, _ = cell_centres(mask.shape, cell)
    flow = flow_share(x[:, None] - lines, a, tip.gamma) * cell
    return np.asarray(mask @ flow)


def place_lines(mask: BoolArray, cell: float, spray: SpraySettings) -> FloatArray:
    """Places the lines of a raster.

    Args:
        mask: (ny, nx) bool, True = to be painted, row 0 at the bottom of the tile.
        cell: Edge of a cell, m.
        spray: The tip and the settings of its strokes.

    Returns:
        (n,) m, x of the lines in T, ascending; nearly evenly spaced, never wider apart
        than the widest pitch and its slack.
    """
    tip, raster = spray
    width = mask.shape[1] * cell
    pitch = spray.nominal_pitch(width)
    step = pitch / _STEPS
    lines = step * np.arange(round(width / step) + 1)
    # Equal rows are evaluated once.
    rows, repeats = np.unique(mask, axis=0, return_counts=True)
    area = np.asarray(repeats * cell, dtype=np.float64)
    share = wall_share(rows, cell, lines, tip=tip, standoff=raster.standoff)
    on = share >= raster.wall_share
    overspray = area @ np.where(on, 1.0 - share, 0.0) * pitch

    reach = _reach(pitch, spray)
    bare = _BareWall(rows, cell, on, area, step=step, reach=reach)
    widest = math.floor((1.0 + _PITCH_SLACK) * spray.widest_pitch / step)
    gaps = np.arange(_CLOSEST, widest + 1)
    path = _shortest_path(_OVERSPRAY_WEIGHT * overspray, bare, gaps)
    return np.asarray(lines[path])


def lines_between(lines: FloatArray, width: float) -> FloatArray:
    """Returns lines half way between those of a raster, for every second coat.

    Beside the tile's left and right edge there is one more each, half way between the
    edge and the raster's own first line. Sprayed with `EDGE_FLOW` it replaces a line on
    the edge itself, which would spray half of its paint past it.

    Args:
        lines: (n,) m, ascending x of the raster's lines in T.
        width: Of the tile, m.

    Returns:
        (n + 1,) m.
    """
    middles = 0.5 * (lines[1:] + lines[:-1])
    edges = 0.5 * lines[0], 0.5 * (lines[-1] + width)
    return np.concatenate([edges[:1], middles, edges[1:]])


def _shortest_path(
    line_costs: FloatArray, bare: "_BareWall", gaps: IntArray
) -> list[int]:
    """Returns the places, in steps, of the lines that cost least.

    Args:
        line_costs: (count,) cost of a line at each place.
        bare: Gives the cost of two neighbours, and of the first and last line.
        gaps: Allowed distances between neighbours, in steps, ascending.
    """
    count = line_costs.size
    every = np.arange(count)
    near_left, near_right = every <= gaps[-1], count - 1 - every <= gaps[-1]
    first = np.where(near_left, bare.between(np.full(count, -1), every), np.inf)
    last = np.where(near_right, bare.between(every, np.full(count, count)), np.inf)
    between = np.full((gaps.size, count), np.inf)
    for i, gap in enumerate(gaps):
        left, right = every[:-gap], every[gap:]
        # The film between lines at another pitch than nominal is off by their ratio.
        uneven = _UNEVENNESS_WEIGHT * (_STEPS / gap - 1.0) ** 2
        between[i, gap:] = bare.between(left, right) + uneven * bare.wall(left, right)

    # cost[k] is that of the cheapest lines up to one at k, before[k] the one before it.
    cost = first + line_costs
    before = np.full(count, -1)
    for k in range(gaps[0], count):
        near = gaps[gaps <= k]
        ways = cost[k - near] + between[: near.size, k] + line_costs[k]
        best = int(np.argmin(ways))
        if ways[best] < cost[k]:
            cost[k], before[k] = ways[best], k - near[best]
    path = [int(np.argmin(cost + last))]
    while before[path[-1]] >= 0:
        path.append(int(before[path[-1]]))
    return path[::-1]


def _reach(pitch: float, spray: SpraySettings) -> float:
    """Returns how far from a line one stroke alone covers the wall, m."""
    gamma = spray.tip.gamma
    a, _ = half_axes(spray.tip, spray.raster.standoff)
    peak = pitch / (a * beta(0.5, gamma + 1.0))
    core = 1.0 - (COVERED / peak) ** (1.0 / gamma)
    return float(a * math.sqrt(max(core, 0.0)))


class _BareWall:
    """Area of wall that neighbouring lines leave bare; places are in steps."""

    def __init__(
        self,
        rows: BoolArray,
        cell: float,
        on: BoolArray,
        area: FloatArray,
        *,
        step: float,
        reach: float,
    ) -> None:
        count = on.shape[1]
        x = step * np.arange(count)
        sums = np.cumsum(np.pad(rows, ((0, 0), (1, 0))), axis=1) * cell
        cells = cell * np.arange(rows.shape[1] + 1)
        # Length of wall left of each line, by row; weighted sums give areas.
        self._wall = np.stack([np.interp(x, cells, row) for row in sums])
        # The tile's edges stand as lines -1 and `count` on which nothing is sprayed.
        self._on = np.pad(on, ((0, 0), (1, 1)))
        self._area = area
        self._last = count - 1
        self._reach = round(reach / step)

    def _length(self, left: IntArray, right: IntArray) -> FloatArray:
        left, right = np.clip(left, 0, self._last), np.clip(right, 0, self._last)
        length = self._wall[:, right] - self._wall[:, left]
        return np.asarray(np.clip(length, 0.0, None))

    def wall(self, left: IntArray, right: IntArray) -> FloatArray:
        """Returns the area of wall between lines, m²."""
        return np.asarray(self._area @ self._length(left, right))

    def between(self, left: IntArray, right: IntArray) -> FloatArray:
        """Returns the area of wall left bare between neighbouring lines, m²."""
        on_left, on_right = self._on[:, left + 1], self._on[:, right + 1]
        none = self._length(left, right)
        only_left = self._length(left + self._reach, right)
        only_right = self._length(left, right - self._reach)
        bare = np.where(on_left, np.where(on_right, 0.0, only_left), none)
        bare = np.where(~on_left & on_right, only_right, bare)
        return np.asarray(self._area @ bare)
