"""Pictures of a depth camera, and where they come from when it is not a device."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from painter.errors import PainterError

DepthArray = npt.NDArray[np.uint16]
ColorArray = npt.NDArray[np.uint8]


class CameraError(PainterError):
    """The camera is not there, was unplugged, or does not do what it should."""


@dataclass(frozen=True, eq=False)
class CameraFrame:
    """One picture as the camera's driver gives it.

    Attributes:
        depth_mm: (H, W) uint16, mm along C's z, 0 = no return.
        color: (H, W, 3) uint8, RGB; None where there is none.
        time: When it was taken, by the camera's own clock, s.
        number: The driver's count of pictures.
    """

    depth_mm: DepthArray
    color: ColorArray | None
    time: float
    number: int


class FrameSource(Protocol):
    """Rendered or recorded pictures, which stand for a device's imagers."""

    def wait_frame(
        self, timeout: float
    ) -> tuple[DepthArray, ColorArray | None, float] | None:
        """Returns the next picture: depth (H, W) mm, colour (H, W, 3) RGB, time, s.

        Args:
            timeout: How long to wait for it, s.

        Returns:
            The picture, or None if none came in time.

        Raises:
            CameraError: The source is gone, as a device that was unplugged.
        """


class Camera(Protocol):
    """An open camera, for one thread."""

    def wait(self, timeout: float) -> CameraFrame | None:
        """Returns the next picture; None if none came within `timeout` s.

        Raises:
            CameraError: The camera is gone.
        """

    def close(self) -> None:
        """Lets the camera go."""
