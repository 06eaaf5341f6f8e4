"""Which plane is the wall, and the tile laid on it."""

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from perception.config import SegmentationConfig
from perception.errors import AmbiguousWallError, NoWallError, ObliqueWallError
from perception.ground import BoolArray, FloatArray
from perception.paper_steps.planes import Plane, segment_planes
from perception.settings import validate
from perception.values import TileSize, Wall

MIN_POINTS = 100  # Fewer are a stray return, not a surface.
_STEEPEST = math.radians(80.0)  # Beyond, the centre line runs along the plane.
_LEVEL = math.cos(math.radians(30.0))  # Planes closer to level are floors.
_EQUAL = 0.8  # A plane worth this share of the best is as good.
# Inlier distance of the first look, m. Two pictures show little of the wall: within the
# paper's 3 cm a plane aslant through wall, door and boxes has more inliers than it.
_FIRST_LOOK_THRESHOLD = 0.01


def find_wall(
    p_WQs: FloatArray,
    X_WT_expected: RigidTransform,
    tile: TileSize,
    *,
    config: SegmentationConfig,
    seed: int,
    up_W: FloatArray | None = None,
) -> Wall:
    """Finds the wall near where it is expected and lays the tile on it.

    The wall is the best plane within the configured distance and angle of the expected
    one (see `choose_plane`).

    Args:
        p_WQs: (3, N) m, in W; non-finite points are dropped.
        X_WT_expected: Tile frame where the job expects it.
        tile: Its size.
        config: Thresholds.
        seed: Of RANSAC's random triples.
        up_W: (3,) unit, against gravity; see `choose_plane`.

    Returns:
        The wall; its T is as `wall_on_plane` lays it.

    Raises:
        NoWallError: There are too few points, or no plane is near the expected one.
    """
    validate(config, "segmentation")
    p_WQs = p_WQs[:, finite_points(p_WQs)]
    threshold = min(config.distance_threshold, _FIRST_LOOK_THRESHOLD)
    fine = dataclasses.replace(config, distance_threshold=threshold)
    rng = np.random.default_rng(seed)
    _, planes = segment_planes(p_WQs, config=fine, rng=rng)
    total = p_WQs.shape[1]
    number = choose_plane(
        planes, X_WT_expected, tile, total=total, config=config, up_W=up_W
    )
    return wall_on_plane(planes[number], X_WT_expected, tile, total=total)


def finite_points(p_WQs: FloatArray) -> BoolArray:
    """Finds the finite points of a cloud.

    Args:
        p_WQs: (3, N) m, in any frame.

    Returns:
        (N,) True = finite.

    Raises:
        NoWallError: There are fewer than `MIN_POINTS`; names the numbers.
    """
    finite: BoolArray = np.all(np.isfinite(p_WQs), axis=0)
    count = int(np.count_nonzero(finite))
    if count < MIN_POINTS:
        raise NoWallError(
            f"the cloud has {count} finite points of {finite.size}; "
            f"a wall needs at least {MIN_POINTS}.",
            code="PNT-WALL-004",
        )
    return finite


def deviation(
    plane: Plane, X_WT_expected: RigidTransform, tile: TileSize
) -> tuple[float, float]:
    """Compares a plane with the expected wall.

    Args:
        plane: In W.
        X_WT_expected: Tile frame where the job expects it.
        tile: Its size.

    Returns:
        How far the plane lies from the expected tile's centre along T z, m, positive
        towards the robot (infinite for a plane nearly along T z); and the angle of the
        normals, rad, 0 to pi/2.
    """
    p_WC = X_WT_expected @ tile.p_TC
    slope = float(plane.normal @ X_WT_expected.rotation().matrix()[:, 2])
    angle = math.acos(min(1.0, abs(slope)))
    if angle > _STEEPEST:
        return math.inf, angle
    return (plane.offset - float(plane.normal @ p_WC)) / slope, angle


