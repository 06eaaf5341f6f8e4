"""The camera of recorded depth images: its JSON file and the points of its images."""

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from perception.depth_camera.depth import CameraIntrinsics
from perception.errors import CloudReadError
from perception.ground import FloatArray
from perception.io.clouds import check_file

CAMERA_FILE = "camera.json"
INTRINSICS_FILE = "intrinsics.json"
_UNDISTORT_ROUNDS = 20


@dataclass(frozen=True)
class RecordedCamera:
    """A depth camera as a file describes it.

    Attributes:
        intrinsics: The pinhole.
        depth_scale_m_per_unit: Length of one unit of the depth images, m; None = the
            file does not say.
        distortion_k1k2p1p2k3: Brown and Conrady's coefficients.
    """

    intrinsics: CameraIntrinsics
    depth_scale_m_per_unit: float | None = None
    distortion_k1k2p1p2k3: tuple[float, ...] = (0.0,) * 5

    def points(self, depth: npt.NDArray[Any]) -> FloatArray:
        """Returns the points of an image, with the distortion taken off.

        Args:
            depth: (H, W) in `depth_scale_m_per_unit` (mm if None), 0 = no measurement.

        Returns:
            p_CQs (3, N) m, in C (x right, y down, z ahead), row by row.
        """
        rows, columns = np.nonzero(depth)
        scale = self.depth_scale_m_per_unit
        with np.errstate(over="ignore", invalid="ignore"):  # Non-finite: no point.
            z = depth[rows, columns] * (0.001 if scale is None else scale)
            x, y = self.intrinsics.rays(columns, rows)
            x, y = _undistorted(x, y, self.distortion_k1k2p1p2k3)
            return np.stack([x * z, y * z, z])


def read_camera(path: Path) -> RecordedCamera:
    """Reads a camera.

    The file is a JSON object with `width`, `height`, `fx`, `fy`, `cx`, `cy` in px,
    optionally `depth_scale_m_per_unit` and `distortion_k1k2p1p2k3`, the five
    coefficients of Brown and Conrady.

    Source: Brown, "Close-range camera calibration", 1971.

    Args:
        path: The file.

    Raises:
        CloudReadError: The file is missing or describes no camera; names the field, the
            value and the bound.
    """
    check_file(path)
    try:
        fields: Any = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise CloudReadError(
            f"{path}: not JSON: {error}", code="PNT-FRAMES-004"
        ) from error
    if not isinstance(fields, dict):
        raise CloudReadError(f"{path}: expected a JSON object.", code="PNT-FRAMES-005")
    sizes = ("width", "height")
    lengths = ("fx", "fy", "cx", "cy")
    scales = [name for name in ("depth_scale_m_per_unit",) if name in fields]
    values: dict[str, float] = {}
    for name in (*sizes, *lengths, *scales):
        value: Any = fields.get(name)
        if not _is_number(value) or (name in sizes and value % 1):
            kind = "whole number" if name in sizes else "number"
            raise CloudReadError(
                f"{path}: {name} must be a {kind}, got {value!r:.60}.",
                code="PNT-FRAMES-006",
            )
        if name not in ("cx", "cy") and value <= 0:
            raise CloudReadError(
                f"{path}: {name} must be > 0, got {value!r}.", code="PNT-FRAMES-007"
            )
        values[name] = float(value)
    coefficients: Any = fields.get("distortion_k1k2p1p2k3", [0.0] * 5)
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
    width, height = (int(values[name]) for name in sizes)
    fx, fy, cx, cy = (values[name] for name in lengths)
    intrinsics = CameraIntrinsics(fx, fy, cx, cy, width, height)
    scale = values.get("depth_scale_m_per_unit")
    return RecordedCamera(intrinsics, scale, tuple(coefficients))


def write_camera(
    path: Path, intrinsics: CameraIntrinsics, scale: float | None = None
) -> None:
    """Writes a camera without distortion.

    Args:
        path: The file.
        intrinsics: The pinhole.
        scale: `depth_scale_m_per_unit`; left out if None.
    """
    names = ("width", "height", "fx", "fy", "cx", "cy")
    fields = {name: getattr(intrinsics, name) for name in names}
    if scale is not None:
        fields["depth_scale_m_per_unit"] = scale
    path.write_text(json.dumps(fields, indent=1) + "\n")


def _is_number(value: object) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return abs(value) < 1e300 and math.isfinite(value)


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
