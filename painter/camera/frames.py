"""Pictures of a depth camera, and sources that replace the device."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from painter.errors import PainterError

DepthArray = npt.NDArray[np.uint16]
ColorArray = npt.NDArray[np.uint8]


class CameraError(PainterError):
    """The camera is missing, was unplugged, or does not work as configured."""


@dataclass(frozen=True, eq=False)
class CameraFrame:
    """One picture from the driver of the camera.

    Attributes:
        depth_mm: (H, W) uint16, mm along C's z, 0 = no return.
        color: (H, W, 3) uint8, RGB; None without colour.
        time: When it was taken, by the camera's own clock, s.
        number: The driver's count of pictures.
    """

    depth_mm: DepthArray
    color: ColorArray | None
    time: float
    number: int


class FrameSource(Protocol):
    """Rendered or recorded pictures in place of the imagers of a device."""

    def wait_frame(
        self, timeout: float
    ) -> tuple[DepthArray, ColorArray | None, float] | None:
        """Returns the next picture: depth (H, W) mm, colour (H, W, 3) RGB, time, s.

        Args:
            timeout: How long to wait for it, s.

        Returns:
            The picture, or None if none came in time.

        Raises:
            CameraError: The source is lost, like an unplugged device.
        """


class Camera(Protocol):
    """An open camera, for one thread."""

    def wait(self, timeout: float) -> CameraFrame | None:
        """Returns the next picture; None if none came within `timeout` s.

        Raises:
            CameraError: The camera is lost.
        """

    def close(self) -> None:
        """Releases the camera."""
