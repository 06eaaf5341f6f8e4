"""More looks after the scan: into shadows, from where nothing stands before them.

The scan's camera passes before the middle of the tile, so what stands out near its
borders hides wall on the far side. Few places see such wall; those are taken that show
most of it, one after another, until no place shows enough.

Source: Feige, "A threshold of ln n for approximating set cover", 1998: no fast choice
is much better than the one that takes what covers most.
"""

import itertools

import numpy as np

from painter.errors import CollisionError
from painter.planning.config import ScanConfig
from painter.planning.motion.joint_motion import Dwell, Segment, rest_to_rest
from painter.planning.motion.transitions import TransitionPlanner, end_q
from painter.planning.scan.scan_path import (
    BASELINE,
    nozzle_under_camera,
    reachable_and_clear,
    view_at,
)
from perception.fine_steps.shadows import Relief
from perception.fine_steps.sight import seen_from
from perception.ground import FloatArray

_STEP = 0.1  # m, between the places that are tried.
_DISTANCE_SHARES = (1.0, 0.9, 0.8)  # Of the scan's, of these places from the wall.
_LEAST_GAIN = 5e-4  # m² of hidden wall that are worth a look.
_INSIDE = 0.02  # m, that a place on the wall lies inside the picture at least.


def more_looks(
    q0: FloatArray, relief: Relief, scan: ScanConfig, transitions: TransitionPlanner
) -> list[Segment]:
    """Plans looks at hidden wall, each held for `scan.more_look_time`.

    A place that the arm finds no clear way to is left out: the wall that it would have
    shown stays in shadow and is not painted.

    Args:
        q0: (5,) rad, where the arm stands, at rest.
        relief: What the scan has found.
        scan: Settings; `distance`, `more_looks` and `more_look_time` are used.
        transitions: Reach and clearance.

    Returns:
        The motion to rest at the last place; empty if there is nothing worth a look.
    """
    path: list[Segment] = []
    for q in _in_order(q0, look_poses(q0, relief, scan, transitions), transitions):
        at = end_q(path[-1]) if path else q0
        try:
            path += transitions.free_motion(at, q)
        except CollisionError:
            continue
        path.append(Dwell(q, scan.more_look_time))
    return path


def look_poses(
    q0: FloatArray, relief: Relief, scan: ScanConfig, transitions: TransitionPlanner
) -> FloatArray:
    """Chooses poses of the arm that together show most of the hidden wall.

    Args:
        q0: (5,) rad, where the arm stands; of places about as good the nearest is
            taken.
        relief: What the scan has found.
        scan: Settings; `distance` and `more_looks` are used.
        transitions: Reach and clearance.

    Returns:
        (k, 5) rad, k <= `scan.more_looks`.
    """
    rows, columns = np.nonzero(relief.hidden)
    least = _LEAST_GAIN / relief.cell**2
    if rows.size < least or scan.more_looks == 0:
        return np.zeros((0, 5))
    p_TQs = relief.cell * np.column_stack([columns + 0.5, rows + 0.5])
    p_TCs = _places(relief, scan)
    shown = _in_picture(p_TCs, p_TQs)
    worth = shown.sum(axis=1) >= least
    p_TCs, shown = p_TCs[worth], shown[worth]
    # What one imager sees alone cannot be matched.
    for eye in (0.0, BASELINE):
        shown &= seen_from(
            p_TCs + [eye, 0.0, 0.0], p_TQs, relief.height, cell=relief.cell
        )
    p_TGs = nozzle_under_camera(p_TCs, transitions.ik)
    shown &= reachable_and_clear(p_TGs, transitions)[:, None]
    q = transitions.ik.inverse_kinematics(p_TGs)
    chosen: list[FloatArray] = []
    for _ in range(scan.more_looks):
        gain = shown.sum(axis=1)
        if gain.size == 0 or gain.max() < least:
            break
        # What a nearer place leaves out may be no more than is left out anyway.
        good = np.flatnonzero(gain > gain.max() - least)
        turn = np.abs(q[good] - q0) / transitions.limits.v_max
        best = int(good[np.argmin(turn.max(axis=1))])
        chosen.append(q[best])
        shown &= ~shown[best]
    return np.reshape(chosen, (-1, 5))


def _places(relief: Relief, scan: ScanConfig) -> FloatArray:
    """Returns the places (n, 3), m, in T, where the camera might stand."""
    ny, nx = relief.height.shape
    x, y = (
        np.linspace(0.0, count * relief.cell, round(count * relief.cell / _STEP) + 1)
        for count in (nx, ny)
    )
    z = scan.distance * np.array(_DISTANCE_SHARES)
    return np.stack(np.meshgrid(x, y, z), axis=-1).reshape(-1, 3)


def _in_picture(p_TCs: FloatArray, p_TQs: FloatArray) -> np.ndarray:
    """Returns (k, n) bool: which places on the wall lie in the pictures of which."""
    way = p_TQs[None] - p_TCs[:, None, :2]
    inside = np.zeros(way.shape[:2], dtype=np.bool_)
    for z in np.unique(p_TCs[:, 2]):
        view, own = view_at(float(z)), p_TCs[:, 2] == z
        x, y = np.moveaxis(way[own], -1, 0)
        inside[own] = (x >= _INSIDE - view.left) & (x <= view.right - _INSIDE)
        inside[own] &= np.abs(y) <= view.half_height - _INSIDE
    return inside


def _in_order(
    q0: FloatArray, poses: FloatArray, transitions: TransitionPlanner
) -> list[FloatArray]:
    """Returns the poses in the order that takes least time straight from `q0`."""
    # To compare, rates will do.
    limits = transitions.limits.replace(torques=None, nozzle=None)
    stops = [q0, *poses]
    times = [[rest_to_rest(a, b, limits).duration for b in stops] for a in stops]

    def time(order: tuple[int, ...]) -> float:
        return sum(times[a][b] for a, b in itertools.pairwise((0, *order)))

    best = min(itertools.permutations(range(1, len(stops))), key=time)
    return [stops[index] for index in best]
