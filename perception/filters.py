"""Step 1 of the segmentation: the statistical outlier filter."""

import numpy as np
import numpy.typing as npt
import open3d as o3d
from scipy.spatial import cKDTree

from perception.values import BoolArray, FloatArray

_MORTON_BITS = 21  # Three coordinates of 21 bits fit one 64-bit code.
# Open3D's filter gives out neither figures nor threshold; it serves clouds so large
# that not all figures can be the same, for so many neighbours.
_LARGE_CLOUD = 20_000
_MANY_NEIGHBORS = 8
# The fast filter: share of points first looked at, and points that stand for the rest.
_SPARSE_SHARE = 0.02
_SAMPLE = 16_000


def statistical_filter(
    p_WQs: FloatArray, *, neighbors: int, std_multiplier: float, fast: bool = False
) -> BoolArray:
    """Finds the points that are not outliers by the distance to their neighbours.

    A point's figure is its mean distance to its `neighbors` (k) nearest neighbours,
    itself left out. It stays when the figure is at most mean + `std_multiplier`
    (alpha) x standard deviation (N - 1) of all figures. The paper's equation 1 has a
    lower bound too, mean - alpha x deviation; its text removes what lies above, and a
    point in a dense place is no outlier, so the lower bound is left out. This is what
    the Point Cloud Library's StatisticalOutlierRemoval does. The answer for a point
    does not depend on the order of the points.

    Source: Tadic et al., "Painting Robot with RealSense D435", 2021, equation 1 and
    section 4.4 (1); Rusu et al., "Towards 3D point cloud based object maps", 2008.

    Args:
        p_WQs: (3, N) m, in any frame; non-finite points are outliers and count nowhere.
        neighbors: Neighbours of a point; all others where there are fewer.
        std_multiplier: Threshold in standard deviations.
        fast: Points in dense places are proved inside without their figures, and of
            these a sample stands for all in mean and deviation: the threshold is off by
            a few 0.01 %, and points that close to it may fall to the other side.

    Returns:
        (N,) True = keep.
    """
    keep: BoolArray = np.all(np.isfinite(p_WQs), axis=0)
    index = np.flatnonzero(keep)
    if index.size < 3:
        return keep
    points = p_WQs if index.size == keep.size else p_WQs[:, index]
    # Neighbours in space become neighbours in memory: the tree's queries run from
    # cache, at half the time of a shuffled cloud.
    codes = morton_codes(points)
    order = np.argsort(codes, kind="stable")
    codes = codes[order]
    points = np.stack([axis[order] for axis in points], axis=1)
    count = min(neighbors, index.size - 1)
    large = index.size >= _LARGE_CLOUD and count >= _MANY_NEIGHBORS
    if large and fast:
        inside = _fast_filter(points, count, std_multiplier)
    else:
        twins = bool(np.any(codes[count:] == codes[:-count]))
        inside = None
        if large and not twins:
            inside = _open3d_filter(points, count, std_multiplier)
        if inside is None:
            inside = _exact_filter(points, count, std_multiplier)
    keep[index[order]] = inside
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
    low = p_WQs.min(axis=1)
    extent = float((p_WQs.max(axis=1) - low).max()) or 1.0
    scale = (2**_MORTON_BITS - 1) / extent
    codes = np.zeros(p_WQs.shape[1], dtype=np.uint64)
    for axis in range(3):
        steps = ((p_WQs[axis] - low[axis]) * scale).astype(np.uint64)
        codes |= _spread(steps) << np.uint64(axis)
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


def _tree(points: FloatArray) -> cKDTree:
    return cKDTree(points, balanced_tree=False, compact_nodes=False, leafsize=32)


def _figures(tree: cKDTree, points: FloatArray, count: int) -> FloatArray:
    """Returns the mean distances of some of the tree's points to their neighbours."""
    distances, _ = tree.query(points, k=count + 1, workers=-1)
    # The nearest is the point itself, or a twin at the same distance of zero.
    figures: FloatArray = distances[:, 1:].mean(axis=1)
    return figures


