"""The stereo camera on the tool, square to a wall, and what one picture shows of it."""

import math
from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform

from painter.errors import InputError
from painter.planning.arm.kinematics import SQUARE_R_TL
from perception.config import StereoConfig
from perception.depth_camera.depth import CameraIntrinsics
from perception.ground import FloatArray, FrozenValue


@dataclass(frozen=True, eq=False)
class Footprint(FrozenValue):
    """The upright rectangle of wall that one picture measures.

    Attributes:
        left: Extent from the camera centre to the left, along -T x, m.
        right: To the right, m.
        below: Downwards, along -T y, m.
        above: Upwards, m.
    """

    left: float
    right: float
    below: float
    above: float

    @property
    def width(self) -> float:
        """Width, m."""
        return self.left + self.right

    @property
    def height(self) -> float:
        """Height, m."""
        return self.below + self.above


@dataclass(frozen=True, eq=False)
class ScanCamera(FrozenValue):
    """A depth camera that looks square at a wall.

    Attributes:
        stereo: Its geometry.
        R_TC: (3, 3), axes of C in T: the roll of the mount about the optical axis.
        rate: Pictures a second.
    """

    stereo: StereoConfig
    R_TC: FloatArray
    rate: float

    @classmethod
    def mounted(
        cls, stereo: StereoConfig, X_LC: RigidTransform, *, rate: float = 5.0
    ) -> "ScanCamera":
        """Makes the camera from its pose in the last link, whose x is C z."""
        return cls(stereo, SQUARE_R_TL @ X_LC.rotation().matrix(), rate)

    @property
    def imagers_T(self) -> FloatArray:
        """Both imagers from the camera centre, (2, 3) m, in T."""
        return np.outer([0.0, self.stereo.baseline], self.R_TC[:, 0])

    def footprint(self, distance: float) -> Footprint:
        """Returns what a picture measures of the wall at a distance, m.

        A point that the right imager does not see has no match: a strip as wide as the
        baseline is blind on the left imager's left side. A camera that is rolled by
        other than a quarter turn loses the corners of its picture.

        Source: Intel, "D400 series data sheet", 337029, "invalid depth band".

        Raises:
            InputError: The blind strip or the roll leaves nothing of the picture.
        """
        camera = CameraIntrinsics.from_stereo(self.stereo)
        baseline = self.stereo.baseline
        width = distance * camera.width / camera.fx
        half_x = (width - baseline) / 2.0
        half_y = distance * camera.height / camera.fy / 2.0
        # C x lies along T x, or along T y in portrait.
        along, across = np.abs(self.R_TC[:2, 0]).tolist()
        if across > along:
            along, across, half_x, half_y = across, along, half_y, half_x
        # The upright rectangle whose corners touch the sides of the rolled one.
        upright_x = half_x * along - half_y * across
        upright_y = half_y * along - half_x * across
        if min(upright_x, upright_y) <= 0.0:
            roll_deg = math.degrees(math.atan2(across, along))
            raise InputError(
                f"camera: no upright part of a picture {width:.3f} m wide, at "
                f"{distance:.2f} m from the wall, has depth: "
                f"wall_camera.stereo.baseline blinds {baseline:g} m of it, and "
                f"camera_mount rolls it {roll_deg:.1f} deg off a quarter turn. Raise "
                "scan.distance, or mount the camera level or at 90 deg.",
                code="PNT-SCAN-003",
            )
        x, y = np.array([upright_x, upright_y]) / (along**2 - across**2)
        centre = baseline / 2.0 * self.R_TC[:2, 0]
        return Footprint(
            left=float(x - centre[0]),
            right=float(x + centre[0]),
            below=float(y - centre[1]),
            above=float(y + centre[1]),
        )
