"""Largest and smallest value in a window that moves over a picture."""

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

Image = npt.NDArray[Any]


def moving_max(image: Image, size: int) -> Image:
    """Returns the largest value in the size x size window round each pixel.

    Args:
        image: (H, W) of any number type.
        size: Edge of the window, px, odd; at the border it is cut off.

    Returns:
        (H, W) of the same type.

    Raises:
        ValueError: `size` is not a positive odd number.
    """
    return _moving(np.maximum, image, size)


def moving_min(image: Image, size: int) -> Image:
    """Returns the smallest value in the window; see `moving_max`."""
    return _moving(np.minimum, image, size)


def _moving(pick: Callable[[Image, Image], Image], image: Image, size: int) -> Image:
    if size < 1 or size % 2 == 0:
        raise ValueError(f"size must be odd and >= 1 px, got {size!r}.")
    for _ in range(2):  # Down the columns, then, transposed, along the rows.
        image = _moving_down(pick, image, size).T
    return image


def _moving_down(
    pick: Callable[[Image, Image], Image], image: Image, size: int
) -> Image:
    """Doubles the window: three passes for 7 px, many times faster than SciPy's."""
    half = size // 2
    rows = np.pad(image, ((half, half), (0, 0)), mode="edge")
    reach = 1
    while reach < size:
        step = min(reach, size - reach)
        rows = pick(rows[:-step], rows[step:])
        reach += step
    return rows
