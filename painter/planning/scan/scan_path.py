"""The zig-zag scan: level camera rows over the tile.

The camera looks square at the wall, like the gun beside it. Row heights, row ends and
the spacing of pictures follow from its footprint: field of view, baseline, and how it
is mounted.
"""

import math

import numpy as np

from painter.errors import CollisionError, InputError, PainterError, ReachError
from painter.planning.arm.scan_camera import Footprint, ScanCamera
from painter.planning.config import ScanConfig, TileConfig
from painter.planning.motion.gun_path import Pass, ToolMove
from painter.planning.motion.joint_motion import SEARCH_SHARE, Segment
from painter.planning.motion.reach import require_reach
from painter.planning.motion.transitions import TransitionPlanner
from painter.planning.scan.camera_poses import CameraPoses
from perception.ground import FloatArray

_ROW_STEP = 0.01  # m, between the row heights that are tried.
_POINT_STEP = 0.02  # m, between the samples of a row.
_DISTANCE_SHARES = (1.0, 0.95, 0.9, 0.85, 0.8)  # Of the scan distance, tried in turn.
_SHORTEST_ROW = 0.05  # m; a row is a pass and a pass has a direction.


def check_scan(
    tile: TileConfig, scan: ScanConfig, camera: ScanCamera, *, time_limit: float
) -> None:
    """Checks what needs no arm: that rows cover the tile in time and without gaps.

    Args:
        tile: Size of the tile.
        scan: Settings.
        camera: On the tool.
        time_limit: Of the whole cycle, s.

    Raises:
        InputError: Pictures along a row leave gaps, or the rows take too long; names
            field, value, bound and cure.
    """
    footprint = camera.footprint(scan.distance)
    _require_overlap(scan, camera, footprint)
    left, right = _row_ends(tile, scan, footprint)
    rows = len(_even_heights(tile, scan, footprint))
    _require_in_time(rows * (right - left) / scan.speed, rows, scan, time_limit)


def scan_segments(
    q0: FloatArray,
    tile: TileConfig,
    scan: ScanConfig,
    poses: CameraPoses,
    *,
    time_limit: float = math.inf,
) -> list[Segment]:
    """Plans the whole scan from rest at `q0` (5,) rad, to rest beside the last row.

    Raises:
        InputError: The scan takes longer than `time_limit`, s.
        ReachError: A row or the way to it is out of reach.
        CollisionError: There is no clear route.
    """
    transitions = poses.transitions
    rows = scan_rows(tile, scan, poses)
    path = transitions.from_rest(q0, rows[0].start)
    for index, row in enumerate(rows):
        if index > 0:
            path += transitions.connect(rows[index - 1].end, row.start)
        path.append(ToolMove(row, transitions.ik))
    path.append(transitions.to_rest(rows[-1].end))
    duration = sum(segment.duration for segment in path)
    _require_in_time(duration, len(rows), scan, time_limit)
    return path


def scan_rows(tile: TileConfig, scan: ScanConfig, poses: CameraPoses) -> list[Pass]:
    """Lays level camera rows over the tile, top row first, ending at its left.

    As few rows as cover the tile and its margin with at least the overlap, at heights
    where the arm reaches the whole row. Where the arm cannot fold back far enough, the
    camera goes up to a fifth nearer to the wall, but not below its nearest depth; where
    a joint could not follow, it goes slower.

    Args:
        tile: Size of the tile.
        scan: Settings; overlap and margin are kept.
        poses: Camera poses before the wall.

    Returns:
        Rows as passes of the nozzle.

    Raises:
        ReachError: A row is out of reach at every distance; names its height.
        CollisionError: A row violates the clearance at every distance; names its
            height.
    """
    failure: PainterError | None = None
    for share in _DISTANCE_SHARES:
        distance = share * scan.distance
        if share < 1.0 and distance <= poses.camera.stereo.min_range:
            break
        try:
            return _rows_at(distance, tile, scan, poses)
        except (CollisionError, ReachError) as error:
            failure = failure or error
    assert failure is not None
    raise failure


def _require_overlap(
    scan: ScanConfig, camera: ScanCamera, footprint: Footprint
) -> None:
    """Raises InputError if pictures along a row overlap less than rows do."""
    stride = scan.speed / camera.rate
    longest = (1.0 - scan.overlap) * footprint.width
    if stride > longest:
        raise InputError(
            f"scan.speed of {scan.speed:g} m/s at wall_camera.rate of {camera.rate:g} "
            f"pictures a second leaves {stride:.3f} m between pictures, more than the "
            f"{longest:.3f} m that scan.overlap allows: lower scan.speed to at most "
            f"{longest * camera.rate:.3g} m/s, or raise wall_camera.rate.",
            code="PNT-SCAN-004",
        )


