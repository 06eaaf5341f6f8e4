"""More looks after the scan, into the shadows that it left.

The scan passes before the middle of the tile, so an object near its borders hides wall
on the far side. Camera centres are chosen greedily: each shows most of the wall that is
still hidden, until none shows enough.

Source: Feige, "A threshold of ln n for approximating set cover", 1998: no polynomial
algorithm covers much more than the greedy one.
"""

import itertools

import numpy as np

from painter.errors import CollisionError
from painter.planning.arm.scan_camera import ScanCamera
from painter.planning.config import ScanConfig
from painter.planning.motion.joint_motion import Dwell, Segment, move_times
from painter.planning.motion.transitions import TransitionPlanner, end_q
from painter.planning.scan.camera_poses import CameraPoses
from perception.fine_steps.shadows import Relief
from perception.fine_steps.sight import seen_from
from perception.ground import BoolArray, FloatArray

_STEP = 0.1  # m, between the camera centres that are tried.
_DISTANCE_SHARES = (1.0, 0.9, 0.8)  # Of the scan's, of these centres from the wall.
_LEAST_GAIN = 5e-4  # m² of hidden wall that are worth a look.
_INSIDE = 0.02  # m, that a point of the wall lies inside the picture at least.


def more_looks(
    q0: FloatArray, relief: Relief, scan: ScanConfig, poses: CameraPoses
) -> list[Segment]:
    """Plans looks at hidden wall, each with a dwell of `scan.more_look_time`.

    A pose with no clear route is left out: the wall that it would show stays in shadow
    and is not painted.

    Args:
        q0: (5,) rad, start, at rest.
        relief: What the scan found.
        scan: Settings; `distance`, `more_looks` and `more_look_time` are used.
        poses: Camera poses before the wall.

    Returns:
        The motion to rest at the last pose; empty if nothing is worth a look.
    """
    path: list[Segment] = []
    transitions = poses.transitions
    for q in _in_order(q0, more_look_poses(q0, relief, scan, poses), transitions):
        at = end_q(path[-1]) if path else q0
        try:
            path += transitions.free_motion(at, q)
        except CollisionError:
            continue
        path.append(Dwell(q, scan.more_look_time))
    return path


def more_look_poses(
    q0: FloatArray, relief: Relief, scan: ScanConfig, poses: CameraPoses
) -> FloatArray:
    """Chooses poses of the arm that together show most of the hidden wall.

    Args:
        q0: (5,) rad, start; of poses that are about as good the nearest is taken.
        relief: What the scan found.
        scan: Settings; `distance` and `more_looks` are used.
        poses: Camera poses before the wall.

    Returns:
        (k, 5) rad, k <= `scan.more_looks`.
    """
    rows, columns = np.nonzero(relief.hidden)
    least = _LEAST_GAIN / relief.cell**2
    if rows.size < least or scan.more_looks == 0:
        return np.zeros((0, 5))
    p_TQs = relief.cell * np.column_stack([columns + 0.5, rows + 0.5])
    p_TCs = _camera_centres(relief, scan, poses.camera)
    shown = _in_picture(p_TCs, p_TQs, poses.camera)
    worth = shown.sum(axis=1) >= least
    p_TCs, shown = p_TCs[worth], shown[worth]
    # What one imager sees alone cannot be matched.
    for imager in poses.camera.imagers_T:
        shown &= seen_from(p_TCs + imager, p_TQs, relief.height, cell=relief.cell)
    shown &= poses.reachable_and_clear(p_TCs)[:, None]
    q = poses.q(p_TCs)
    chosen: list[FloatArray] = []
    for _ in range(scan.more_looks):
        gain = shown.sum(axis=1)
        if gain.size == 0 or gain.max() < least:
            break
        # A nearer pose may miss as much as is left out anyway.
        good = np.flatnonzero(gain > gain.max() - least)
        turn = np.abs(q[good] - q0) / poses.transitions.limits.v_max
        best = int(good[np.argmin(turn.max(axis=1))])
        chosen.append(q[best])
        shown &= ~shown[best]
    return np.reshape(chosen, (-1, 5))


def _camera_centres(relief: Relief, scan: ScanConfig, camera: ScanCamera) -> FloatArray:
    """Returns the camera centres (n, 3), m, in T, to try."""
    ny, nx = relief.height.shape
    x, y = (
        np.linspace(0.0, count * relief.cell, round(count * relief.cell / _STEP) + 1)
        for count in (nx, ny)
    )
    z = scan.distance * np.array(_DISTANCE_SHARES)
    return np.stack(np.meshgrid(x, y, z[z > camera.stereo.min_range]), axis=-1).reshape(
        -1, 3
    )


def _in_picture(p_TCs: FloatArray, p_TQs: FloatArray, camera: ScanCamera) -> BoolArray:
    """Returns (k, n) bool: which pictures hold which points of the wall."""
    offset = p_TQs[None] - p_TCs[:, None, :2]
    inside = np.zeros(offset.shape[:2], dtype=np.bool_)
    for z in np.unique(p_TCs[:, 2]):
        footprint, own = camera.footprint(float(z)), p_TCs[:, 2] == z
        x, y = np.moveaxis(offset[own], -1, 0)
        inside[own] = (x >= _INSIDE - footprint.left) & (x <= footprint.right - _INSIDE)
        inside[own] &= y >= _INSIDE - footprint.below
        inside[own] &= y <= footprint.above - _INSIDE
    return inside


def _in_order(
    q0: FloatArray, poses: FloatArray, transitions: TransitionPlanner
) -> list[FloatArray]:
    """Returns the poses in the quickest order of direct moves from `q0`."""
    stops = np.vstack([q0, poses])
    times = move_times(stops, stops, transitions.limits)

    def time(order: tuple[int, ...]) -> float:
        return sum(float(times[pair]) for pair in itertools.pairwise((0, *order)))

    best = min(itertools.permutations(range(1, len(stops))), key=time)
    return [stops[index] for index in best]
