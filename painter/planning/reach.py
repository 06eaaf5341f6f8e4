"""Whether the arm reaches what it is asked for, and if not, by how much."""

import numpy as np

from painter.errors import ReachError
from painter.planning.gun_path import SquareGun
from painter.planning.kinematics import ArmLimits
from perception.values import FloatArray

_JOINTS = ("base yaw", "shoulder pitch", "elbow pitch", "wrist pitch", "wrist yaw")


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


def require_reach(
    p_TGs: FloatArray, *, gun: SquareGun, limits: ArmLimits, what: str
) -> FloatArray:
    """Solves for joint angles and raises if a point is out of reach.

    Args:
        p_TGs: (n, 3) m, nozzle positions in T.
        gun: Inverse kinematics.
        limits: Of the joints.
        what: What the points belong to, for the message.

    Returns:
        (n, 5) rad.

    Raises:
        ReachError: Tells which share is out of reach, the worst point and its figures.
    """
    q = gun.solve(p_TGs)
    bad = ~limits.contains(q)
    if not bad.any():
        return q
    arm = gun.kinematics
    needed = wrist_distances(p_TGs, gun)
    longest = arm.upper_arm + arm.forearm
    share = f"{what}: {100 * bad.mean():.0f} % of it is out of reach"
    worst = int(np.argmax(np.where(bad, needed, -np.inf)))
    x, y, z = p_TGs[worst]
    place = f"T ({x:.2f}, {y:.2f}) m, {z:.2f} m before the wall"
    if needed[worst] > longest:
        raise ReachError(
            f"{share}; {place}, needs {needed[worst]:.2f} m from shoulder to wrist, "
            f"the arm has {longest:.2f} m."
        )
    worst = int(np.flatnonzero(bad)[0])
    x, y, z = p_TGs[worst]
    place = f"T ({x:.2f}, {y:.2f}) m, {z:.2f} m before the wall"
    if np.isnan(q[worst]).any():
        raise ReachError(
            f"{share}; {place}, needs {needed[worst]:.2f} m from shoulder to wrist, "
            f"the arm cannot fold below {abs(arm.upper_arm - arm.forearm):.2f} m."
        )
    excess = np.maximum(limits.q_min - q[worst], q[worst] - limits.q_max)
    joint = int(np.argmax(excess))
    raise ReachError(
        f"{share}; {place}, needs {_JOINTS[joint]} at {q[worst, joint]:.2f} rad, its "
        f"range is {limits.q_min[joint]:.2f} to {limits.q_max[joint]:.2f} rad."
    )


def wrist_distances(p_TGs: FloatArray, gun: SquareGun) -> FloatArray:
    """Returns the shoulder-to-wrist distance (n,), m, that nozzle points (n, 3) need.

    With the gun square to the wall L's axes in T are x = -z, y = -x, z = y.
    """
    ahead, left, above = gun.kinematics.X_LG.translation()
    p_TLs = p_TGs - np.array([-left, above, -ahead])
    p_WLs = (gun.X_WT @ p_TLs.T).T
    p_WS = np.array([0.0, 0.0, gun.kinematics.shoulder_height])
    return np.asarray(np.linalg.norm(p_WLs - p_WS, axis=1))
