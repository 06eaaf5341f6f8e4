"""Patches of a depth grid within which the surface nowhere steps."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from perception.ground import BoolArray, FloatArray, IntArray

_LEAST_STEP = 0.004
"""Lower steps do not part a surface, m."""
_SIGNIFICANT = 8.0
"""Nor do steps of fewer standard deviations of a cell's depth."""


def smooth_patches(depth: FloatArray, *, noise: float) -> IntArray:
    """Splits a grid where its depth steps; slopes, waves and bulges stay in one patch.

    Between two neighbours the surface steps if their depths differ by more than the
    mean of the differences on either side predicts.

    Args:
        depth: (ny, nx) m; NaN = nothing there.
        noise: Standard deviation of a cell's depth, m.

    Returns:
        (ny, nx) number of each cell's patch, from 0; -1 = nothing there.
    """
    numbers = np.arange(depth.size).reshape(depth.shape)
    limit = max(_LEAST_STEP, _SIGNIFICANT * noise)
    pairs = []
    for cells, own in ((depth, numbers), (depth.T, numbers.T)):
        smooth = _smooth(cells, limit)
        pairs.append(np.stack([own[:, :-1][smooth], own[:, 1:][smooth]]))
    links = np.concatenate(pairs, axis=1)
    graph = coo_array(
        (np.ones(links.shape[1], np.int8), tuple(links)), (depth.size,) * 2
    )
    _, found = connected_components(graph, directed=False)
    known = np.isfinite(depth)
    patches = np.full(depth.shape, -1, dtype=np.int64)
    patches[known] = np.unique(found.reshape(depth.shape)[known], return_inverse=True)[
        1
    ]
    return patches


def _smooth(depth: FloatArray, limit: float) -> BoolArray:
    """Returns (ny, nx - 1): whether the surface runs on from a cell to the next."""
    step = np.diff(depth, axis=1)
    # At the border of seen cells the slope is known on one side at most.
    padded = np.pad(step, ((0, 0), (1, 1)), constant_values=np.nan)
    before, after = padded[:, :-2], padded[:, 2:]
    slope = np.where(np.isfinite(before), before, after)
    slope = np.where(
        np.isfinite(slope) & np.isfinite(after), 0.5 * (slope + after), slope
    )
    with np.errstate(invalid="ignore"):
        smooth: BoolArray = np.abs(step - np.nan_to_num(slope)) <= limit
    return smooth
