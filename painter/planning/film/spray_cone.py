"""Where a fan's paint lands on a real surface: rays of equal volume.

The elliptical double-beta fan of `painter.planning.film.deposition` is sampled by rays
of equal volume. A ray lands on the first surface in its way, so whatever stands out
shades what is behind it, and volume is conserved.
"""

import numpy as np
import numpy.typing as npt
from pydrake.math import RigidTransform
from scipy.special import betaincinv

from painter.planning.config import TipConfig
from painter.planning.film.deposition import half_axes
from perception.ground import FloatArray, IntArray

# Irrational steps that spread points evenly over the unit square, 1/g and 1/g² with
# g³ = g + 1. Source: Roberts, "The unreasonable effectiveness of quasirandom
# sequences", 2018 (R2 sequence).
_PLASTIC = 1.324717957244746
_STEPS = np.array([1.0 / _PLASTIC, 1.0 / _PLASTIC**2])
# A ray nearer to parallel with the surface than this (rise per run) never lands.
_GRAZING = 1e-6


class SprayCone:
    """A fan as rays of equal volume from the nozzle, spread over a short motion of it.

    Attributes:
        directions_G: (3, n) along each ray, in G, of length 1 along the spray axis.
        fractions: (n,) share of the motion, 0 to 1, at which each ray leaves.
    """

    def __init__(self, tip: TipConfig, *, ray_count: int = 512) -> None:
        """Samples the fan.

        The long axis takes evenly spaced quantiles, so that the profile of a stroke is
        right to one part in `ray_count`; thickness and time follow an even sequence.

        Args:
            tip: The spray tip.
            ray_count: Number of rays; a power of two shares the volume exactly.
        """
        order = np.arange(ray_count)
        long_quantile = (order + 0.5) / ray_count
        short_quantile, self.fractions = (0.5 + np.outer(_STEPS, order)) % 1.0
        # The two axes are independent beta laws on [-1, 1] in u = x / a and
        # s = y / (b sqrt(1 - u²)); see deposition.py.
        power = tip.gamma + 1.0
        u = 2.0 * betaincinv(power, power, long_quantile) - 1.0
        s = 2.0 * betaincinv(tip.beta2, tip.beta2, short_quantile) - 1.0
        a, b = half_axes(tip, 1.0)
        y = b * s * np.sqrt(1.0 - u**2)
        self.directions_G: FloatArray = np.stack([a * u, y, np.ones(ray_count)])

    def rays(
        self, X_SG_start: RigidTransform, X_SG_end: RigidTransform
    ) -> tuple[FloatArray, FloatArray]:
        """Returns the rays that leave while the nozzle moves from one pose to another.

        Each ray leaves at its own moment, so paint is spread along the motion however
        long it is; position and direction are interpolated linearly.

        Args:
            X_SG_start: Nozzle pose in S as the motion begins.
            X_SG_end: Nozzle pose as it ends.

        Returns:
            Origins (3, n), m, and directions (3, n), both in S.
        """
        d_start = X_SG_start.rotation().matrix() @ self.directions_G
        d_end = X_SG_end.rotation().matrix() @ self.directions_G
        p_start = X_SG_start.translation()[:, None]
        p_end = X_SG_end.translation()[:, None]
        origins = p_start + (p_end - p_start) * self.fractions
        return origins, d_start + (d_end - d_start) * self.fractions


