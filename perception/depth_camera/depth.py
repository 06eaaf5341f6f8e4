"""Depth images: pinhole intrinsics, the pixels that can be used, and their points."""

import math
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from perception.config import MapConfig, StereoConfig
from perception.depth_camera.windows import moving_max, moving_min
from perception.ground import BoolArray, FloatArray

Pixels = npt.NDArray[Any]


@dataclass(frozen=True)
class CameraIntrinsics:
    """Pinhole camera; pixel (0, 0) is the centre of the upper left one.

    Attributes:
        fx: Focal length along the rows, px.
        fy: Focal length along the columns, px.
        cx: Column of the principal point, px.
        cy: Row of the principal point, px.
        width: Width of the picture, px.
        height: Height of the picture, px.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    width: int
    height: int

    @classmethod
    def from_stereo(cls, config: StereoConfig) -> Self:
        """Makes the intrinsics of a stereo camera without distortion.

        Source: Intel, "Subpixel linearity improvement for RealSense depth cameras":
        f = (W / 2) / tan(HFOV / 2), the axis through the middle of the picture.
        """
        focal = config.width / 2 / math.tan(math.radians(config.hfov_deg) / 2)
        cx, cy = config.width / 2 - 0.5, config.height / 2 - 0.5
        return cls(focal, focal, cx, cy, config.width, config.height)

    @classmethod
    def from_librealsense(cls, lens: Any) -> Self:
        """Takes over the intrinsics of a rectified stream.

        Args:
            lens: librealsense's `intrinsics`.

        Raises:
            ValueError: The stream is distorted.
        """
        if any(lens.coeffs):
            raise ValueError(
                f"the depth stream is distorted ({lens.model}), not rectified"
            )
        return cls(lens.fx, lens.fy, lens.ppx, lens.ppy, lens.width, lens.height)

    @property
    def matrix(self) -> FloatArray:
        """The (3, 3) camera matrix, px, as OpenCV takes it."""
        return np.array([[self.fx, 0, self.cx], [0, self.fy, self.cy], [0, 0, 1]])

    def rays(self, column: Pixels, row: Pixels) -> tuple[Pixels, Pixels]:
        """Returns where the rays of pixels meet the plane z = 1 of C.

        Args:
            column: Any shape, px; fractions are allowed.
            row: Any shape, px.

        Returns:
            x and y, without unit, of the shapes given.
        """
        return (column - self.cx) / self.fx, (row - self.cy) / self.fy

    def backproject(self, column: Pixels, row: Pixels, z: Pixels) -> FloatArray:
        """Returns the points that pixels show.

        Args:
            column: Any shape, px; fractions are allowed.
            row: The same, or a shape that goes together with it.
            z: Depth along C's z, m; of the shape that the two give together.

        Returns:
            (3, ...) m, in C (x right, y down, z ahead).
        """
        x, y = self.rays(column, row)
        return np.stack([x * z, y * z, z])

    def project(self, p_CQs: FloatArray) -> FloatArray:
        """Returns the pixels that show points.

        Args:
            p_CQs: (3, N) m, in C, none with z = 0.

        Returns:
            (2, N) column and row, px, with fractions; may lie outside the picture.
        """
        x, y, z = p_CQs
        return np.stack([self.fx * x / z + self.cx, self.fy * y / z + self.cy])


def usable_pixels(depth_mm: npt.NDArray[np.uint16], config: MapConfig) -> BoolArray:
    """Finds the pixels whose depth can be trusted.

    A block matcher grows the near side of a depth edge by half its window and puts
    flying pixels between the two sides. So near pixels within half of
    `config.edge_window` of farther ones are dropped, and far pixels next to a nearer
    one. A single farther pixel is a flying pixel itself and makes no edge. Pixels
    without depth take the depth on their left: the occlusion that hides them from the
    right imager begins at the far side, which is on the left.

    Args:
        depth_mm: (H, W) uint16, mm, 0 = no return.
        config: `min_range`, `max_range`, `edge_jump`, `edge_step` and `edge_window` are
            used.

    Returns:
        (H, W) bool.
    """
    seen = depth_mm > 0
    column = np.where(seen, np.arange(depth_mm.shape[1], dtype=np.int32), 0)
    column = np.maximum.accumulate(column, axis=1)
    depth = np.take_along_axis(depth_mm, column, axis=1).astype(np.float32)
    # `edge_step` is in 1/m, depth in mm.
    step = np.float32(config.edge_step / 1000)
    jump = np.minimum(np.float32(config.edge_jump) * depth, step * depth**2)
    # The minimum has eroded far areas by a pixel along their edges; undo that.
    far = moving_max(moving_min(depth, 3), config.edge_window + 2)
    usable: BoolArray = seen & (far - depth <= jump)
    usable &= depth - moving_min(depth, 3) <= jump
    usable &= (depth >= 1000 * config.min_range) & (depth <= 1000 * config.max_range)
    return usable


def depth_points(
    depth_mm: npt.NDArray[np.uint16],
    usable: BoolArray,
    intrinsics: CameraIntrinsics,
    stride: int = 1,
) -> FloatArray:
    """Returns the points of a depth image.

    Args:
        depth_mm: (H, W) uint16, mm, along C's z.
        usable: (H, W) bool, the pixels to take.
        intrinsics: Of the camera.
        stride: Takes every `stride`-th column and row.

    Returns:
        (3, N) float64, m, in C (x right, y down, z ahead), row by row.

    Raises:
        ValueError: The image does not have the camera's size.
    """
    expected = (intrinsics.height, intrinsics.width)
    if depth_mm.shape != expected or usable.shape != expected:
        raise ValueError(
            f"depth_mm and usable must be {expected} (H, W), "
            f"got {depth_mm.shape} and {usable.shape}."
        )
    row, column = np.nonzero(usable[::stride, ::stride])
    row, column = stride * row, stride * column
    return intrinsics.backproject(column, row, depth_mm[row, column] / 1000.0)
