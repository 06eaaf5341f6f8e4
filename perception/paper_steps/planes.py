"""Step 2 of the segmentation: planes by iterative RANSAC, the largest first."""

import math
from dataclasses import dataclass

import numpy as np

from perception.config import SegmentationConfig
from perception.ground import BoolArray, FloatArray, FrozenValue, IntArray

# Points on which candidate planes are scored; the share of inliers is then known to
# about 1 %, enough to rank candidates before the refit on all inliers.
_SCORE_POINTS = 4000
# Of each batch, only the best on fewer points are scored on so many.
_FIRST_POINTS = 500
_FINALISTS = 16
_BATCH = 256
_MAX_CANDIDATES = 1024
_CONFIDENCE = 0.99
_MAX_REFITS = 5


@dataclass(frozen=True, eq=False)
class Plane(FrozenValue):
    """Plane n . p = d through some points.

    Attributes:
        normal: (3,) unit normal n, in the points' frame; its sign means nothing.
        offset: d, m.
        rms: Root mean square distance of the points from it, m.
        count: Points that it was fitted to.
    """

    normal: FloatArray
    offset: float
    rms: float
    count: int

    def distances(self, p_WQs: FloatArray) -> FloatArray:
        """Returns (N,) signed distances of (3, N) points, m, positive along n."""
        return self.normal @ p_WQs - self.offset


def fit_plane(p_WQs: FloatArray) -> Plane:
    """Fits a plane by total least squares.

    Args:
        p_WQs: (3, N) m, N >= 3, in any frame.

    Returns:
        The plane with the least sum of squared distances. On a line of points it is
        one of the many planes through that line.

    Raises:
        ValueError: There are fewer than three points.
    """
    count = p_WQs.shape[1]
    if count < 3:
        raise ValueError(f"a plane needs at least 3 points, got {count}.")
    centre = p_WQs.mean(axis=1)
    offsets = p_WQs - centre[:, None]
    variances, axes = np.linalg.eigh(offsets @ offsets.T / count)
    normal = axes[:, 0]
    rms = math.sqrt(max(0.0, float(variances[0])))
    return Plane(normal=normal, offset=float(normal @ centre), rms=rms, count=count)


def ransac_plane(
    p_WQs: FloatArray, *, threshold: float, rng: np.random.Generator
) -> tuple[Plane, BoolArray] | None:
    """Finds the plane that most points are close to.

    Planes through random triples are ranked by their inliers among a random sample of
    the points, until one of inliers alone has come with 99 % probability: p = 0.99 in
    equation 3, with v, the share of outliers, from the best plane so far, and m = 3.
    The best is refitted to its inliers in that sample, these are selected anew until
    they stay the same, and the last fit is to all inliers of the cloud.

    Source: Fischler and Bolles, "Random sample consensus", 1981; Tadic et al., 2021,
    equations 2 and 3.

    Args:
        p_WQs: (3, N) finite, m, in any frame.
        threshold: Largest distance of an inlier, m.
        rng: Source of the triples.

    Returns:
        The plane and its inliers (N,), the points within `threshold` of it; or None if
        all points lie on one line.
    """
    count = p_WQs.shape[1]
    if count < 3:
        return None
    # In random order, so that the first of them are a sample too.
    if count > _SCORE_POINTS:
        sample = p_WQs[:, rng.integers(count, size=_SCORE_POINTS)]
    else:
        sample = p_WQs[:, rng.permutation(count)]
    best_score, best = 0, None
    tried, needed = 0, float(_MAX_CANDIDATES)
    while tried < needed:
        normals, offsets = _random_planes(p_WQs, rng)
        tried += _BATCH
        if offsets.size == 0:
            continue
        first = _scores(normals, offsets, sample[:, :_FIRST_POINTS], threshold)
        final = np.argsort(-first, kind="stable")[:_FINALISTS]
        normals, offsets = normals[final], offsets[final]
        scores = _scores(normals, offsets, sample, threshold)
        top = int(scores.argmax())
        if scores[top] > best_score:
            best_score, best = int(scores[top]), (normals[top], offsets[top])
            needed = _candidates_needed(best_score / sample.shape[1])
    if best is None:
        return None
    inliers = np.abs(best[0] @ sample - best[1]) <= threshold
    plane = _refit(sample, inliers, threshold)
    inliers = np.abs(plane.distances(p_WQs)) <= threshold
    if np.count_nonzero(inliers) >= 3:
        plane = fit_plane(p_WQs.compress(inliers, axis=1))
    return plane, np.abs(plane.distances(p_WQs)) <= threshold


def segment_planes(
    p_WQs: FloatArray, *, config: SegmentationConfig, rng: np.random.Generator
) -> tuple[IntArray, tuple[Plane, ...]]:
    """Removes plane after plane from a cloud.

    Source: Tadic et al., 2021, section 4.4 (2).

    Args:
        p_WQs: (3, N) finite, m, in any frame.
        config: `distance_threshold`, `stop_fraction` and `max_planes` are used.
        rng: Source of the triples.

    Returns:
        Labels (N,), i for a point of the i-th plane (from 1, in the order found) and 0
        for a point of none; and the planes.
    """
    labels = np.zeros(p_WQs.shape[1], dtype=np.int64)
    # Axis by axis, whatever the caller's order; `compress` keeps it so.
    rest, points = np.arange(labels.size), np.ascontiguousarray(p_WQs)
    planes: list[Plane] = []
    least = config.stop_fraction * labels.size
    while len(planes) < config.max_planes and rest.size >= least:
        found = ransac_plane(points, threshold=config.distance_threshold, rng=rng)
        if found is None:
            break
        plane, inliers = found
        planes.append(plane)
        labels[rest[inliers]] = len(planes)
        rest, points = rest[~inliers], points.compress(~inliers, axis=1)
    return labels, tuple(planes)


def _random_planes(
    points: FloatArray, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Returns normals (M, 3) and offsets (M,) through random triples, M <= _BATCH."""
    a, b, c = points[:, rng.integers(points.shape[1], size=(3, _BATCH))].swapaxes(0, 1)
    normals = np.cross(b - a, c - a, axis=0)
    lengths = np.linalg.norm(normals, axis=0)
    # Twice the triangle's area against its sides reveals three points on a line.
    sides = np.linalg.norm(b - a, axis=0) * np.linalg.norm(c - a, axis=0)
    sound = lengths > 1e-6 * sides
    normals = normals[:, sound] / lengths[sound]
    return normals.T, np.einsum("ij,ij->j", normals, a[:, sound])


def _candidates_needed(share: float) -> float:
    """Equation 3: triples to draw so that one is of inliers alone at 99 %."""
    hit = share**3
    if hit >= 1.0:
        return 0.0
    return min(_MAX_CANDIDATES, math.log(1.0 - _CONFIDENCE) / math.log1p(-hit))


def _scores(
    normals: FloatArray, offsets: FloatArray, points: FloatArray, threshold: float
) -> IntArray:
    """Counts the inliers (M,) of planes, normals (M, 3), among (3, N) points."""
    close = np.abs(normals @ points - offsets[:, None]) <= threshold
    scores: IntArray = np.count_nonzero(close, axis=1)
    return scores


def _refit(points: FloatArray, inliers: BoolArray, threshold: float) -> Plane:
    """Fits to the inliers and selects them anew until they stay the same."""
    for _ in range(_MAX_REFITS):
        plane = fit_plane(points.compress(inliers, axis=1))
        again = np.abs(plane.distances(points)) <= threshold
        if np.array_equal(again, inliers) or np.count_nonzero(again) < 3:
            break
        inliers = again
    return plane
