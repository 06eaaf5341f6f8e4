"""Fine steps: which parts of the tile rise from the wall's surface or lie behind it.

A part is not wall if its step is significant against the scatter of depth there; there
is no fixed bound in centimetres. The scatter is measured on the wall itself, block by
block: so it includes the errors that fusing many pictures does not average out (fixed
pattern and ripple of the camera, errors of its pose), and plaster.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter, uniform_filter

from perception.config import SegmentationConfig
from perception.fine_steps.wall_surface import WallSurface, blocks_of
from perception.ground import BoolArray, FloatArray, FrozenValue, IntArray

_OUTLIER_SHARE = 0.3
"""Points with less than this share of the best count in their sub-cell are outliers."""
_LAYER = 0.010
"""Points so close behind the foremost are of the same surface, m."""
_BLOCK = 0.25
"""Edge of the blocks in which the scatter is measured, m."""
_LEAST_SAMPLES = 50
_WINDOW = 5
"""Sub-cells averaged to find low steps in strong noise."""
_HIGH = 2.0
"""Steps above so many bounds are not low; such means leave them out."""


@dataclass(frozen=True, eq=False)
class SubCells(FrozenValue):
    """Foremost surface over the tile, split x split to a cell; row 0 at the bottom.

    Attributes:
        depth: (split ny, split nx) m along T z; NaN = nothing seen.
        variance: The same shape, m²: of the depth, the part that is independent from
            point to point; 0 = unknown.
        p_TQs: (3, M) m, in T: all points that are not hidden. Beside an edge a sub-cell
            holds points of both surfaces.
        index: (M,) the sub-cell of each, row by row.
    """

    depth: FloatArray
    variance: FloatArray
    p_TQs: FloatArray
    index: IntArray


@dataclass(frozen=True, eq=False)
class StepDetection(FrozenValue):
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
    shape: tuple[int, int],
    cell: float,
    split: int,
    spacing: float,
) -> SubCells:
    """Finds the foremost surface of each sub-cell, which the gun meets first.

    Of several points above one sub-cell those with far fewer measurements than the
    others are outliers. Of the inliers the foremost, and those within a layer behind
    it, are averaged, weighted by their measurements. Points behind a surface that
    surrounds them on four sides are hidden, also where it has no point straight above.

    Args:
        p_TQs: (3, N) m, in T.
        counts: (N,) measurements in each point; None = all alike.
        variances: (N,) m², of one measurement of each point; None = unknown.
        shape: (ny, nx) cells of the tile.
        cell: Edge of a cell, m.
        split: Sub-cells along a cell's edge.
        spacing: Typical distance of points, m.
    """
    ny, nx = (split * count for count in shape)
    columns, rows = np.floor(p_TQs[:2] * (split / cell)).astype(np.int64)
    inside = (columns >= 0) & (columns < nx) & (rows >= 0) & (rows < ny)
    own = (rows * nx + columns)[inside]
    z = p_TQs[2, inside]
    n = np.ones(z.size) if counts is None else counts[inside].astype(float)
    best = np.zeros(nx * ny)
    np.maximum.at(best, own, n)
    real = n >= _OUTLIER_SHARE * best[own]
    own, z, n = own[real], z[real], n[real]
    front = np.full((ny, nx), -np.inf)
    np.maximum.at(front.ravel(), own, z)
    cover = _cover(front, math.ceil(spacing * split / cell))
    shown = z >= cover.ravel()[own] - _LAYER
    front = np.maximum(front, cover)
    visible = p_TQs[:, inside][:, real][:, shown]
    index = own[shown]
    top = z >= front.ravel()[own] - _LAYER
    own, z, n = own[top], z[top], n[top]
    total = np.bincount(own, n, nx * ny)
    depth = np.full(nx * ny, np.nan)
    seen = total > 0
    depth[seen] = np.bincount(own, n * z, nx * ny)[seen] / total[seen]
    variance = np.zeros(nx * ny)
    if variances is not None:
        one = variances[inside][real][top]
        variance[seen] = np.bincount(own, n * one, nx * ny)[seen] / total[seen] ** 2
    return SubCells(
        depth=depth.reshape(ny, nx),
        variance=variance.reshape(ny, nx),
        p_TQs=visible,
        index=index,
    )


def _cover(front: FloatArray, reach: int) -> FloatArray:
    """Returns the depth of the surface that surrounds a sub-cell on four sides.

    The square round it splits into four oblongs like the blades of a windmill. Beside a
    straight edge at least one of them holds no point of the nearer surface.
    """
    ny, nx = front.shape
    padded = np.pad(front, reach, constant_values=-np.inf)
    first, second = range(1, reach + 1), range(reach + 1)
    cover = np.full(front.shape, np.inf)
    for turn in range(4):
        blade = np.full(front.shape, -np.inf)
        for dy, dx in ((dy, dx) for dy in first for dx in second):
            for _ in range(turn):
                dy, dx = dx, -dy
            rows = slice(reach + dy, reach + dy + ny)
            columns = slice(reach + dx, reach + dx + nx)
            np.maximum(blade, padded[rows, columns], out=blade)
        np.minimum(cover, blade, out=cover)
    return cover


def find_steps(
    cells: SubCells, surface: WallSurface, *, cell: float, config: SegmentationConfig
) -> StepDetection:
    """Finds the sub-cells that are level with the wall.

    Low steps in strong noise show in the mean over a few sub-cells. Such a mean blurs
    edges, so the edge is where it crosses half the step.

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
    low = seen & (np.abs(residual) <= _HIGH * bound)
    share = uniform_filter(low.astype(float), _WINDOW, mode="constant")
    mean = uniform_filter(np.where(low, clipped, 0.0), _WINDOW, mode="constant")
    mean = np.where(seen & ~step, mean / np.maximum(share, 1e-9), np.nan)
    _, mean_bound = _bounds(mean, 0.0 * mean, surface.noise, cell, config)
    core = np.abs(mean) > mean_bound
    peak = maximum_filter(np.where(core, np.abs(mean), 0.0), 2 * _WINDOW - 1)
    step |= (peak > 0.0) & (np.abs(mean) > 0.5 * peak) & seen
    return StepDetection(
        residual=residual, sigma=sigma, bound=bound, level=seen & ~step
    )


