"""Segmentation of recorded clouds, for which no job says where the wall is."""

import dataclasses
import math
from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform

from perception.config import SegmentationConfig
from perception.errors import GridSizeError, NoWallError
from perception.fine_steps.refine import refine_segmentation
from perception.ground import FloatArray, FrozenValue
from perception.paper_steps.pipeline import (
    FoundPlanes,
    SegmentationStages,
    find_planes,
    segment_tile,
)
from perception.paper_steps.planes import fit_plane
from perception.paper_steps.wall import MIN_POINTS, upright_rotation, wall_on_plane
from perception.recorded.recorded_tile import (
    ViewSide,
    clear_feet,
    close_gaps,
    fitting_cell,
    robust_extent,
    set_back_wall,
    side_of_view,
)
from perception.recorded.wall_choice import choose_wall
from perception.values import SurfaceMap, TileSize

MAX_CELLS = 4_000_000
MAX_FINE_CELLS = 400_000  # Each is split into up to 16 sub-cells.
# Points farther than this from the median are no part of any wall a robot paints, and
# such numbers leave no digits for the rest.
_STRAY = 1000.0
# Where the inlier distance is left to the data: so many standard deviations of the
# wall's points (6e-5 of a normal distribution are beyond), but not below the least.
_NOISE_FACTOR = 4.0
_LEAST_INLIER_DISTANCE = 0.006


@dataclass(frozen=True, eq=False)
class RecordedWall(FrozenValue):
    """What was found in a recording.

    Attributes:
        stages: The segmentation with its intermediate results.
        side: On which side of the wall the sensor was, and how that is known.
        inlier_distance: Of the wall's points, m.
        strays: Points that were left out because they are over a kilometre away.
        set_back_area: Of the mask that is wall behind the main plane, m².
    """

    stages: SegmentationStages
    side: ViewSide
    inlier_distance: float
    strays: int
    set_back_area: float


def segment_recorded(
    p_WQs: FloatArray,
    *,
    config: SegmentationConfig,
    seed: int,
    tile: tuple[float, float] | None = None,
    up_W: FloatArray | None = None,
    distance: float | None = None,
    p_WC: FloatArray | None = None,
    fit_cell: bool = False,
    fit_inlier_distance: bool = False,
    set_back: float = 0.0,
    fine: bool = False,
) -> RecordedWall:
    """Finds the wall of a recorded cloud and segments a tile in the middle of it.

    The wall is the largest plane that may be one: upright if `up_W` is given, at
    `distance` from the sensor if that is given, no face of a carton, and a surface
    rather than a slab through clutter. The tile is centred on the middle of its points.

    Args:
        p_WQs: (3, N) m, in the recording's frame W.
        config: Thresholds of the steps.
        seed: Of RANSAC's random triples.
        tile: Its width and height, m; if left out, of all that is seen of the wall.
        up_W: (3,) which way is up; if left out, the picture's -y is taken for T's
            orientation and floors are not told from walls.
        distance: Expected distance of the wall, m; `config.wall_distance_tolerance` is
            its tolerance.
        p_WC: (3,) where the sensor was, in W; if left out, see `side_of_view`.
        fit_cell: Whether cells may be larger than `config.cell` where the points are
            too sparse for it or the tile is too large; then gaps of one or two cells
            are closed, too.
        fit_inlier_distance: Whether the wall's points may be taken closer than within
            `config.distance_threshold` where there is little noise.
        set_back: How far behind the wall's plane parts of the wall may lie that it
            does not enclose (dormers), m; 0 = none.
        fine: Whether the mask is drawn by fine steps against the wall's own surface, as
            on the robot; see `refine_segmentation`. It suits dense depth images.

    Returns:
        The wall; its segmentation's cell is the one used.

    Raises:
        NoWallError: There are too few points or no such plane; names the reasons.
        GridSizeError: The tile has more than `MAX_CELLS` of the cells asked for, or by
            fine steps `MAX_FINE_CELLS`.
    """
    points = _without_strays(p_WQs)
    found = find_planes(points, config=config, seed=seed)
    number = choose_wall(found, config=config, up_W=up_W, distance=distance, p_WC=p_WC)
    limit = config.distance_threshold
    if fit_inlier_distance:
        found, limit = _with_close_inliers(found, number, limit)
    plane = found.planes[number]
    on_wall = found.p_WQs[:, found.labels == number + 1]
    side = side_of_view(plane, found.p_WQs[:, found.kept], limit=limit, p_WC=p_WC)
    up_T = np.array([0.0, -1.0, 0.0]) if up_W is None else up_W
    R_WT = upright_rotation(side.normal_W, _across(up_T, side.normal_W))
    p_TQs = R_WT.inverse() @ on_wall
    shown = p_TQs
    if set_back > 0.0:
        shown = R_WT.inverse() @ found.p_WQs[:, found.kept]
        depth = shown[2] - np.median(p_TQs[2])
        shown = shown[:, (depth >= -set_back) & (depth <= limit)]
    middle, extent = robust_extent(shown)
    middle[2] = np.median(p_TQs[2])
    width, height = extent[:2] if tile is None else tile
    cell = least_cell = config.cell
    most = MAX_FINE_CELLS if fine else MAX_CELLS
    if fit_cell:
        cell = fitting_cell(p_TQs[:2], least=cell)
        cell = max(cell, math.sqrt(width * height / most))
    elif width * height > most * cell**2:
        enough = math.ceil(1e4 * math.sqrt(width * height / most)) / 1e4
        raise GridSizeError(
            f"a tile of {width:g} x {height:g} m with cells of {cell:g} m has more "
            f"than {most} cells; take a smaller tile or cells of {enough:g} m.",
            code="PNT-WALL-008",
        )
    if tile is None:  # An extent from the data is a whole number of cells.
        width, height = (
            max(1, math.ceil(length / cell)) * cell for length in (width, height)
        )
    size = TileSize(width, height)
    X_WT = RigidTransform(R_WT, R_WT @ (middle - size.p_TC))
    wall = wall_on_plane(plane, X_WT, size, total=found.kept_count)
    config = dataclasses.replace(config, cell=cell, distance_threshold=limit)
    stages = segment_tile(found, wall, number + 1, size, config=config)
    if fine:
        kept = SurfaceMap.of_points(found.p_WQs[:, found.kept])
        result = refine_segmentation(
            stages.segmentation, kept, config=config, seed=seed
        )
        stages = stages.replace(segmentation=result)
    else:
        stages = clear_feet(stages, limit=limit)
    area = 0.0
    if set_back > 0.0:
        stages, area = set_back_wall(stages, set_back=set_back)
    if cell > least_cell and not fine:
        stages = close_gaps(stages)
    return RecordedWall(
        stages=stages,
        side=side,
        inlier_distance=limit,
        strays=int(np.isfinite(p_WQs).all(axis=0).sum()) - points.shape[1],
        set_back_area=area,
    )


