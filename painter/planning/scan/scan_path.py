"""First sight of the wall and the zig-zag scan, as motions of the depth camera.

The camera looks square at the wall, like the gun beside it. Its field of view is that
of the D435's depth: 87 x 58 deg. Source: Intel RealSense D400 series data sheet,
2023, table 4-2 (848 x 480).
"""

import dataclasses
from dataclasses import dataclass

import numpy as np

from painter.errors import CollisionError, PainterError, ReachError
from painter.planning.config import ScanConfig, TileConfig
from painter.planning.motion.gun_path import Pass, ToolMove, WallIk
from painter.planning.motion.joint_motion import SEARCH_SHARE, Segment, rest_to_rest
from painter.planning.motion.reach import require_reach
from painter.planning.motion.transitions import TransitionPlanner
from perception.ground import FloatArray, FrozenValue

_HFOV = np.deg2rad(87.0)
_VFOV = np.deg2rad(58.0)
BASELINE = 0.050  # m; the left edge of a stereo depth image is blind for so much.
_ROW_STEP = 0.01  # m, between the row heights that are tried.
_POINT_STEP = 0.02  # m, between the places on a row that are looked at.
_DISTANCE_SHARES = (1.0, 0.95, 0.9, 0.85, 0.8)  # Of the scan distance, tried in turn.
_LOOK_SPREAD = 0.1  # m, of first looks around the middle of a quarter,
_LOOK_TICKS = 5  # and how many are tried in either direction.
_SHORTEST_ROW = 0.05  # m; a row is a pass and a pass has a direction.


@dataclass(frozen=True, eq=False)
class View(FrozenValue):
    """What a square depth camera sees of a plane.

    Attributes:
        left: How far to the left of its axis, m.
        right: How far to the right, m.
        half_height: How far above and below, m.
    """

    left: float
    right: float
    half_height: float


def view_at(distance: float) -> View:
    """Returns what the depth camera sees of a wall at a distance, m.

    The right imager is one baseline to the right of the left one, where depth is
    reported: a strip as wide as the baseline on the left side has no match in it.
    """
    half_width = float(distance * np.tan(_HFOV / 2.0))
    half_height = float(distance * np.tan(_VFOV / 2.0))
    return View(half_width - BASELINE, half_width, half_height)


def nozzle_under_camera(p_TCs: FloatArray, ik: WallIk) -> FloatArray:
    """Returns where the nozzle is with the square camera at p_TCs (n, 3), m, in T.

    With the tool square to the wall L's axes in T are x = -z, y = -x, z = y.
    """
    arm = ik.kinematics
    ahead, left, above = arm.X_LG.translation() - arm.X_LC.translation()
    return np.asarray(p_TCs + np.array([-left, above, -ahead]))


def look_segments(
    q0: FloatArray, tile: TileConfig, scan: ScanConfig, transitions: TransitionPlanner
) -> list[Segment]:
    """Plans first sight: from rest at `q0` (5,), rad, over two quarters of the tile.

    One look at the middle would do for a bare wall; where there is a window in the
    middle it would show anything but the wall. Two quarters that lie across from one
    another give the wall's tilt about both axes. Of the poses in either quarter those
    two are taken that are come to in the least time; pictures are taken on the way as
    well.

    Raises:
        ReachError: The camera can stand before a quarter nowhere.
        CollisionError: There is no clear way.
    """
    # Ends at the upper left, where the scan begins.
    lower, upper = (
        look_poses(np.array([x * tile.width, y * tile.height]), scan, transitions)
        for x, y in ((0.75, 0.25), (0.25, 0.75))
    )
    # To compare, rates will do.
    limits = transitions.limits.replace(torques=None, nozzle=None)

    def times(starts: FloatArray, ends: FloatArray) -> FloatArray:
        return np.array(
            [[rest_to_rest(a, b, limits).duration for b in ends] for a in starts]
        )

    total = times(q0[None], lower).T + times(lower, upper)
    first, second = np.unravel_index(int(np.argmin(total)), total.shape)
    return [
        *transitions.free_motion(q0, lower[first]),
        *transitions.free_motion(lower[first], upper[second]),
    ]


def look_poses(
    centre_T: FloatArray, scan: ScanConfig, transitions: TransitionPlanner
) -> FloatArray:
    """Finds the poses that look at a place or near it, where the arm can stand.

    Straight before the shoulder the arm would have to fold flat.

    Args:
        centre_T: (2,) m, in T's x and y.
        scan: Settings; `look_distance` is kept.
        transitions: Reach and clearance.

    Returns:
        (n, 5) rad, n >= 1, the camera within 0.3 m beside, above or below the place.

    Raises:
        ReachError: The camera can stand at that distance nowhere near.
    """
    ticks = _LOOK_SPREAD * np.linspace(-1.0, 1.0, _LOOK_TICKS)
    x, y = np.meshgrid(centre_T[0] + ticks, centre_T[1] + ticks)
    p_TCs = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, scan.look_distance)])
    p_TGs = nozzle_under_camera(p_TCs, transitions.ik)
    good = reachable_and_clear(p_TGs, transitions)
    if not good.any():
        raise ReachError(
            f"look: no clear pose with the camera {scan.look_distance:.2f} m before "
            f"the wall within {_LOOK_SPREAD} m of T ({centre_T[0]:.2f}, "
            f"{centre_T[1]:.2f}) m.",
            code="PNT-SCAN-002",
        )
    return transitions.ik.inverse_kinematics(p_TGs[good])


