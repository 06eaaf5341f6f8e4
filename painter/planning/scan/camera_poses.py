"""Poses of the arm with the camera square before the wall."""

from dataclasses import dataclass

import numpy as np

from painter.planning.arm.kinematics import SQUARE_R_TL
from painter.planning.arm.scan_camera import ScanCamera
from painter.planning.motion.transitions import TransitionPlanner
from perception.ground import BoolArray, FloatArray


@dataclass(frozen=True, eq=False)
class CameraPoses:
    """Inverse kinematics and clearance of camera centres before one wall.

    Attributes:
        camera: On the tool.
        transitions: Reach and clearance.
    """

    camera: ScanCamera
    transitions: TransitionPlanner

    def nozzles(self, p_TCs: FloatArray) -> FloatArray:
        """Returns nozzle positions (n, 3) for camera centres (n, 3), m, in T."""
        arm = self.transitions.ik.kinematics
        p_CG_L = arm.X_LG.translation() - arm.X_LC.translation()
        return np.asarray(p_TCs + SQUARE_R_TL @ p_CG_L)

    def q(self, p_TCs: FloatArray) -> FloatArray:
        """Returns joint angles (n, 5), rad, for camera centres (n, 3), m, in T."""
        return self.transitions.ik.inverse_kinematics(self.nozzles(p_TCs))

    def reachable_and_clear(self, p_TCs: FloatArray) -> BoolArray:
        """Tells at which camera centres (n, 3), m, in T, the arm keeps clear."""
        q = self.q(p_TCs)
        good = self.transitions.limits.contains(q)
        good[good] = self.transitions.space.free(q[good])
        return np.asarray(good)
