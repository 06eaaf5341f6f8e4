"""Recorded depth images: one, or several of a static scene."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image

from perception.depth_camera.depth import CameraIntrinsics
from perception.errors import CloudReadError
from perception.ground import FloatArray
from perception.io.camera_file import read_camera
from perception.io.clouds import check_file, checked_points

DEPTH_SUFFIX = ".png"
MAX_FRAMES = 60  # More do not improve the median: its remaining error is bias.
_MAX_PIXELS = 50_000_000
_DepthImage = npt.NDArray[np.uint16]


def read_depth(path: Path, intrinsics_path: Path) -> FloatArray:
    """Reads a depth image as a cloud; see `read_depth_frames`."""
    return read_depth_frames([path], intrinsics_path)


def read_depth_frames(paths: Sequence[Path], intrinsics_path: Path) -> FloatArray:
    """Reads depth images by a static camera of a static scene as one cloud.

    Args:
        paths: 16-bit PNGs, 0 = no measurement; of more than `MAX_FRAMES` as many are
            taken, evenly.
        intrinsics_path: The camera's file; see `read_camera`. Without a depth scale
            the images are in mm.

    Returns:
        p_CQs (3, N) m, in C (x right, y down, z ahead), from each pixel's median;
        pixels measured in fewer than half of the images are left out.

    Raises:
        CloudReadError: A file is missing or unusable, or sizes disagree; names the
            file, the field, the value and the bound.
    """
    camera = read_camera(intrinsics_path)
    frames = [
        _read_image(path, camera.intrinsics, intrinsics_path) for path in evenly(paths)
    ]
    return checked_points(paths[0], camera.points(median_depth(frames)))


def evenly(items: Sequence[Path]) -> list[Path]:
    """Returns at most `MAX_FRAMES` of the items, evenly spread."""
    picked = np.linspace(0, len(items) - 1, min(len(items), MAX_FRAMES))
    return [items[int(number)] for number in picked.round()]


def median_depth(frames: Sequence[_DepthImage]) -> npt.NDArray[Any]:
    """Fuses depth images of a static scene.

    Args:
        frames: (H, W) each, 0 = no measurement.

    Returns:
        (H, W) the median of each pixel's measurements; 0 where there are fewer than
        half as many as images.
    """
    if len(frames) == 1:
        return frames[0]
    stack = np.sort(np.stack(frames), axis=0)
    missing = np.count_nonzero(stack == 0, axis=0)
    seen = len(frames) - missing
    low, high = missing + (seen - 1) // 2, missing + seen // 2
    last = len(frames) - 1
    middle = [
        np.take_along_axis(stack, np.clip(index, 0, last)[None], axis=0)[0]
        for index in (low, high)
    ]
    median = (middle[0].astype(np.float64) + middle[1]) / 2.0
    return np.where(2 * seen >= len(frames), median, 0.0)


def _read_image(path: Path, camera: CameraIntrinsics, camera_path: Path) -> _DepthImage:
    check_file(path)
    try:
        with Image.open(path, formats=("PNG",)) as image:
            width, height = image.size
            if (width, height) != (camera.width, camera.height):
                raise CloudReadError(
                    f"{path}: the image is {width} x {height} px, {camera_path} is for "
                    f"{camera.width} x {camera.height} px.",
                    code="PNT-FRAMES-009",
                )
            if width * height > _MAX_PIXELS:
                raise CloudReadError(
                    f"{path}: more than {_MAX_PIXELS} px.", code="PNT-FRAMES-010"
                )
            mode, depth = image.mode, np.asarray(image)
    # Pillow raises many kinds of errors for damaged files.
    except (
        OSError,
        SyntaxError,
        ValueError,
        OverflowError,
        IndexError,
        TypeError,
        EOFError,
        Image.DecompressionBombError,
    ) as error:
        raise CloudReadError(
            f"{path}: cannot read the image: {error}.", code="PNT-FRAMES-011"
        ) from error
    if depth.ndim != 2 or depth.dtype.itemsize < 2 or depth.dtype.kind not in "iu":
        raise CloudReadError(
            f"{path}: expected 16-bit grey depth, got mode {mode!r}.",
            code="PNT-FRAMES-012",
        )
    return depth.astype(np.uint16)
