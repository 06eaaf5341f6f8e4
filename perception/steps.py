"""Fine steps: which parts of the tile rise from the wall's surface or lie behind it.

A part is no wall when its step is significant against what depths scatter there, not
when it passes a fixed number of centimetres. The scatter is measured on the wall
itself, block by block: so it holds the errors that fusing many pictures does not
average out (a camera's fixed pattern and ripple, errors of its pose), and plaster.
"""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter, uniform_filter

from perception.config import SegmentationConfig
from perception.values import BoolArray, FloatArray, FrozenValue, IntArray
from perception.wall_surface import WallSurface

_RIVAL_SHARE = 0.3
"""Points with less than this share of the best count in their sub-cell are ghosts."""
_LAYER = 0.010
"""Points that lie so close behind the foremost are of one surface with it, m."""
_BLOCK = 0.25
"""Edge of the blocks in which the scatter is measured, m."""
_LEAST_SAMPLES = 50
_WINDOW = 5
"""Sub-cells averaged to find low steps in strong noise."""


@dataclass(frozen=True, eq=False)
class SubCells(FrozenValue):
    """Foremost surface over the tile, split x split to a cell; row 0 at the bottom.

    Attributes:
        depth: (split ny, split nx) m along T z; NaN = nothing seen.
        variance: The same shape, m²: of the depth, as far as it is independent from
            point to point; 0 where that is not known.
    """

    depth: FloatArray
    variance: FloatArray


@dataclass(frozen=True, eq=False)
class Steps(FrozenValue):
    """Depth against the wall's surface, sub-cell by sub-cell.

    Attributes:
        residual: (split ny, split nx) m, positive towards the robot; NaN = not seen.
        sigma: Standard deviation of the residual on the wall, m.
        bound: Least significant step, m.
        level: True where the sub-cell is level with the wall's surface.
    """

    residual: FloatArray
    sigma: FloatArray
    bound: FloatArray
    level: BoolArray


def sub_cells(
    p_TQs: FloatArray,
    *,
    counts: IntArray | None,
    variances: FloatArray | None,
    width: float,
    height: float,
    cell: float,
    split: int,
) -> SubCells:
    """Takes the foremost surface of each sub-cell, as the gun meets it.

    Of several points above one sub-cell those that were measured much less often than
    the others are ghosts; of the rest the foremost, and what lies within a layer behind
    it, count by their measurements.

    Args:
        p_TQs: (3, N) m, in T.
        counts: (N,) measurements in each point; all alike if left out.
        variances: (N,) m², of one measurement of each point.
        width: Of the tile, m.
        height: Of the tile, m.
        cell: Edge of a cell, m.
        split: Sub-cells along a cell's edge.
    """
    nx, ny = (split * round(length / cell) for length in (width, height))
    columns, rows = np.floor(p_TQs[:2] * (split / cell)).astype(np.int64)
    inside = (columns >= 0) & (columns < nx) & (rows >= 0) & (rows < ny)
    own = (rows * nx + columns)[inside]
    z = p_TQs[2, inside]
    n = np.ones(z.size) if counts is None else counts[inside].astype(float)
    best = np.zeros(nx * ny)
    np.maximum.at(best, own, n)
    real = n >= _RIVAL_SHARE * best[own]
    own, z, n = own[real], z[real], n[real]
    front = np.full(nx * ny, -np.inf)
    np.maximum.at(front, own, z)
    top = z >= front[own] - _LAYER
    own, z, n = own[top], z[top], n[top]
    total = np.bincount(own, n, nx * ny)
    depth = np.full(nx * ny, np.nan)
    seen = total > 0
    depth[seen] = np.bincount(own, n * z, nx * ny)[seen] / total[seen]
    variance = np.zeros(nx * ny)
    if variances is not None:
        one = variances[inside][real][top]
        variance[seen] = np.bincount(own, n * one, nx * ny)[seen] / total[seen] ** 2
    return SubCells(depth.reshape(ny, nx), variance.reshape(ny, nx))


def find_steps(
    cells: SubCells, surface: WallSurface, *, cell: float, config: SegmentationConfig
) -> Steps:
    """Tells what is level with the wall from what is not.

    Low steps in strong noise show in the mean over a few sub-cells; such a mean blurs
    edges, so they are drawn where it passes half the step.

    Args:
        cells: Foremost surface.
        surface: The wall's own surface, on the grid of `cells`.
        cell: Edge of a sub-cell, m.
        config: `min_step` and `step_significance` are used.
    """
    residual = cells.depth - surface.height
    sigma, bound = _bounds(residual, cells.variance, surface.noise, cell, config)
    step = np.abs(residual) > bound
    clipped = np.clip(residual, -bound, bound)
    seen = np.isfinite(residual)
    share = uniform_filter(seen.astype(float), _WINDOW, mode="constant")
    mean = uniform_filter(np.where(seen, clipped, 0.0), _WINDOW, mode="constant")
    mean = np.where(seen & ~step, mean / np.maximum(share, 1e-9), np.nan)
    _, mean_bound = _bounds(mean, 0.0 * mean, surface.noise, cell, config)
    core = np.abs(mean) > mean_bound
    peak = maximum_filter(np.where(core, np.abs(mean), 0.0), 2 * _WINDOW - 1)
    step |= (peak > 0.0) & (np.abs(mean) > 0.5 * peak) & seen
    return Steps(residual=residual, sigma=sigma, bound=bound, level=seen & ~step)


def _bounds(
    residual: FloatArray,
    variance: FloatArray,
    noise: float,
    cell: float,
    config: SegmentationConfig,
) -> tuple[FloatArray, FloatArray]:
    """Returns the standard deviation of residuals and the least significant step."""
    sigma = np.sqrt(_scatter(residual, noise, cell) ** 2 + variance)
    return sigma, np.maximum(config.min_step, config.step_significance * sigma)


def _scatter(residual: FloatArray, noise: float, cell: float) -> FloatArray:
    """Returns the scatter about zero, m, block by block, spread over the grid.

    From the median of the absolute residuals, which half of the cells may be off
    without harm; what is a step for certain is left out before.
    """
    ny, nx = residual.shape
    size = max(1, round(_BLOCK / cell))
    off = np.abs(residual)
    off = np.where(off <= max(0.005, 8.0 * noise), off, np.nan)
    rows, columns = -(-ny // size), -(-nx // size)
    padded = np.full((rows * size, columns * size), np.nan)
    padded[:ny, :nx] = off
    blocks = padded.reshape(rows, size, columns, size).transpose(0, 2, 1, 3)
    blocks = np.sort(blocks.reshape(rows * columns, -1), axis=1)
    known = np.count_nonzero(np.isfinite(blocks), axis=1)
    whole = float(np.nanmedian(off)) if np.isfinite(off).any() else 0.0
    middle = blocks[np.arange(known.size), np.maximum(known - 1, 0) // 2]
    # A block with little wall in it is worth no more than the whole tile.
    middle = np.where(known >= _LEAST_SAMPLES, middle, whole)
    middle = 1.4826 * middle.reshape(rows, columns)
    return np.repeat(np.repeat(middle, size, axis=0), size, axis=1)[:ny, :nx]