def _exact_filter(points: FloatArray, count: int, alpha: float) -> BoolArray:
    """Does the filter by its definition on (N, 3) points."""
    figures = _figures(_tree(points), points, count)
    limit = figures.mean() + alpha * figures.std(ddof=1)
    # A lattice has one figure throughout, up to rounding, and no outliers.
    inside: BoolArray = figures <= limit * (1.0 + 1e-12)
    return inside


def _open3d_filter(points: FloatArray, count: int, alpha: float) -> BoolArray | None:
    """Does the same with Open3D's filter, in half the time, or not at all.

    Open3D counts the point itself as a neighbour at distance 0: with one neighbour more
    all its figures, and so its threshold, are ours times k / (k + 1). It treats figures
    of 0 otherwise (k twins of a point), and where all figures are the same its answer
    hangs on rounding. By Cantelli's inequality no more than 1 / (1 + alpha²) of the
    points lie alpha deviations above a mean: more tell such a cloud.

    Returns:
        (N,) True = keep; None if the cloud is of that kind.
    """
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    _, kept = cloud.remove_statistical_outlier(count + 1, alpha)
    if points.shape[0] - len(kept) > points.shape[0] / (1.0 + alpha**2):
        return None
    inside = np.zeros(points.shape[0], dtype=np.bool_)
    inside[np.asarray(kept, dtype=np.int64)] = True
    return inside


def _fast_filter(points: FloatArray, count: int, alpha: float) -> BoolArray:
    """Filters (N, 3) points in Morton order by bounds on their figures.

    A figure is at most the mean distance to any `count` other points, which follows
    for runs of points from their centres (`_bounds`). Points whose bound is below a
    guess of the threshold are dense: every so many-th of them is queried and stands for
    all. All others are queried. If the threshold comes out below the guess, the guess
    is lowered; once it does not, every dense point is proved inside.
    """
    tree = _tree(points)
    bounds = _bounds(points, count)
    figures = np.full(bounds.size, np.nan)

    def query(index: npt.NDArray[np.int64]) -> None:
        index = index[np.isnan(figures[index])]
        figures[index] = _figures(tree, points[index], count)

    query(np.arange(0, bounds.size, max(1, bounds.size // _SAMPLE)))
    guess = float(np.quantile(bounds, 1.0 - _SPARSE_SHARE))
    while True:
        sparse = bounds > guess
        query(np.flatnonzero(sparse))
        limit = _limit(figures, sparse, alpha)
        if limit >= guess or sparse.all():
            break
        guess = min(limit, 0.98 * guess)
    # A comparison with NaN, of points that were not queried, is False.
    inside: BoolArray = ~(figures > limit * (1.0 + 1e-12))
    return inside


def _bounds(points: FloatArray, count: int) -> FloatArray:
    """Bounds the figures of (N, 3) points in Morton order from above.

    For a run of n > `count` points with centre c, |p_i - p_j| <= |p_i - c| + |p_j - c|,
    and the mean over the nearest is no more than that over any of the others. The
    runs are taken twice, the second time half a run on, as the curve jumps.
    """
    size = count + 1
    bounds = np.full(points.shape[0], np.inf)
    for start in (0, size // 2):
        stop = start + (points.shape[0] - start) // size * size
        runs = points[start:stop].reshape(-1, size, 3)
        offs = runs - runs.mean(axis=1, keepdims=True)
        radii = np.sqrt(np.einsum("ijk,ijk->ij", offs, offs))
        # The sum over the others: (n - 2) own radii and all radii.
        sums = (size - 2) * radii + radii.sum(axis=1, keepdims=True)
        own = bounds[start:stop]
        np.minimum(own, (sums / count).ravel(), out=own)
    return bounds


def _limit(figures: FloatArray, sparse: BoolArray, alpha: float) -> float:
    """Estimates mean + alpha x deviation of all figures from those that are known.

    The sparse are known in full; of the others those of the sample stand for all.
    """
    known = figures[sparse]
    sample = figures[~sparse]
    sample = sample[~np.isnan(sample)]
    total = figures.size
    weight = (total - known.size) / max(1, sample.size)
    mean = (known.sum() + weight * sample.sum()) / total
    spread = ((known - mean) ** 2).sum() + weight * ((sample - mean) ** 2).sum()
    return float(mean + alpha * np.sqrt(spread / (total - 1)))