def _require_in_time(
    duration: float, rows: int, scan: ScanConfig, time_limit: float
) -> None:
    if duration > time_limit:
        raise InputError(
            f"the scan takes {duration:.0f} s or more for {rows} rows at scan.speed of "
            f"{scan.speed:g} m/s, longer than cycle.time_limit of {time_limit:g} s: "
            f"raise scan.distance ({scan.distance:g} m), scan.speed or "
            f"cycle.time_limit, or lower scan.overlap ({scan.overlap:g}).",
            code="PNT-SCAN-005",
        )


def _rows_at(
    distance: float, tile: TileConfig, scan: ScanConfig, poses: CameraPoses
) -> list[Pass]:
    """Lays the rows with the camera at a distance from the wall, m."""
    footprint = poses.camera.footprint(distance)
    _require_overlap(scan, poses.camera, footprint)
    left, right = _row_ends(tile, scan, footprint)
    x = np.linspace(left, right, int((right - left) / _POINT_STEP) + 2)

    def row_points(height: float) -> FloatArray:
        return np.column_stack([x, np.full(x.size, height), np.full(x.size, distance)])

    def clear(height: float) -> bool:
        return bool(poses.reachable_and_clear(row_points(height)).all())

    def require_clear(height: float) -> None:
        what = f"scan row {tile.bottom + height:.2f} m over the floor"
        transitions = poses.transitions
        q = require_reach(
            poses.nozzles(row_points(height)),
            ik=transitions.ik,
            limits=transitions.limits,
            what=what,
        )
        transitions.space.require(q, np.zeros(len(q)), what=what)

    # Spread evenly where the arm can; else the highest that still overlap.
    heights = _even_heights(tile, scan, footprint)
    if not all(clear(height) for height in heights):
        bottom, top, spacing = heights[0], heights[-1], _spacing(scan, footprint)
        heights = []
        while not heights or heights[-1] < top:
            limit = heights[-1] + spacing if heights else bottom
            lowest = heights[-1] if heights else bottom - footprint.height / 2.0
            count = max(1, math.ceil((limit - lowest) / _ROW_STEP - 0.5))
            tries = limit - _ROW_STEP * np.arange(count)
            found = next((float(height) for height in tries if clear(height)), None)
            if found is None:
                require_clear(limit)
            else:
                heights.append(found)
    rows: list[Pass] = []
    rightwards = len(heights) % 2 == 0
    for height in reversed(heights):
        x0, x1 = (left, right) if rightwards else (right, left)
        ends = poses.nozzles(np.array([[x0, height, distance], [x1, height, distance]]))
        row = Pass.between(ends[0], ends[1], scan.speed)
        rows.append(_slowed(row, poses.transitions))
        rightwards = not rightwards
    return rows


def _row_ends(
    tile: TileConfig, scan: ScanConfig, footprint: Footprint
) -> tuple[float, float]:
    """Returns where rows begin and end, in T x, m."""
    left = -scan.margin + footprint.left
    right = tile.width + scan.margin - footprint.right
    if right - left < _SHORTEST_ROW:
        middle = (left + right) / 2.0
        left, right = middle - _SHORTEST_ROW / 2.0, middle + _SHORTEST_ROW / 2.0
    return left, right


def _even_heights(
    tile: TileConfig, scan: ScanConfig, footprint: Footprint
) -> list[float]:
    """Returns evenly spread row heights in T, bottom to top, m."""
    bottom = -scan.margin + footprint.below  # The first row may be no higher,
    top = tile.height + scan.margin - footprint.above  # nor the last one lower.
    if top <= bottom:
        return [(top + bottom) / 2.0]
    count = 1 + int(np.ceil((top - bottom) / _spacing(scan, footprint) - 1e-9))
    heights: list[float] = np.linspace(bottom, top, count).tolist()
    return heights


def _spacing(scan: ScanConfig, footprint: Footprint) -> float:
    """Returns the largest spacing of rows, m."""
    return footprint.height * (1.0 - scan.overlap)


def _slowed(row: Pass, transitions: TransitionPlanner) -> Pass:
    """Returns the row at the speed that the joints can follow, if that is less.

    Close before the base axis a camera moving sideways takes a fast yaw.
    """
    count = int(row.duration * np.linalg.norm(row.v_TG) / _POINT_STEP) + 5
    time = np.linspace(0.0, row.duration, count)
    v = np.gradient(transitions.ik.inverse_kinematics(row.p_TG(time)), time, axis=0)
    a = np.gradient(v, time, axis=0)
    limits = transitions.limits
    slower = max(
        1.0,
        float(np.max(np.abs(v) / limits.v_max)) / SEARCH_SHARE,
        float(np.sqrt(np.max(np.abs(a) / limits.a_max) / SEARCH_SHARE)),
    )
    return Pass(row.p0_TG, row.v_TG / slower, row.duration * slower)
