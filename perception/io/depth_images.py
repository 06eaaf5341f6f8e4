"""Recorded depth images of one camera, alone or several of a scene at rest."""

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image

from perception.errors import CloudReadError
from perception.ground import FloatArray
from perception.io.clouds import check_file, checked_points

DEPTH_SUFFIX = ".png"
INTRINSICS_NAME = "intrinsics.json"
MAX_FRAMES = 60  # The median of more is no better: what is left of its error is bias.
_MAX_PIXELS = 50_000_000
_UNDISTORT_ROUNDS = 20
_DepthImage = npt.NDArray[np.uint16]


@dataclass(frozen=True)
class DepthCamera:
    """A pinhole depth camera; pixel (0, 0) is the centre of the upper left one.

    Attributes:
        width: px.
        height: px.
        fx: Focal length along the rows, px.
        fy: Focal length along the columns, px.
        cx: Column of the principal point, px.
        cy: Row of the principal point, px.
        depth_scale_m_per_unit: Of the image's numbers.
        distortion_k1k2p1p2k3: Brown and Conrady's coefficients, taken off.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    depth_scale_m_per_unit: float = 0.001
    distortion_k1k2p1p2k3: tuple[float, ...] = (0.0,) * 5

    def points(self, depth: npt.NDArray[Any]) -> FloatArray:
        """Returns the points of an image.

        Args:
            depth: (H, W), 0 = no measurement.

        Returns:
            p_CQs (3, N) m, in C (x right, y down, z ahead), row by row.
        """
        rows, columns = np.nonzero(depth)
        with np.errstate(over="ignore", invalid="ignore"):  # Non-finite: no point.
            z = depth[rows, columns] * self.depth_scale_m_per_unit
            x: FloatArray = (columns - self.cx) / np.float64(self.fx)
            y: FloatArray = (rows - self.cy) / np.float64(self.fy)
            x, y = _undistorted(x, y, self.distortion_k1k2p1p2k3)
            return np.stack([x * z, y * z, z])


def read_depth(path: Path, intrinsics_path: Path) -> FloatArray:
    """Reads a depth image as a cloud; see `read_depth_frames`."""
    return read_depth_frames([path], intrinsics_path)


def read_depth_frames(paths: Sequence[Path], intrinsics_path: Path) -> FloatArray:
    """Reads depth images of a camera and a scene at rest as one cloud.

    The intrinsics are a JSON object with `width`, `height`, `fx`, `fy`, `cx`, `cy` in
    px, optionally `depth_scale_m_per_unit` (default 0.001) and `distortion_k1k2p1p2k3`,
    five coefficients of Brown and Conrady, which are taken off.

    Source: Brown, "Close-range camera calibration", 1971.

    Args:
        paths: 16-bit PNGs, 0 = no measurement; of more than `MAX_FRAMES` as many are
            taken, evenly.
        intrinsics_path: The JSON file.

    Returns:
        p_CQs (3, N) m, in C (x right, y down, z ahead), from each pixel's median;
        pixels measured in fewer than half of the images are left out.

    Raises:
        CloudReadError: A file is missing or unusable, or sizes disagree; names the
            file, the field, the value and the bound.
    """
    camera = read_intrinsics(intrinsics_path)
    frames = [_read_image(path, camera, intrinsics_path) for path in evenly(paths)]
    return checked_points(paths[0], camera.points(median_depth(frames)))


def evenly(items: Sequence[Path]) -> list[Path]:
    """Returns at most `MAX_FRAMES` of the items, evenly spread."""
    picked = np.linspace(0, len(items) - 1, min(len(items), MAX_FRAMES))
    return [items[int(number)] for number in picked.round()]


def median_depth(frames: Sequence[_DepthImage]) -> npt.NDArray[Any]:
    """Fuses depth images of a scene at rest.

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


def read_intrinsics(path: Path) -> DepthCamera:
    """Reads a camera's JSON file; see `read_depth_frames`.

    Args:
        path: The file.

    Returns:
        The camera.

    Raises:
        CloudReadError: The file is missing or no such JSON; names the field.
    """
    check_file(path)
    try:
        camera: Any = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise CloudReadError(
            f"{path}: not JSON: {error}", code="PNT-FRAMES-004"
        ) from error
    if not isinstance(camera, dict):
        raise CloudReadError(f"{path}: expected a JSON object.", code="PNT-FRAMES-005")
    camera = {"depth_scale_m_per_unit": 0.001} | camera
    positive = ("width", "height", "fx", "fy", "depth_scale_m_per_unit")
    values = {}
    for name in (*positive, "cx", "cy"):
        value = camera.get(name)
        if not _is_number(value):
            raise CloudReadError(
                f"{path}: {name} must be a number, got {value!r:.60}.",
                code="PNT-FRAMES-006",
            )
        if name in positive and value <= 0:
            raise CloudReadError(
                f"{path}: {name} must be > 0, got {value!r}.", code="PNT-FRAMES-007"
            )
        values[name] = value
    coefficients: Any = camera.get("distortion_k1k2p1p2k3", [0.0] * 5)
    if (
        not isinstance(coefficients, list)
        or len(coefficients) != 5
        or not all(_is_number(value) for value in coefficients)
    ):
        raise CloudReadError(
            f"{path}: distortion_k1k2p1p2k3 must be 5 numbers, "
            f"got {coefficients!r:.60}.",
            code="PNT-FRAMES-008",
        )
    return DepthCamera(**values, distortion_k1k2p1p2k3=tuple(coefficients))


def _is_number(value: object) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return abs(value) < 1e300 and math.isfinite(value)


def _read_image(path: Path, camera: DepthCamera, camera_path: Path) -> _DepthImage:
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
                    f"{path}: over {_MAX_PIXELS} px.", code="PNT-FRAMES-010"
                )
            mode, depth = image.mode, np.asarray(image)
    # Pillow raises this and that for damaged files.
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
            f"{path}: cannot read the picture: {error}.", code="PNT-FRAMES-011"
        ) from error
    if depth.ndim != 2 or depth.dtype.itemsize < 2 or depth.dtype.kind not in "iu":
        raise CloudReadError(
            f"{path}: expected 16-bit grey depth, got mode {mode!r}.",
            code="PNT-FRAMES-012",
        )
    return depth.astype(np.uint16)


def _undistorted(
    x: FloatArray, y: FloatArray, coefficients: tuple[float, ...]
) -> tuple[FloatArray, FloatArray]:
    """Takes the lens distortion off normalised picture coordinates, by iteration."""
    k1, k2, p1, p2, k3 = coefficients
    if not any(coefficients):
        return x, y
    seen_x, seen_y = x, y
    for _ in range(_UNDISTORT_ROUNDS):
        r2 = x * x + y * y
        radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        x, y = (
            (seen_x - 2.0 * p1 * x * y - p2 * (r2 + 2.0 * x * x)) / radial,
            (seen_y - p1 * (r2 + 2.0 * y * y) - 2.0 * p2 * x * y) / radial,
        )
    return x, y
