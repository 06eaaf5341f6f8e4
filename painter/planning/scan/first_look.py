"""First look at the wall, from which its plane is found."""

import numpy as np

from painter.errors import ReachError
from painter.planning.config import ScanConfig, TileConfig
from painter.planning.motion.joint_motion import Segment, move_times
from painter.planning.scan.camera_poses import CameraPoses
from perception.ground import FloatArray

_SPREAD = 0.1  # m, of the camera centres tried around the middle of a quarter,
_TICKS = 5  # and how many in either direction.


def look_segments(
    q0: FloatArray, tile: TileConfig, scan: ScanConfig, poses: CameraPoses
) -> list[Segment]:
    """Plans the first look: from rest at `q0` (5,), rad, over two quarters of the tile.

    One look at the middle would do for a bare wall, but not where a window is. Two
    diagonal quarters give the wall's tilt about both axes. In each quarter the pose is
    chosen that makes the motion quickest; pictures are taken on the way as well.

    Raises:
        ReachError: The camera reaches no pose before a quarter.
        CollisionError: There is no clear route.
    """
    # Ends at the upper left, where the scan begins.
    lower, upper = (
        look_poses(np.array([x * tile.width, y * tile.height]), scan, poses)
        for x, y in ((0.75, 0.25), (0.25, 0.75))
    )
    transitions = poses.transitions
    total = move_times(q0[None], lower, transitions.limits).T
    total = total + move_times(lower, upper, transitions.limits)
    first, second = np.unravel_index(int(np.argmin(total)), total.shape)
    return [
        *transitions.free_motion(q0, lower[first]),
        *transitions.free_motion(lower[first], upper[second]),
    ]


def look_poses(
    centre_T: FloatArray, scan: ScanConfig, poses: CameraPoses
) -> FloatArray:
    """Finds reachable and clear poses with the camera before a point of the wall.

    Straight before the shoulder the arm would have to fold flat.

    Args:
        centre_T: (2,) m, in T's x and y.
        scan: Settings; `look_distance` is kept.
        poses: Camera poses before the wall.

    Returns:
        (n, 5) rad, n >= 1, the camera within 0.1 m of the point in T's x and y.

    Raises:
        ReachError: There is no such pose.
    """
    ticks = _SPREAD * np.linspace(-1.0, 1.0, _TICKS)
    x, y = np.meshgrid(centre_T[0] + ticks, centre_T[1] + ticks)
    p_TCs = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, scan.look_distance)])
    good = poses.reachable_and_clear(p_TCs)
    if not good.any():
        raise ReachError(
            f"look: no clear pose with the camera {scan.look_distance:.2f} m before "
            f"the wall within {_SPREAD} m of T ({centre_T[0]:.2f}, "
            f"{centre_T[1]:.2f}) m: change scan.look_distance.",
            code="PNT-SCAN-002",
        )
    return poses.q(p_TCs[good])
