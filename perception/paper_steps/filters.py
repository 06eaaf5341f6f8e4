"""Step 1 of the segmentation: the statistical outlier filter."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import numpy.typing as npt
import open3d as o3d
from scipy.spatial import cKDTree

from perception.ground import BoolArray, FloatArray, IntArray

_MORTON_BITS = 21  # Three coordinates of 21 bits fit one 64-bit code.
# Open3D's filter returns neither figures nor threshold; it is used for clouds so large,
# and so many neighbours, that not all figures can be the same.
_LARGE_CLOUD = 20_000
_MANY_NEIGHBORS = 8
# The fast filter: share of points above its first guess of the threshold; least number
# and share of points in the sample of dense ones; number of them that are drawn evenly.
_SPARSE_SHARE = 0.005
_SAMPLE = 16_000
_SAMPLE_SHARE = 0.025
_EVEN_SAMPLE = 8_000
_GOLDEN = (5.0**0.5 - 1.0) / 2.0


def statistical_filter(
    p_WQs: FloatArray, *, neighbors: int, std_multiplier: float, fast: bool = False
) -> BoolArray:
    """Finds the points that are not outliers by the distance to their neighbours.

    A point's figure is its mean distance to its `neighbors` (k) nearest neighbours,
    itself left out. It stays when the figure is at most mean + `std_multiplier`
    (alpha) x standard deviation (N - 1) of all figures. The paper's equation 1 has a
    lower bound too, mean - alpha x deviation; its text removes what lies above, and a
    point in a dense place is not an outlier, so there is no lower bound here. This is
    what the Point Cloud Library's StatisticalOutlierRemoval does. The answer for a
    point does not depend on the order of the points.

    Source: Tadic et al., "Painting Robot with RealSense D435", 2021, equation 1 and
    section 4.4 (1); Rusu et al., "Towards 3D point cloud based object maps", 2008.

    Args:
        p_WQs: (3, N) m, in any frame; non-finite points are outliers and do not count.
        neighbors: Neighbours of a point; all others where there are fewer.
        std_multiplier: Threshold in standard deviations.
        fast: Accept points in dense places by a bound on their figures, and take mean
            and deviation of these from a sample: the threshold is off by about 0.005 %,
            and points that close to it may change sides.

    Returns:
        (N,) True = keep.
    """
    p_WQs = np.ascontiguousarray(p_WQs)  # Axis by axis, whatever the caller's order.
    keep: BoolArray = np.all(np.isfinite(p_WQs), axis=0)
    index = np.flatnonzero(keep)
    if index.size < 3:
        return keep
    points = p_WQs if index.size == keep.size else p_WQs.take(index, axis=1)
    # Neighbours in space become neighbours in memory: the tree's queries run from
    # cache, at half the time of a shuffled cloud.
    codes = morton_codes(points)
    order = _sorting(codes)
    points = points.take(order, axis=1)
    count = min(neighbors, index.size - 1)
    large = index.size >= _LARGE_CLOUD and count >= _MANY_NEIGHBORS
    if large and fast:
        inside = _fast_filter(points, count, std_multiplier)
    else:
        codes = codes.take(order)
        duplicates = bool(np.any(codes[count:] == codes[:-count]))
        inside = None
        if large and not duplicates:
            inside = _open3d_filter(points, count, std_multiplier)
        if inside is None:
            inside = _exact_filter(points, count, std_multiplier)
    keep[index.take(order)] = inside
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


def _sorting(codes: npt.NDArray[np.uint64]) -> IntArray:
    """Returns the order (N,) that sorts codes, equal ones as they come.

    NumPy sorts 16-bit numbers by counting; so the four digits are sorted one after
    another, the last first, in a third of the time of `argsort`.
    """
    order = np.arange(codes.size)
    for shift in (0, 16, 32, 48):
        digits = (codes >> np.uint64(shift)).astype(np.uint16).take(order)
        order = order.take(np.argsort(digits, kind="stable"))
    return order


def _tree(points: FloatArray) -> cKDTree:
    return cKDTree(points.T, balanced_tree=False, compact_nodes=False, leafsize=32)


def _figures(tree: cKDTree, points: FloatArray, count: int) -> FloatArray:
    """Returns the mean distances of some of the tree's points to their neighbours."""
    distances, _ = tree.query(points.T, k=count + 1, workers=-1)
    # The nearest is the point itself, or a duplicate at the same distance of zero.
    figures: FloatArray = distances[:, 1:].mean(axis=1)
    return figures


def _exact_filter(points: FloatArray, count: int, alpha: float) -> BoolArray:
    """Does the filter by its definition on (3, N) points."""
    figures = _figures(_tree(points), points, count)
    limit = figures.mean() + alpha * figures.std(ddof=1)
    # A lattice has one figure throughout, up to rounding, and no outliers.
    inside: BoolArray = figures <= limit * (1.0 + 1e-12)
    return inside