def choose_plane(
    planes: Sequence[Plane],
    X_WT_expected: RigidTransform,
    tile: TileSize,
    *,
    total: int,
    config: SegmentationConfig,
    up_W: FloatArray | None = None,
) -> int:
    """Chooses the plane that is the wall.

    A door may fill most of a picture; so the points of a plane count less the farther
    it lies from where the wall is expected: half the distance tolerance is taken as one
    standard deviation.

    Args:
        planes: In W.
        X_WT_expected: Tile frame where the job expects it.
        tile: Its size.
        total: Points of the cloud.
        config: Tolerances.
        up_W: (3,) unit, against gravity; planes nearly level are floor or ceiling and
            no wall. None = level planes count, too.

    Returns:
        Index of the best plane within the tolerances.

    Raises:
        AmbiguousWallError: Two planes apart from each other are about equally good.
        ObliqueWallError: The largest plane is in its place but turned too far.
        NoWallError: There is none; names the closest misses.
    """
    limit = config.wall_distance_tolerance
    limit_angle = math.radians(config.wall_angle_tolerance_deg)
    least = config.min_wall_share * total
    offs = [deviation(plane, X_WT_expected, tile) for plane in planes]
    upright = [
        number
        for number, plane in enumerate(planes)
        if up_W is None or abs(float(plane.normal @ up_W)) < _LEVEL
    ]

    def worth(number: int) -> float:
        return planes[number].count * math.exp(-2.0 * (offs[number][0] / limit) ** 2)

    good = [
        number
        for number in upright
        if abs(offs[number][0]) <= limit
        and offs[number][1] <= limit_angle
        and planes[number].count >= least
    ]
    good.sort(key=worth, reverse=True)
    for other in good[1:]:
        apart = abs(offs[good[0]][0] - offs[other][0])
        # Closer planes are slices of one uneven wall.
        is_slice = apart <= 2.0 * config.distance_threshold
        if not is_slice and worth(other) / worth(good[0]) >= _EQUAL:
            shares = [planes[number].count / total for number in (good[0], other)]
            raise AmbiguousWallError(
                f"two planes {apart:.3f} m apart are about equally good walls, "
                f"{shares[0]:.0%} and {shares[1]:.0%} of the points; give the wall's "
                "distance more exactly.",
                code="PNT-WALL-005",
            )
    if good:
        return good[0]
    if not planes:
        raise NoWallError(
            f"there is no plane among {total} points.", code="PNT-WALL-006"
        )
    if not upright:
        raise NoWallError(
            f"all {len(planes)} planes are level, as floors are; none is a wall.",
            code="PNT-WALL-007",
        )
    number = max(upright, key=lambda number: planes[number].count)
    largest, (distance, angle) = planes[number], offs[number]
    place = "runs past the tile"
    if math.isfinite(distance):
        side = "in front of" if distance > 0 else "behind"
        place = f"lies {abs(distance):.3f} m {side} the expected wall"
    oblique = abs(distance) <= limit and largest.count >= least
    raise (ObliqueWallError if oblique else NoWallError)(
        f"no plane with {config.min_wall_share:.0%} or more of the points is within "
        f"{limit:g} m and {config.wall_angle_tolerance_deg:g} deg of the expected "
        f"wall; the largest of {len(upright)} has {largest.count / total:.0%} "
        f"of the points, {place} and is turned {math.degrees(angle):.1f} deg from it.",
        code="PNT-WALL-011" if oblique else "PNT-WALL-012",
    )


def wall_on_plane(
    plane: Plane,
    X_WT_expected: RigidTransform,
    tile: TileSize,
    *,
    total: int,
) -> Wall:
    """Makes the wall of a plane: its tile frame and its figures.

    T's z is the plane's normal on the robot's side, T's y as close to the expected T y
    as the plane allows, and the tile's centre where the plane meets the line through
    the expected tile's centre along the expected T z.

    Args:
        plane: In W.
        X_WT_expected: Tile frame where the job expects it.
        tile: Its size.
        total: Points of the cloud.

    Returns:
        The wall.
    """
    expected = X_WT_expected.rotation().matrix()
    distance, _ = deviation(plane, X_WT_expected, tile)
    p_WC = X_WT_expected @ tile.p_TC + distance * expected[:, 2]
    normal = plane.normal * np.sign(plane.normal @ expected[:, 2])
    R_WT = upright_rotation(normal, expected[:, 1])
    return Wall(
        X_WT=RigidTransform(R_WT, p_WC - R_WT @ tile.p_TC),
        rms=plane.rms,
        inlier_count=plane.count,
        inlier_share=plane.count / total,
    )


def upright_rotation(normal_W: FloatArray, up_W: FloatArray) -> RotationMatrix:
    """Returns R_WT with T z along a normal and T y as close to `up_W` as that allows.

    Args:
        normal_W: (3,) unit, in W.
        up_W: (3,) in W, not along the normal.

    Returns:
        The rotation.
    """
    y = up_W - (up_W @ normal_W) * normal_W
    y /= np.linalg.norm(y)
    matrix = np.stack([np.cross(y, normal_W), y, normal_W], axis=1)
    return RotationMatrix.ProjectToRotationMatrix(matrix)
