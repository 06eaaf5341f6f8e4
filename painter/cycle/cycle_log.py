"""The log of one paint cycle, on either body."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from painter.planning.arm.kinematics import ArmKinematics
from painter.planning.spray_path import PaintProgram
from painter.run.folder.values import Executed
from painter.systems.simulated.paint_film import FilmState
from painter.systems.values import CycleStatus
from perception.ground import FloatArray
from perception.values import SurfaceMap, WallSegmentation


@dataclass(frozen=True, eq=False)
class CycleLog(Executed):
    """The log of a cycle; results that it did not reach are None.

    On the robot X_WG is measured; in simulation it is the true pose.

    Attributes:
        status: The cycle's last status, with all events.
        end_time: Robot time at which the simulation stopped, s.
        clearance_time: (k,) s; empty where clearances are unknown.
        clearance: (k,) m, least distance of the robot from the scene.
        floor_clearance: (k,) m, the same from the floor and the robot's own frame.
        surface_map: The fused map.
        segmentation: The wall's segmentation, or None.
        program: The paint program, or None.
        film: The paint film at the end; None where it is unknown.
        look_image: (H, W, 4) uint8, first colour picture of the wall, or None.
    """

    status: CycleStatus
    end_time: float
    clearance_time: FloatArray
    clearance: FloatArray
    floor_clearance: FloatArray
    surface_map: SurfaceMap
    segmentation: WallSegmentation | None
    program: PaintProgram | None
    film: FilmState | None
    look_image: npt.NDArray[np.uint8] | None


def GunPoses(kinematics: ArmKinematics, q: FloatArray) -> FloatArray:
    """Returns (n, 4, 4) nozzle poses in W of joint positions (n, 5), rad."""
    R_WG, p_WG = kinematics.gun_poses(q)
    poses = np.tile(np.eye(4), (len(q), 1, 1))
    poses[:, :3, :3] = R_WG
    poses[:, :3, 3] = p_WG
    return poses


def clearance_violations(
    time: FloatArray, clearance: FloatArray, bound: float
) -> list[tuple[float, float]]:
    """Finds the episodes in which the robot came too close to something.

    Args:
        time: (k,) s.
        clearance: (k,) m.
        bound: Least distance allowed, m.

    Returns:
        (time of the least distance, that distance) of each unbroken episode below the
        bound, in order.
    """
    below = np.concatenate([[False], clearance < bound, [False]])
    starts = np.flatnonzero(below[1:] & ~below[:-1])
    ends = np.flatnonzero(~below[1:] & below[:-1])
    worst = [
        start + int(np.argmin(clearance[start:end]))
        for start, end in zip(starts, ends, strict=True)
    ]
    return [(float(time[index]), float(clearance[index])) for index in worst]
