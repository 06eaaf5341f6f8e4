"""Segmentation of recorded clouds, for which no job says where the wall is."""

import math
from collections.abc import Sequence

import numpy as np
from pydrake.math import RigidTransform

from perception.config import SegmentationConfig
from perception.errors import NoWallError
from perception.planes import Plane
from perception.segmentation import (
    FoundPlanes,
    SegmentationSteps,
    find_planes,
    segment_tile,
)
from perception.values import FloatArray
from perception.wall import upright_rotation, wall_on_plane

# A plane is a wall if it leans less than this; stairs and ramps lean more.
_MAX_LEAN = math.radians(20.0)
# A true surface is denser within the inlier distance than beside it; a slab through
# foliage is not. Ours: the worst recorded wall reaches 1.8, plants 1.5
# (docs/real-data.md).
_MIN_CONTRAST = 1.7


def segment_recorded(
    p_WQs: FloatArray,
    *,
    width: float,
    height: float,
    config: SegmentationConfig,
    seed: int,
    up_W: FloatArray | None = None,
    distance: float | None = None,
) -> SegmentationSteps:
    """Finds the wall of a recorded cloud and segments a tile in the middle of it.

    The wall is the largest plane that may be one: upright if `up_W` is given, at
    `distance` from the sensor (W's origin) if that is given, and a surface rather than
    a slab through clutter. The tile is centred on the middle of its points.

    Args:
        p_WQs: (3, N) m, in the recording's frame W, whose origin is the sensor.
        width: Of the tile, m.
        height: Of the tile, m.
        config: Thresholds of the steps.
        seed: Of RANSAC's random triples.
        up_W: (3,) which way is up; if left out, the picture's -y is taken for T's
            orientation and floors are not told from walls.
        distance: Expected distance of the wall, m; `config.wall_distance_tolerance` is
            its tolerance.

    Returns:
        The segmentation with its intermediate results.

    Raises:
        NoWallError: There are too few points or no such plane; names the reasons.
    """
    found = find_planes(p_WQs, config=config, seed=seed)
    number = _choose(found, config=config, up_W=up_W, distance=distance)
    plane = found.planes[number]
    up_T = np.array([0.0, -1.0, 0.0]) if up_W is None else up_W
    X_WT = _centred_tile(
        plane,
        found.p_WQs[:, found.labels == number + 1],
        up_T,
        width=width,
        height=height,
    )
    wall = wall_on_plane(
        plane, X_WT, width=width, height=height, total=found.kept_count
    )
    return segment_tile(
        found, wall, number + 1, width=width, height=height, config=config
    )


def contrast(plane: Plane, p_WQs: FloatArray, *, threshold: float) -> float:
    """Compares the density of points at a plane with that beside it.

    Args:
        plane: In W.
        p_WQs: (3, N) m, in W.
        threshold: Inlier distance, m.

    Returns:
        Points within `threshold` of the plane, over the mean of the numbers in slabs of
        the same thickness on either side; infinite if these are empty.
    """
    away = np.abs(plane.distances(p_WQs))
    inside = np.count_nonzero(away <= threshold)
    beside = np.count_nonzero((away > threshold) & (away <= 3.0 * threshold)) / 2.0
    return inside / beside if beside else math.inf


def _choose(
    found: FoundPlanes,
    *,
    config: SegmentationConfig,
    up_W: FloatArray | None,
    distance: float | None,
) -> int:
    """Returns the index of the largest plane that may be a wall."""
    total = found.kept_count
    kept = found.p_WQs[:, found.kept]
    reasons = []
    order = sorted(range(len(found.planes)), key=lambda i: -found.planes[i].count)
    for number in order:
        plane = found.planes[number]
        reason = _objection(plane, kept, config=config, up_W=up_W, distance=distance)
        if reason is None:
            return number
        reasons.append(f"{plane.count / total:.0%} of points {reason}")
    raise NoWallError(f"no plane is a wall: {_listing(reasons) or 'there is none'}.")


def _objection(
    plane: Plane,
    p_WQs: FloatArray,
    *,
    config: SegmentationConfig,
    up_W: FloatArray | None,
    distance: float | None,
) -> str | None:
    """Says why a plane is no wall, or None."""
    if plane.count < config.min_wall_share * p_WQs.shape[1]:
        return f"is under {config.min_wall_share:.0%}"
    if up_W is not None:
        lean = math.asin(min(1.0, abs(float(plane.normal @ up_W))))
        if lean > _MAX_LEAN:
            limit = math.degrees(_MAX_LEAN)
            return f"leans {math.degrees(lean):.0f} deg, over {limit:.0f}"
    if distance is not None:
        limit = config.wall_distance_tolerance
        if abs(abs(plane.offset) - distance) > limit:
            return f"is {abs(plane.offset):.3f} m away, not {distance:g} +- {limit:g}"
    ratio = contrast(plane, p_WQs, threshold=config.distance_threshold)
    if ratio < _MIN_CONTRAST:
        return f"is {ratio:.1f} times as dense as beside it, under {_MIN_CONTRAST:g}"
    return None


def _listing(reasons: Sequence[str], most: int = 3) -> str:
    more = f"; and {len(reasons) - most} more" if len(reasons) > most else ""
    return "; ".join(reasons[:most]) + more


def _centred_tile(
    plane: Plane, p_WQs: FloatArray, up_W: FloatArray, *, width: float, height: float
) -> RigidTransform:
    """Lays a tile on the plane, centred on the middle of the plane's points."""
    normal = plane.normal * (-1.0 if plane.offset > 0.0 else 1.0)  # To the sensor.
    if abs(float(normal @ up_W)) > math.cos(math.radians(10.0)):
        up_W = np.roll(up_W, 1)  # Up is along the normal; any axis across it will do.
    R_WT = upright_rotation(normal, up_W)
    p_Qs = R_WT.inverse() @ p_WQs
    # The middle of the extents, without the stray points at either end.
    low, high = np.percentile(p_Qs, [1.0, 99.0], axis=1)
    centre = (low + high) / 2.0 - [width / 2.0, height / 2.0, 0.0]
    return RigidTransform(R_WT, R_WT @ centre)
