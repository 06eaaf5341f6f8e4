"""The tile on a recorded wall: its front, size and cells, and parts set back."""

import enum
import math
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import binary_closing, binary_propagation
from scipy.spatial import cKDTree

from perception.fine_steps.unseen import Reason
from perception.ground import BoolArray, FloatArray, FrozenValue
from perception.paper_steps.pipeline import SegmentationStages
from perception.paper_steps.planes import Plane

# A sensor sees a wall from no farther than so many times the cloud's extent; beyond,
# the frame is a map's and its origin means nothing. 3 is a view of 19 deg.
_FARTHEST_VIEW = 3.0
_CELL_STEPS = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.5, 10.0, 15.0, 20.0, 30.0, 50.0)
_GAP_FACTOR = 0.8
_SAMPLES = 2000
_NEIGHBOURS = 128
# Set-back wall: parallel within this, and no more than this share between wall.
_PARALLEL = math.cos(math.radians(5.0))
_MOST_ENCLOSED = 0.2
_LEAST_SHARE = 0.02


class ViewSource(enum.StrEnum):
    """How it is known from where a wall was seen."""

    GIVEN = "given"
    ORIGIN = "origin of the cloud's frame"
    RECESSES = "openings lie behind a wall; the origin is too far to be the sensor"


@dataclass(frozen=True, eq=False)
class ViewSide(FrozenValue):
    """On which side of a wall the sensor was.

    Attributes:
        normal_W: (3,) unit normal of the wall, towards the sensor.
        source: How that is known.
    """

    normal_W: FloatArray
    source: ViewSource


def side_of_view(
    plane: Plane, p_WQs: FloatArray, *, limit: float, p_WC: FloatArray | None
) -> ViewSide:
    """Finds out from which side a wall was seen.

    From that of the sensor if its place is given, else from that of the origin, which
    is the sensor in most recordings. Where the origin is farther from the wall than
    three times the cloud's extent, as in a map's frame, it says nothing; then what lies
    off the wall by up to a metre is taken for recesses behind it.

    Args:
        plane: The wall's, in W.
        p_WQs: (3, N) m, in W.
        limit: Largest distance of the wall's points from the plane, m.
        p_WC: (3,) where the sensor was, in W, if known.

    Returns:
        The side.
    """
    source = ViewSource.GIVEN
    if p_WC is None:
        source, p_WC = ViewSource.ORIGIN, np.zeros(3)
    sign = 1.0 if float(plane.normal @ p_WC) > plane.offset else -1.0
    if source is ViewSource.ORIGIN:
        low, high = np.percentile(p_WQs, [1.0, 99.0], axis=1)
        far = _FARTHEST_VIEW * float(np.linalg.norm(high - low))
        if abs(plane.offset) > far:
            off = plane.distances(p_WQs)
            off = off[(np.abs(off) > 2.0 * limit) & (np.abs(off) < 1.0)]
            if off.size:
                source = ViewSource.RECESSES
                sign = -1.0 if np.median(off) > 0.0 else 1.0
    return ViewSide(normal_W=sign * plane.normal, source=source)