class SpraySurface:
    """A surface as a height field over S x and y, on which rays land.

    Every cell is a column with a flat top. A ray that meets its side lands on it.

    Attributes:
        shape: (ny, nx) of the grid.
    """

    def __init__(self, height: FloatArray, *, cell: float, origin: FloatArray) -> None:
        """Makes the surface from a height field.

        Args:
            height: (ny, nx) m along S z, row 0 at the lowest y; NaN = nothing there.
            cell: Edge of a cell, m.
            origin: (2,) m, corner of the grid at its lowest x and y, in S.

        Raises:
            ValueError: There is no surface at all, or a shape or `cell` is wrong.
        """
        if height.ndim != 2 or not np.isfinite(height).any():
            raise ValueError(f"height must be 2-D with a surface, got {height.shape}.")
        if np.shape(origin) != (2,) or not cell > 0.0:
            raise ValueError(
                f"origin must be (2,) and cell > 0, got {origin!r} and {cell!r}."
            )
        self.cell = cell
        self.origin = np.array(origin, dtype=np.float64)
        self.shape: tuple[int, int] = height.shape
        # One row and column of nothing on each side: rays there miss.
        nothing = np.where(np.isnan(height), -np.inf, height)
        self._height = np.pad(nothing, 1, constant_values=-np.inf)
        self._bounds = _bounds(self._height)

    def land(
        self, origins: FloatArray, directions: FloatArray
    ) -> tuple[IntArray, FloatArray, int]:
        """Lands rays.

        A ray's volume is shared among the four nearest cells by distance, but never
        over a step higher than a cell's edge.

        Args:
            origins: (3, n) m, in S.
            directions: (3, n) in S, of any length.

        Returns:
            Cells (k,), row-major in (ny, nx), a cell more than once; the share of one
            ray that each gets (k,); and the number of rays that land nowhere. The
            shares and that number add up to n.
        """
        falls = directions[2] < -_GRAZING * np.hypot(directions[0], directions[1])
        origins, directions = origins[:, falls], directions[:, falls]
        missed = int(np.count_nonzero(~falls))
        if not falls.any():
            return np.zeros(0, dtype=np.int64), np.zeros(0), missed
        # Only heights below the rays matter: narrow the bounds from those of the whole
        # surface to those of the cells that the rays cross.
        box = self._crossed(origins, directions, *self._bounds)
        low, high = _bounds(self._height[box])
        if low == high and np.isfinite(self._height[box]).all():
            t = (low - origins[2]) / directions[2]
            x = self._grid(origins[:2] + t * directions[:2])
            return (*self._share_flat(x), missed)
        if not np.isfinite(low):
            return np.zeros(0, dtype=np.int64), np.zeros(0), missed + origins.shape[1]
        x, cell, hit = self._march(origins, directions, low, high)
        missed += int(np.count_nonzero(~hit))
        return (*self._share(x[:, hit], cell[:, hit]), missed)

    def _grid(self, p: FloatArray) -> FloatArray:
        """Returns x and y in cells of the padded grid; whole numbers are edges."""
        offset = self.origin.reshape(2, *[1] * (p.ndim - 1))
        return np.asarray((p - offset) / self.cell + 1.0)

    def _crossed(
        self, origins: FloatArray, directions: FloatArray, low: float, high: float
    ) -> tuple[slice, slice]:
        """Returns the rows and columns that rays cross from one height to another."""
        ends = []
        for z in (low, high):
            t = np.maximum((z - origins[2]) / directions[2], 0.0)
            ends.append(self._grid(origins[:2] + t * directions[:2]))
        both = np.concatenate(ends, axis=1)
        # Neighbours that share a ray's volume are half a cell farther.
        first = np.floor(both.min(axis=1) - 0.5).astype(int)
        last = np.floor(both.max(axis=1) + 0.5).astype(int)
        ny, nx = self._height.shape
        columns = slice(*np.clip([first[0], last[0] + 1], 0, nx))
        rows = slice(*np.clip([first[1], last[1] + 1], 0, ny))
        return _at_least_one(rows, ny), _at_least_one(columns, nx)

    def _march(
        self, origins: FloatArray, directions: FloatArray, low: float, high: float
    ) -> tuple[FloatArray, IntArray, npt.NDArray[np.bool_]]:
        """Follows rays from the highest to the lowest surface below them.

        Returns:
            Landing points (2, n) in cells of the padded grid, the cells (2, n) column
            and row that were hit, and (n,) whether anything was.
        """
        t_high = np.maximum((high - origins[2]) / directions[2], 0.0)
        t_low = np.maximum((low - origins[2]) / directions[2], 0.0)
        travel = np.abs(directions[:2]) * (t_low - t_high)
        # Half a cell a step: no column is stepped over but for its corners.
        steps = int(np.ceil(2.0 * travel.max() / self.cell)) + 1
        t = t_high + (t_low - t_high) * np.linspace(0.0, 1.0, steps + 1)[:, None]
        x = self._grid(origins[:2, None] + t * directions[:2, None])
        column, row = self._inside(x)
        height = self._height[row, column]
        below = origins[2] + t * directions[2] <= height + 1e-9
        hit = below.any(axis=0)
        first = np.argmax(below, axis=0)
        every = np.arange(first.size)
        cell = np.stack([column[first, every], row[first, every]])
        # Where the ray meets the column's top; before the last step still above it,
        # it met the side instead and lands in the middle of that column.
        top = np.where(hit, height[first, every], low)
        t_top = np.maximum((top - origins[2]) / directions[2], 0.0)
        landing = self._grid(origins[:2] + t_top * directions[:2])
        side = (np.floor(landing) != cell).any(axis=0)
        landing = np.where(side, cell + 0.5, landing)
        return landing, cell, hit

    def _inside(self, x: FloatArray) -> IntArray:
        """Returns the cells (column, row) of points; the padding stands for outside."""
        ny, nx = self._height.shape
        last = np.array([nx - 1, ny - 1]).reshape(2, *[1] * (x.ndim - 1))
        return np.clip(np.floor(x), 0, last).astype(np.int64)

    def _share_flat(self, x: FloatArray) -> tuple[IntArray, FloatArray]:
        """Shares rays among the four cells around each, all at one height."""
        corner = np.floor(x - 0.5).astype(np.int64)
        right, up = x - 0.5 - corner
        nx = self.shape[1]
        # Without the padding: one row and column back.
        first = (corner[1] - 1) * nx + corner[0] - 1
        cells = np.stack([first, first + 1, first + nx, first + nx + 1])
        rest, down = 1.0 - right, 1.0 - up
        shares = np.stack([rest * down, right * down, rest * up, right * up])
        return cells.ravel(), shares.ravel()

    def _share(self, x: FloatArray, cell: IntArray) -> tuple[IntArray, FloatArray]:
        """Shares rays among the four cells around each that continue the hit one."""
        corner = np.floor(x - 0.5).astype(np.int64)
        right, up = x - 0.5 - corner
        top = self._height[cell[1], cell[0]]
        cells, shares = [], []
        for i, across in ((0, 1.0 - right), (1, right)):
            for j, along in ((0, 1.0 - up), (1, up)):
                column, row = corner[0] + i, corner[1] + j
                level = np.abs(self._height[row, column] - top) <= self.cell
                cells.append((row - 1) * self.shape[1] + column - 1)
                shares.append(np.where(level, across * along, 0.0))
        # The share of a neighbour on another level stays on the hit cell.
        cells.append((cell[1] - 1) * self.shape[1] + cell[0] - 1)
        shares.append(1.0 - np.sum(shares, axis=0))
        given = np.ravel(shares) > 0.0
        return np.ravel(cells)[given], np.ravel(shares)[given]


def _bounds(height: FloatArray) -> tuple[float, float]:
    """Returns the lowest and highest surface, or (-inf, -inf) where there is none."""
    high = float(height.max())
    low = float(np.min(height, where=np.isfinite(height), initial=high))
    return low, high


def _at_least_one(span: slice, size: int) -> slice:
    """Returns a span that holds one of `size` cells even where it lies outside."""
    start = min(span.start, size - 1)
    return slice(start, max(span.stop, start + 1))