def _open3d_filter(points: FloatArray, count: int, alpha: float) -> BoolArray | None:
    """Does the same with Open3D's filter, in half the time, or not at all.

    Open3D counts the point itself as a neighbour at distance 0: with one neighbour more
    all its figures, and so its threshold, are ours times k / (k + 1). It treats figures
    of 0 otherwise (k duplicates of a point), and where all figures are the same its
    answer depends on rounding. By Cantelli's inequality no more than 1 / (1 + alpha²)
    of the points lie alpha deviations above a mean: more reveal such a cloud.

    Returns:
        (N,) True = keep; None if the cloud is of that kind.
    """
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points.T))
    _, kept = cloud.remove_statistical_outlier(count + 1, alpha)
    if points.shape[1] - len(kept) > points.shape[1] / (1.0 + alpha**2):
        return None
    inside = np.zeros(points.shape[1], dtype=np.bool_)
    inside[np.asarray(kept, dtype=np.int64)] = True
    return inside


def _fast_filter(points: FloatArray, count: int, alpha: float) -> BoolArray:
    """Filters (3, N) points in Morton order by bounds on their figures.

    A figure is at most the mean distance to any `count` other points, which follows
    for runs of points from their centres (`_bounds`). Points whose bound is below a
    guess of the threshold are dense: a sample of them is queried and represents all.
    All others are queried. If the threshold comes out below the guess, the guess is
    lowered; once it does not, every dense point is proved inside.
    """
    with ThreadPoolExecutor(1) as thread:  # Neither holds the interpreter's lock.
        future = thread.submit(_tree, points)
        bounds = _bounds(points, count)
        tree = future.result()
    figures = np.full(bounds.size, np.nan)
    # The golden ratio's multiples draw any share of the points evenly along the curve.
    turns = np.arange(bounds.size) * _GOLDEN
    turns -= np.floor(turns)
    guess = float(np.quantile(bounds, 1.0 - _SPARSE_SHARE))
    while guess > 0.0:
        shares = _shares(bounds, guess)
        drawn = np.flatnonzero(turns < shares)
        new = drawn[np.isnan(figures[drawn])]
        figures[new] = _figures(tree, points.take(new, axis=1), count)
        limit = _limit(figures[drawn], shares[drawn], bounds.size, alpha)
        if limit >= guess:
            break
        guess = 0.99 * limit
    else:
        return _exact_filter(
            points, count, alpha
        )  # Nearly all points have k duplicates.
    # A comparison with NaN, of points that were not queried, is False.
    inside: BoolArray = ~(figures > limit * (1.0 + 1e-12))
    return inside


def _bounds(points: FloatArray, count: int) -> FloatArray:
    """Bounds the figures of (3, N) points in Morton order from above.

    A mean of distances is at most the root of their mean square, and the mean over the
    nearest is at most that over any others. For the n > `count` points of a run with
    centre c, sum_j |p_i - p_j|² = n |p_i - c|² + sum_j |p_j - c|². The runs are taken
    four times, each time a quarter of a run on, as the curve jumps; and for the end.
    """
    size = count + 1
    squares = np.full(points.shape[1], np.inf)
    for start in (*range(0, size, -(-size // 4)), squares.size - size):
        stop = start + (squares.size - start) // size * size
        radii = np.zeros(((stop - start) // size, size))
        for axis in points:
            runs = axis[start:stop].reshape(-1, size)
            radii += np.square(runs - runs.mean(axis=1, keepdims=True))
        sums = size * radii + radii.sum(axis=1, keepdims=True)
        own = squares[start:stop]
        np.minimum(own, sums.ravel(), out=own)
    return np.sqrt(squares / count)


def _shares(bounds: FloatArray, guess: float) -> FloatArray:
    """Returns the share of points like each that is queried: 1 at the guess and above.

    Below, figures vary about as the cube of their bounds, and the best sample takes
    from each kind of points in proportion to that.

    Source: Neyman, "On the two different aspects of the representative method", 1934.
    """
    ratios = np.minimum(bounds / guess, 1.0)
    shares = ratios * ratios * ratios
    dense = ratios < 1.0
    sample = _SAMPLE + _SAMPLE_SHARE * bounds.size
    scale = max(1.0, sample / max(1e-9, shares[dense].sum()))
    least = _EVEN_SAMPLE / bounds.size
    shares[dense] = np.clip(scale * shares[dense], least, 1.0)
    return shares


def _limit(figures: FloatArray, shares: FloatArray, total: int, alpha: float) -> float:
    """Estimates mean + alpha x deviation of `total` figures from those drawn.

    Each is weighted by the inverse of its share.
    """
    weights = 1.0 / shares
    sampled = shares < 1.0
    if sampled.any():
        rest = total - np.count_nonzero(~sampled)
        weights[sampled] *= rest / weights[sampled].sum()
    mean = (weights * figures).sum() / total
    spread = (weights * np.square(figures - mean)).sum()
    return float(mean + alpha * np.sqrt(spread / (total - 1)))