def robust_extent(p_TQs: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Finds the middle and size of a cloud, whatever a few stray points do.

    Args:
        p_TQs: (3, N) m.

    Returns:
        (3,) the middle and (3,) the size, m, of the box around the points that are no
        farther out than the 0.1th and 99.9th percentiles and a twentieth.
    """
    low, high = np.percentile(p_TQs, [0.1, 99.9], axis=1)
    margin = 0.05 * (high - low)
    # Axis by axis: a point that strays along one is not asked about the others.
    ends = []
    for row, lowest, highest in zip(p_TQs, low - margin, high + margin, strict=True):
        inside = row[(row >= lowest) & (row <= highest)]
        ends.append((inside.min(), inside.max()))
    low, high = np.array(ends).T
    return (low + high) / 2.0, high - low


def fitting_cell(p_TQs: FloatArray, *, least: float) -> float:
    """Chooses a cell by the spacing of the points.

    The spacing of a point is the largest of the distances to its nearest neighbours to
    the left, right, above and below: between scan lines it is that of the lines. The
    largest of four is above the mean spacing, and a cell without a point between others
    does no harm, so 0.8 of the median spacing is enough.

    Args:
        p_TQs: (2, N) the wall's points in its plane, m.
        least: Smallest cell wanted, m.

    Returns:
        The smallest of some multiples of `least` that is large enough, m.
    """
    points = p_TQs.T
    # Evenly spread over the file; the median needs no more.
    samples = points[:: max(1, len(points) // _SAMPLES)]
    tree = cKDTree(points)
    distances, neighbours = tree.query(samples, k=min(_NEIGHBOURS, len(points)))
    x, y = np.moveaxis(points[neighbours] - samples[:, None], -1, 0)
    sides = (x > np.abs(y), -x > np.abs(y), y > np.abs(x), -y > np.abs(x))
    nearest = [np.where(side, distances, np.inf).min(axis=1) for side in sides]
    needed = _GAP_FACTOR * float(np.median(np.max(nearest, axis=0)))
    steps = [step * least for step in _CELL_STEPS if step * least >= needed]
    return steps[0] if steps else _CELL_STEPS[-1] * least


def clear_feet(stages: SegmentationStages, *, limit: float) -> SegmentationStages:
    """Takes the feet of obstacles out of the mask.

    What stands on a wall has sides. Seen at a slant they are narrow strips, too small
    to be regions, and inherit from the wall as often as from the obstacle. Where half
    of a cell's points lie before the wall, and such cells lead to an obstacle, they
    belong to it.

    Args:
        stages: The segmentation.
        limit: Largest distance of the wall's points from its plane, m.

    Returns:
        The segmentation with these cells not in the mask.
    """
    result = stages.segmentation
    ny, nx = result.wall_mask.shape
    p_TQs = result.X_WT.inverse() @ stages.found.p_WQs[:, stages.found.kept]
    columns, rows = np.floor(p_TQs[:2] / result.cell).astype(np.int64)
    inside = (columns >= 0) & (columns < nx) & (rows >= 0) & (rows < ny)
    cells = rows[inside] * nx + columns[inside]
    before = np.bincount(cells[p_TQs[2, inside] > limit], minlength=ny * nx)
    half = 0.5 * np.bincount(cells, minlength=ny * nx)
    raised = (before > 0) & (before >= half)
    obstacle = ~result.wall_mask & (result.labels > 0) & (result.depth > limit)
    foot = binary_propagation(
        obstacle, np.ones((3, 3)), mask=obstacle | raised.reshape(ny, nx)
    )
    return stages.replace(
        segmentation=result.replace(wall_mask=result.wall_mask & ~foot)
    )


def close_gaps(stages: SegmentationStages) -> SegmentationStages:
    """Adds gaps between points to the mask: unseen, one or two cells wide, in the wall.

    Args:
        stages: The segmentation of a cloud whose points are about a cell apart.

    Returns:
        The segmentation with these cells in the mask.
    """
    result = stages.segmentation
    padded = np.pad(result.wall_mask, 2)  # Closing would wear the border off.
    closed = binary_closing(padded, np.ones((3, 3)))[2:-2, 2:-2]
    mask = result.wall_mask | (closed & (result.labels == 0))
    return stages.replace(segmentation=result.replace(wall_mask=mask))


def set_back_wall(
    stages: SegmentationStages, *, set_back: float
) -> tuple[SegmentationStages, float]:
    """Adds parts of a wall that lie behind its plane, such as dormers, to the mask.

    Such a part is a region of a plane parallel to the wall's, up to `set_back` behind
    it, of at least a fiftieth of the wall's area, and it lies beside the wall: seen
    along the rows or along the columns, less than a fifth of it is between wall and
    wall, as a window or a door is.

    Args:
        stages: The segmentation.
        set_back: How far behind, m.

    Returns:
        The segmentation with these parts in the mask, and their area, m².
    """
    result = stages.segmentation
    normal_T = result.X_WT.rotation().matrix()[:, 2]
    wall = result.wall_mask
    least = _LEAST_SHARE * np.count_nonzero(wall)
    between = _between(wall, axis=1) | _between(wall, axis=0)
    mask = wall.copy()
    for number, plane in enumerate(stages.found.planes, start=1):
        if abs(float(plane.normal @ normal_T)) < _PARALLEL:
            continue
        for label in np.unique(result.labels[stages.grid.labels == number]):
            region = (result.labels == label) & ~wall
            seen = region & np.isfinite(result.depth)
            if label == 0 or np.count_nonzero(seen) < max(least, 1):
                continue
            depth = float(np.median(result.depth[seen]))
            if -set_back <= depth < 0.0 and between[region].mean() < _MOST_ENCLOSED:
                mask |= region
    area = float(np.count_nonzero(mask & ~wall)) * result.cell**2
    reason = result.reason
    if reason is not None:
        reason = np.where(mask, Reason.WALL, reason).astype(np.uint8)
    return stages.replace(
        segmentation=result.replace(wall_mask=mask, reason=reason)
    ), area


def _between(wall: BoolArray, *, axis: int) -> BoolArray:
    """Finds the cells that have wall on both sides along an axis."""
    # Gaps in the wall, as between scan lines, are wall here.
    wall = np.asarray(binary_closing(wall, np.ones((3, 3))), dtype=np.bool_) | wall
    before = np.maximum.accumulate(wall, axis=axis)
    after = np.flip(np.maximum.accumulate(np.flip(wall, axis), axis=axis), axis)
    between: BoolArray = before & after & ~wall
    return between
