"""Whether the arm reaches given nozzle positions, and if not, by how much."""

import math

import numpy as np

from painter.errors import ReachError
from painter.planning.arm.kinematics import JOINT_NAMES, SQUARE_R_TL, ArmLimits
from painter.planning.motion.gun_path import WallIk
from perception.ground import FloatArray

_REACH_STEP = 0.05  # m, between the points at which reach is sampled ...
_STANDOFF_STEP = 0.015  # m, ... and between the stand-offs.


def tile_points(width: float, height: float, standoff: float) -> FloatArray:
    """Returns nozzle positions all over a tile and its edges, 10 cm apart.

    Args:
        width: Of the tile, m.
        height: Of the tile, m.
        standoff: Nozzle to wall, m.

    Returns:
        (n, 3) m, in T.
    """
    x = np.linspace(0.0, width, max(2, round(width / 0.1) + 1))
    y = np.linspace(0.0, height, max(2, round(height / 0.1) + 1))
    xs, ys = np.meshgrid(x, y)
    return np.stack([xs.ravel(), ys.ravel(), np.full(xs.size, standoff)], axis=-1)


def nearest_standoffs(
    x: FloatArray,
    y: FloatArray,
    *,
    ik: WallIk,
    limits: ArmLimits,
    near: float,
    far: float,
    stopping: float,
) -> FloatArray:
    """Returns the least stand-offs from which strokes along T y can be sprayed.

    The nearer the nozzle, the farther the arm has to stretch to a tile's corners. A
    stroke may end anywhere, so the arm must also reach the overtravel beyond.

    Args:
        x: (nx,) m in T, ascending.
        y: (ny,) m in T, ascending.
        ik: Inverse kinematics.
        limits: Of the joints.
        near: Least stand-off to consider, m.
        far: Stand-off of the raster, m; its reach is checked elsewhere.
        stopping: Distance in which the gun stops beyond a stroke's end, m.

    Returns:
        (ny, nx) m, `near` to `far`.
    """
    columns, rows = (_spread(axis, _REACH_STEP) for axis in (x, y))
    standoffs = np.linspace(near, far, max(2, round((far - near) / _STANDOFF_STEP) + 1))
    # Reach ends away from the middle.
    beyond = rows + stopping * np.sign(rows - rows.mean())
    places = np.meshgrid(standoffs, beyond, columns, indexing="ij")
    p_TGs = np.stack([place.ravel() for place in places[::-1]], axis=-1)
    reached = limits.contains(ik.inverse_kinematics(p_TGs)).reshape(places[0].shape)
    # The first stand-off beyond the last one out of reach.
    first = np.where(reached, 0, np.arange(1, standoffs.size + 1)[:, None, None])
    coarse = standoffs[np.minimum(first.max(axis=0), standoffs.size - 1)]
    by_row = np.array([np.interp(x, columns, row) for row in coarse])
    return np.stack([np.interp(y, rows, column) for column in by_row.T], axis=1)


def _spread(axis: FloatArray, step: float) -> FloatArray:
    """Returns evenly spaced points from one end of an axis to the other."""
    count = max(2, math.ceil((axis[-1] - axis[0]) / step) + 1)
    return np.linspace(axis[0], axis[-1], count)


def require_reach(
    p_TGs: FloatArray, *, ik: WallIk, limits: ArmLimits, what: str
) -> FloatArray:
    """Solves for joint angles and raises if a point is out of reach.

    Args:
        p_TGs: (n, 3) m, nozzle positions in T.
        ik: Inverse kinematics.
        limits: Of the joints.
        what: Name of the points, for messages.

    Returns:
        (n, 5) rad.

    Raises:
        ReachError: Names the share out of reach, the worst point and its figures.
    """
    q = ik.inverse_kinematics(p_TGs)
    bad = ~limits.contains(q)
    if not bad.any():
        return q
    arm = ik.kinematics
    needed = np.where(bad, wrist_distances(p_TGs, ik), -np.inf)
    worst = int(np.argmax(needed))
    longest, shortest = arm.upper_arm + arm.forearm, abs(arm.upper_arm - arm.forearm)
    if needed[worst] <= longest:
        worst = int(np.argmax(bad))
    stretch = f"needs {needed[worst]:.2f} m from shoulder to wrist"
    excess = np.maximum(limits.q_min - q[worst], q[worst] - limits.q_max)
    joint = int(np.argmax(excess))
    if needed[worst] > longest:
        reason = f"{stretch}, the arm has {longest:.2f} m"
    elif np.isnan(q[worst]).any():
        reason = f"{stretch}, the arm cannot fold below {shortest:.2f} m"
    else:
        reason = (
            f"needs {JOINT_NAMES[joint]} at {q[worst, joint]:.2f} rad, its range is "
            f"{limits.q_min[joint]:.2f} to {limits.q_max[joint]:.2f} rad"
        )
    x, y, z = p_TGs[worst]
    raise ReachError(
        f"{what}: {100 * bad.mean():.0f} % is out of reach; T ({x:.2f}, {y:.2f}) m, "
        f"{z:.2f} m before the wall, {reason}.",
        code="PNT-REACH-002",
    )


def wrist_distances(p_TGs: FloatArray, ik: WallIk) -> FloatArray:
    """Returns the shoulder-to-wrist distance (n,), m, that nozzle points (n, 3) need.

    The gun is square to the wall.
    """
    p_TLs = p_TGs - SQUARE_R_TL @ ik.kinematics.X_LG.translation()
    p_WLs = (ik.X_WT @ p_TLs.T).T
    p_WS = np.array([0.0, 0.0, ik.kinematics.shoulder_height])
    return np.asarray(np.linalg.norm(p_WLs - p_WS, axis=1))
