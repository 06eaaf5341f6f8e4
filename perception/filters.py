"""Step 1 of the segmentation: the statistical outlier filter."""

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from perception.values import BoolArray, FloatArray

_MORTON_BITS = 21  # Three coordinates of 21 bits fit one 64-bit code.


def statistical_filter(
    p_WQs: FloatArray, *, neighbors: int, std_multiplier: float
) -> BoolArray:
    """Finds the points that are not outliers by the distance to their neighbours.

    A point's figure is its mean distance to its `neighbors` nearest neighbours, itself
    left out. It stays when the figure is at most mean + `std_multiplier` x standard
    deviation (N - 1) of all figures; a small figure is never an outlier. This is what
    the Point Cloud Library's StatisticalOutlierRemoval does. The answer for a point
    does not depend on the order of the points.

    Source: Tadic et al., "Painting Robot with RealSense D435", 2021, equation 1 and
    section 4.4 (1); Rusu et al., "Towards 3D point cloud based object maps", 2008.

    Args:
        p_WQs: (3, N) m, in any frame; non-finite points are outliers and count nowhere.
        neighbors: Neighbours of a point; all others where there are fewer.
        std_multiplier: Threshold in standard deviations.

    Returns:
        (N,) True = keep.
    """
    keep: BoolArray = np.all(np.isfinite(p_WQs), axis=0)
    index = np.flatnonzero(keep)
    if index.size < 3:
        return keep
    points = p_WQs[:, index].T
    # Neighbours in space become neighbours in memory: the tree's queries run from
    # cache, at half the time of a shuffled cloud.
    order = np.argsort(morton_codes(points.T), kind="stable")
    points = np.ascontiguousarray(points[order])
    tree = cKDTree(points, balanced_tree=False, compact_nodes=False, leafsize=32)
    count = min(neighbors, index.size - 1)
    distances, _ = tree.query(points, k=count + 1, workers=-1)
    # The nearest is the point itself, or a twin at the same distance of zero.
    figures = distances[:, 1:].mean(axis=1)
    limit = figures.mean() + std_multiplier * figures.std(ddof=1)
    # A lattice has one figure throughout, up to rounding, and no outliers.
    keep[index[order]] = figures <= limit * (1.0 + 1e-12)
    return keep


def morton_codes(p_WQs: FloatArray) -> npt.NDArray[np.uint64]:
    """Numbers points along a space-filling curve (Z-order).

    Source: Morton, "A computer oriented geodetic data base", 1966; bits interleaved by
    the usual magic numbers.

    Args:
        p_WQs: (3, N) finite, in any frame.

    Returns:
        (N,) codes; points near one another mostly have codes near one another.
    """
    low = p_WQs.min(axis=1, keepdims=True)
    extent = float(np.ptp(p_WQs, axis=1).max()) or 1.0
    steps = ((p_WQs - low) / extent * (2**_MORTON_BITS - 1)).astype(np.uint64)
    codes = np.zeros(p_WQs.shape[1], dtype=np.uint64)
    for axis in range(3):
        codes |= _spread(steps[axis]) << np.uint64(axis)
    return codes


def _spread(bits: npt.NDArray[np.uint64]) -> npt.NDArray[np.uint64]:
    """Moves bit i of a 21-bit number to bit 3 i."""
    for shift, mask in (
        (32, 0x001F00000000FFFF),
        (16, 0x001F0000FF0000FF),
        (8, 0x100F00F00F00F00F),
        (4, 0x10C30C30C30C30C3),
        (2, 0x1249249249249249),
    ):
        bits = (bits | (bits << np.uint64(shift))) & np.uint64(mask)
    return bits