def _without_strays(p_WQs: FloatArray) -> FloatArray:
    """Leaves out points that are not finite or absurdly far from the median."""
    finite = p_WQs[:, np.all(np.isfinite(p_WQs), axis=0)]
    if finite.shape[1] == 0:
        raise NoWallError(
            f"the cloud has 0 finite points of {p_WQs.shape[1]}; "
            f"a wall needs at least {MIN_POINTS}.",
            code="PNT-WALL-009",
        )
    with np.errstate(over="ignore"):
        away = np.abs(finite - np.median(finite, axis=1, keepdims=True))
    return finite[:, np.all(away <= _STRAY, axis=0)]


def _with_close_inliers(
    found: FoundPlanes, number: int, limit: float
) -> tuple[FoundPlanes, float]:
    """Takes from a plane the points farther from it than its noise explains."""
    own = np.flatnonzero(found.labels == number + 1)
    away = np.abs(found.planes[number].distances(found.p_WQs[:, own]))
    # 0.6745: median of the absolute value of a standard normal variable.
    fitted = _NOISE_FACTOR * float(np.median(away)) / 0.6745
    fitted = max(fitted, _LEAST_INLIER_DISTANCE)
    if fitted >= limit:
        return found, limit
    plane = fit_plane(found.p_WQs[:, own[away <= fitted]])
    away = np.abs(plane.distances(found.p_WQs[:, own]))
    labels = found.labels.copy()
    labels[own[away > fitted]] = 0
    planes = list(found.planes)
    planes[number] = fit_plane(found.p_WQs[:, labels == number + 1])
    return found.replace(labels=labels, planes=tuple(planes)), fitted


def _across(up_W: FloatArray, normal_W: FloatArray) -> FloatArray:
    """Returns up, or another axis where up is along the normal."""
    if abs(float(normal_W @ up_W)) > math.cos(math.radians(10.0)) * float(
        np.linalg.norm(up_W)
    ):
        return np.roll(up_W, 1)
    return up_W
