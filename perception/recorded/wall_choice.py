"""Which plane of a recorded cloud is the wall, and why the others are not."""

import math
from collections.abc import Sequence

import numpy as np

from perception.config import SegmentationConfig
from perception.errors import NoWallError
from perception.ground import FloatArray
from perception.paper_steps.pipeline import FoundPlanes
from perception.paper_steps.planes import Plane

# A plane is a wall if it leans less than this; stairs and ramps lean more.
_MAX_LEAN = math.radians(20.0)
# A true surface is denser within the inlier distance than beside it; a slab through
# foliage is not. Ours: the worst recorded wall reaches 1.8, plants 1.5
# (docs/real-data.md).
_MIN_CONTRAST = 1.7
# A face of a carton: at least two others, each with this share of the points, turn back
# from it by 60 deg or more and lie behind it, but for this share of their points.
_FACE_SHARE = 0.15
_FACE_SLOPE = 0.5
_FACE_BEFORE = 0.05
_FACES = 2


def choose_wall(
    found: FoundPlanes,
    *,
    config: SegmentationConfig,
    up_W: FloatArray | None,
    distance: float | None,
    p_WC: FloatArray | None,
) -> int:
    """Chooses the largest plane that may be a wall.

    Args:
        found: Filtered cloud and planes.
        config: Tolerances.
        up_W: (3,) which way is up, if known.
        distance: Expected distance from the sensor, m, if known.
        p_WC: (3,) where the sensor was; if left out, W's origin.

    Returns:
        The plane's index.

    Raises:
        NoWallError: There is none; names the reasons.
    """
    total = found.kept_count
    reasons = []
    order = sorted(range(len(found.planes)), key=lambda i: -found.planes[i].count)
    for number in order:
        reason = _objection(
            found, number, config=config, up_W=up_W, distance=distance, p_WC=p_WC
        )
        if reason is None:
            return number
        share = found.planes[number].count / total
        reasons.append(f"the plane with {share:.0%} of the points {reason}")
    raise NoWallError(
        f"no plane is a wall: {_listing(reasons) or 'there is none'}.",
        code="PNT-WALL-010",
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


def _objection(
    found: FoundPlanes,
    number: int,
    *,
    config: SegmentationConfig,
    up_W: FloatArray | None,
    distance: float | None,
    p_WC: FloatArray | None,
) -> str | None:
    """Returns why a plane is not a wall, or None if it may be one."""
    plane = found.planes[number]
    p_WQs = found.p_WQs[:, found.kept]
    if plane.count < config.min_wall_share * p_WQs.shape[1]:
        return f"is too small, a wall has at least {config.min_wall_share:.0%}"
    if up_W is not None:
        slope = float(plane.normal @ up_W) / float(np.linalg.norm(up_W))
        lean = math.asin(min(1.0, abs(slope)))
        if lean > _MAX_LEAN:
            limit = math.degrees(_MAX_LEAN)
            return f"leans {math.degrees(lean):.0f} deg, a wall at most {limit:.0f}"
    p_WC = np.zeros(3) if p_WC is None else p_WC
    if distance is not None:
        limit = config.wall_distance_tolerance
        off = abs(float(plane.normal @ p_WC) - plane.offset)
        if abs(off - distance) > limit:
            return f"is {off:.3f} m away, not {distance:g} +- {limit:g}"
    ratio = contrast(plane, p_WQs, threshold=config.distance_threshold)
    if ratio < _MIN_CONTRAST:
        least = f"a wall at least {_MIN_CONTRAST:g}"
        return f"is {ratio:.1f} times as dense as beside it, {least}"
    faces = _turned_back(found, number, p_WC)
    if len(faces) >= _FACES:
        shares = " and ".join(f"{share:.0%}" for share in faces[:_FACES])
        return f"is a face of an object: planes of {shares} turn back from its edges"
    return None


def _turned_back(found: FoundPlanes, number: int, p_WC: FloatArray) -> list[float]:
    """Returns the shares of planes that turn back from a plane as a carton's do."""
    plane = found.planes[number]
    front = 1.0 if float(plane.normal @ p_WC) > plane.offset else -1.0
    shares = []
    for other, candidate in enumerate(found.planes):
        share = candidate.count / found.kept_count
        slope = abs(float(candidate.normal @ plane.normal))
        if other == number or share < _FACE_SHARE or slope > _FACE_SLOPE:
            continue
        before = front * plane.distances(found.p_WQs[:, found.labels == other + 1])
        if np.mean(before > 2.0 * max(plane.rms, candidate.rms)) <= _FACE_BEFORE:
            shares.append(share)
    return shares


def _listing(reasons: Sequence[str], most: int = 3) -> str:
    more = f"; and {len(reasons) - most} more" if len(reasons) > most else ""
    return "; ".join(reasons[:most]) + more