def _bounds(
    residual: FloatArray,
    variance: FloatArray,
    noise: float,
    cell: float,
    config: SegmentationConfig,
) -> tuple[FloatArray, FloatArray]:
    """Returns the standard deviation of residuals and the least significant step.

    Whatever the scatter, as where a column fills a block, residuals above the inlier
    distance of the wall's plane are steps.
    """
    sigma = np.sqrt(_scatter(residual, noise, cell) ** 2 + variance)
    most = max(config.min_step, config.distance_threshold)
    return sigma, np.clip(config.step_significance * sigma, config.min_step, most)


def _scatter(residual: FloatArray, noise: float, cell: float) -> FloatArray:
    """Returns the scatter about zero, m, block by block, spread over the grid.

    From the median of the absolute residuals, which tolerates half of the cells as
    outliers; certain steps are left out first.
    """
    ny, nx = residual.shape
    size = max(1, round(_BLOCK / cell))
    off = np.abs(residual)
    off = np.where(off <= max(0.005, 8.0 * noise), off, np.nan)
    blocks = np.sort(blocks_of(off, size), axis=2)
    known = np.count_nonzero(np.isfinite(blocks), axis=2)
    whole = float(np.nanmedian(off)) if np.isfinite(off).any() else 0.0
    middle = np.maximum(known - 1, 0)[..., np.newaxis] // 2
    middle = np.take_along_axis(blocks, middle, axis=2)[..., 0]
    # A block with little wall takes the scatter of the whole tile.
    middle = 1.4826 * np.where(known >= _LEAST_SAMPLES, middle, whole)
    return np.repeat(np.repeat(middle, size, axis=0), size, axis=1)[:ny, :nx]
