"""Largest and smallest value in a window that moves over a picture."""

from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

Image = npt.NDArray[Any]


def moving_max(image: Image, size: int) -> Image:
    """Returns the largest value in the size x size window round each pixel.

    Args:
        image: (H, W) of any number type, without NaN.
        size: Edge of the window, px, odd; at the border it is cut off.

    Returns:
        (H, W) of the same type.

    Raises:
        ValueError: `size` is not a positive odd number.
    """
    return _moving(cv2.dilate, image, size)


def moving_min(image: Image, size: int) -> Image:
    """Returns the smallest value in the window; see `moving_max`."""
    return _moving(cv2.erode, image, size)


def _moving(pick: Callable[[Image, Image], Any], image: Image, size: int) -> Image:
    if size < 1 or size % 2 == 0:
        raise ValueError(f"size must be odd and >= 1 px, got {size!r}.")
    # OpenCV knows no 64-bit integers; float64 holds them exactly up to 2^53.
    known = image.astype(np.float64) if image.dtype == np.int64 else image
    return np.asarray(pick(known, np.ones((size, size), np.uint8)), image.dtype)