def scan_rows(
    tile: TileConfig, scan: ScanConfig, transitions: TransitionPlanner
) -> list[Pass]:
    """Lays level camera rows over the tile, top row first, ending at its left.

    As few rows as cover the tile and its margin with at least the overlap wanted,
    at heights where the arm reaches the whole row. Where the arm cannot fold back far
    enough, the camera goes up to a fifth nearer to the wall; where a joint could not
    follow, it goes slower.

    Args:
        tile: Size of the tile.
        scan: Settings; overlap and margin are kept.
        transitions: Reach and clearance.

    Returns:
        Rows as passes of the nozzle.

    Raises:
        ReachError: A row is out of reach at every distance; names its height.
        CollisionError: A row comes too near to something; names its height.
    """
    failure: PainterError | None = None
    for share in _DISTANCE_SHARES:
        nearer = dataclasses.replace(scan, distance=share * scan.distance)
        try:
            return _rows_at_distance(tile, nearer, transitions)
        except (CollisionError, ReachError) as error:
            failure = failure or error
    assert failure is not None
    raise failure


def _rows_at_distance(
    tile: TileConfig, scan: ScanConfig, transitions: TransitionPlanner
) -> list[Pass]:
    """Lays the rows with the camera exactly `scan.distance` from the wall."""
    view = view_at(scan.distance)
    left = -scan.margin + view.left
    right = tile.width + scan.margin - view.right
    if right - left < _SHORTEST_ROW:
        middle = (left + right) / 2.0
        left, right = middle - _SHORTEST_ROW / 2.0, middle + _SHORTEST_ROW / 2.0
    heights = _row_heights(tile, scan, transitions, left, right)[::-1]
    rows: list[Pass] = []
    rightwards = len(heights) % 2 == 0
    for height in heights:
        x0, x1 = (left, right) if rightwards else (right, left)
        p_TCs = np.array([[x0, height, scan.distance], [x1, height, scan.distance]])
        p_TGs = nozzle_under_camera(p_TCs, transitions.ik)
        row = Pass.between(p_TGs[0], p_TGs[1], scan.speed)
        rows.append(_slowed(row, transitions))
        rightwards = not rightwards
    return rows


def scan_segments(
    q0: FloatArray, tile: TileConfig, scan: ScanConfig, transitions: TransitionPlanner
) -> list[Segment]:
    """Plans the whole scan from rest at `q0` (5,) rad, to rest beside the last row.

    Raises:
        ReachError: A row or the way to it is out of reach.
        CollisionError: There is no clear way.
    """
    rows = scan_rows(tile, scan, transitions)
    path = transitions.from_rest(q0, rows[0].start)
    for index, row in enumerate(rows):
        if index > 0:
            path += transitions.connect(rows[index - 1].end, row.start)
        path.append(ToolMove(row, transitions.ik))
    path.append(transitions.to_rest(rows[-1].end))
    return path


def _row_heights(
    tile: TileConfig,
    scan: ScanConfig,
    transitions: TransitionPlanner,
    left: float,
    right: float,
) -> list[float]:
    """Returns row heights in T, bottom to top, m."""
    view = view_at(scan.distance)
    bottom = -scan.margin + view.half_height  # The first row may be no higher,
    top = tile.height + scan.margin - view.half_height  # nor the last one lower.
    spacing = 2.0 * view.half_height * (1.0 - scan.overlap)
    if top <= bottom:
        bottom = top = (top + bottom) / 2.0
    # Spread evenly where the arm can; else the highest that still overlaps.
    count = 1 + int(np.ceil((top - bottom) / spacing - 1e-9))
    even: list[float] = np.linspace(bottom, top, count).tolist()
    x = np.linspace(left, right, int((right - left) / _POINT_STEP) + 2)

    def clear(height: float) -> bool:
        return bool(
            reachable_and_clear(
                _row_points(x, height, scan, transitions), transitions
            ).all()
        )

    if all(clear(height) for height in even):
        return even
    heights: list[float] = []
    limit = bottom
    while not heights or heights[-1] < top:
        floor = heights[-1] if heights else limit - view.half_height
        limit = heights[-1] + spacing if heights else bottom
        tries = np.arange(limit, floor + _ROW_STEP / 2.0, -_ROW_STEP)
        found = next((float(height) for height in tries if clear(height)), None)
        if found is None:
            points = _row_points(x, limit, scan, transitions)
            what = f"scan row {tile.bottom + limit:.2f} m over the floor"
            require_reach(
                points, ik=transitions.ik, limits=transitions.limits, what=what
            )
            q = transitions.ik.inverse_kinematics(points)
            transitions.space.require(q, np.zeros(len(q)), what=what)
        else:
            heights.append(found)
    return heights


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


def _row_points(
    x: FloatArray, height: float, scan: ScanConfig, transitions: TransitionPlanner
) -> FloatArray:
    """Returns nozzle positions (n, 3) along a camera row, m, in T."""
    p_TCs = np.column_stack(
        [x, np.full(x.size, height), np.full(x.size, scan.distance)]
    )
    return nozzle_under_camera(p_TCs, transitions.ik)


def reachable_and_clear(
    p_TGs: FloatArray, transitions: TransitionPlanner
) -> np.ndarray:
    """Returns (n,) bool: at which nozzle places (n, 3) the arm keeps clear."""
    q = transitions.ik.inverse_kinematics(p_TGs)
    good = transitions.limits.contains(q)
    good[good] = transitions.space.free(q[good])
    return np.asarray(good)
