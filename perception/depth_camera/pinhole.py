"""Depth pictures of one pinhole camera as another at the same place sees them."""

import numpy as np
import numpy.typing as npt

from perception.depth_camera.depth import CameraIntrinsics

# Cameras that differ by less in every number, px, count as the same.
_SAME = 0.01


class PinholeMap:
    """Maps pictures from the camera that took them to the one that a job is set for.

    Both have the same centre and axes, so depth along z stays what it is and only the
    pixels move: each takes the nearest pixel of the same ray. Pixels whose ray the
    first camera does not see get 0.
    """

    def __init__(self, taken: CameraIntrinsics, wanted: CameraIntrinsics) -> None:
        """Prepares the map.

        Args:
            taken: Camera whose pictures are mapped.
            wanted: Camera whose pictures are made.
        """
        names = ("fx", "fy", "cx", "cy", "width", "height")
        off = [abs(getattr(taken, name) - getattr(wanted, name)) for name in names]
        self.is_identity = max(off) <= _SAME
        row, column = np.indices((wanted.height, wanted.width))
        p_CQs = wanted.backproject(column, row, np.ones(row.shape))
        column, row = np.rint(taken.project(p_CQs)).astype(np.int64)
        self._seen = (row >= 0) & (row < taken.height)
        self._seen &= (column >= 0) & (column < taken.width)
        self._index = row.clip(0, taken.height - 1), column.clip(0, taken.width - 1)

    def apply(self, picture: npt.NDArray[np.uint16]) -> npt.NDArray[np.uint16]:
        """Returns (H, W) uint16 of the wanted camera for one of the taking one."""
        if self.is_identity:
            return picture
        return np.where(self._seen, picture[self._index], np.uint16(0))
