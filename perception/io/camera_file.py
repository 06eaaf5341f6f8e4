"""The camera of recorded depth images: its JSON file and the points of its images."""

import dataclasses
import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from perception.depth_camera.depth import CameraIntrinsics
from perception.errors import CloudReadError
from perception.ground import FloatArray
from perception.io.clouds import check_file
from perception.settings import setting, validate

CAMERA_FILE = "camera.json"
INTRINSICS_FILE = "intrinsics.json"
_UNDISTORTED = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 20, 1e-9)
"""Ends OpenCV's iteration: after so many rounds, or when it is off by less, px."""


@dataclasses.dataclass(frozen=True)
class RecordedCamera:
    """A depth camera as a file describes it.

    Attributes:
        intrinsics: The pinhole.
        depth_scale: Length of one unit of the depth images, m.
        distortion: Brown and Conrady's k1, k2, p1, p2 and k3.
    """

    intrinsics: CameraIntrinsics
    depth_scale: float
    distortion: tuple[float, ...] = (0.0,) * 5

    def points(self, depth: npt.NDArray[Any]) -> FloatArray:
        """Returns the points of an image, with the distortion taken off.

        Args:
            depth: (H, W) in units of `depth_scale`, 0 = no measurement.

        Returns:
            p_CQs (3, N) m, in C (x right, y down, z ahead), row by row.
        """
        rows, columns = np.nonzero(depth)
        with np.errstate(over="ignore", invalid="ignore"):  # Non-finite: no point.
            z = depth[rows, columns] * self.depth_scale
            x, y = self.intrinsics.rays(columns, rows)
            if any(self.distortion) and rows.size:
                uv = np.stack([columns, rows], axis=1).astype(np.float64)
                lens = self.intrinsics.matrix, np.array(self.distortion)
                x, y = cv2.undistortPointsIter(
                    uv, *lens, np.eye(3), np.eye(3), _UNDISTORTED
                )[:, 0].T
            return np.stack([x * z, y * z, z])


@dataclasses.dataclass(kw_only=True)
class _CameraFile:
    """What a camera's file may hold; without a default it must."""

    width: Any = setting(None, "px", above=0.0)
    height: Any = setting(None, "px", above=0.0)
    fx: Any = setting(None, "px", above=0.0)
    fy: Any = setting(None, "px", above=0.0)
    cx: Any = setting(None, "px")
    cy: Any = setting(None, "px")
    depth_scale_m_per_unit: Any = setting(None, "m", above=0.0)
    distortion_k1k2p1p2k3: Any = setting([0.0] * 5, "1", length=5)


def read_camera(path: Path, *, depth_scale: float = 0.001) -> RecordedCamera:
    """Reads a camera.

    The file is a JSON object with `width`, `height`, `fx`, `fy`, `cx`, `cy` in px,
    optionally `depth_scale_m_per_unit` and `distortion_k1k2p1p2k3`, the five
    coefficients of Brown and Conrady. Other fields are ignored.

    Source: Brown, "Close-range camera calibration", 1971.

    Args:
        path: The file.
        depth_scale: `depth_scale_m_per_unit` if the file does not give it, m.

    Raises:
        CloudReadError: The file is missing or describes no camera; names the field, the
            value and the bound.
    """
    check_file(path)
    names = [field.name for field in dataclasses.fields(_CameraFile)]
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        if not isinstance(content, dict):
            raise ValueError("expected a JSON object.")
        content = {"depth_scale_m_per_unit": depth_scale} | content
        file = _CameraFile(**{name: content[name] for name in names if name in content})
        validate(file)
        fx, fy, cx, cy = map(float, (file.fx, file.fy, file.cx, file.cy))
        return RecordedCamera(
            CameraIntrinsics(fx, fy, cx, cy, int(file.width), int(file.height)),
            float(file.depth_scale_m_per_unit),
            tuple(map(float, file.distortion_k1k2p1p2k3)),
        )
    except (OSError, ValueError, TypeError, OverflowError, RecursionError) as error:
        raise CloudReadError(
            f"{path}: not a camera: {error!s:.200}", code="PNT-FRAMES-005"
        ) from error


def write_camera(
    path: Path, intrinsics: CameraIntrinsics, depth_scale: float | None = None
) -> None:
    """Writes a camera without distortion.

    Args:
        path: The file.
        intrinsics: The pinhole.
        depth_scale: `depth_scale_m_per_unit`, m; None = leave it out.
    """
    names = ("width", "height", "fx", "fy", "cx", "cy")
    fields = {name: getattr(intrinsics, name) for name in names}
    if depth_scale is not None:
        fields["depth_scale_m_per_unit"] = depth_scale
    path.write_text(json.dumps(fields, indent=1) + "\n")
