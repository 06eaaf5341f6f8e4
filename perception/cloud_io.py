"""Recorded clouds and depth images: read whole, or refused with the reason."""

import json
import math
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import open3d as o3d
from PIL import Image

from perception.cloud_header import read_header
from perception.errors import CloudReadError
from perception.values import FloatArray

CLOUD_SUFFIXES = (".ply", ".pcd", ".xyz", ".npy", ".npz")
DEPTH_SUFFIX = ".png"
_UNDISTORT_ROUNDS = 20
_OPTIONAL_INTRINSICS: dict[str, Any] = {
    "depth_scale_m_per_unit": 0.001,
    "distortion_k1k2p1p2k3": [0.0] * 5,
}


def read_cloud(path: Path) -> FloatArray:
    """Reads the points of a cloud.

    PLY and PCD (ascii, binary, compressed) are read by Open3D; since that gives out
    what it got of a truncated file, the file is checked against its header first. XYZ
    is text with x, y and z first in each line. NPY is an array (N, 3) or (3, N), read
    as (N, 3) when it is 3 x 3; NPZ holds one such array, alone or named "points", "xyz"
    or "p_WQs".

    Args:
        path: The file; its suffix tells the form.

    Returns:
        (3, N) in the file's frame and unit; points may be non-finite, not all of them.

    Raises:
        CloudReadError: The file is missing, truncated, empty, of an unknown form or has
            no finite point; names the file and the reason.
    """
    suffix = path.suffix.lower()
    if suffix not in CLOUD_SUFFIXES:
        known = ", ".join(CLOUD_SUFFIXES)
        raise CloudReadError(
            f"{path}: unknown cloud format {suffix!r}; known: {known}."
        )
    _check_file(path)
    if suffix in (".ply", ".pcd"):
        points = _read_open3d(path)
    elif suffix == ".xyz":
        points = _read_text(path)
    else:
        points = _read_array(path)
    return _checked(path, points)


def read_depth(path: Path, intrinsics_path: Path) -> FloatArray:
    """Reads a depth image as a cloud.

    The intrinsics are a JSON object with `width`, `height`, `fx`, `fy`, `cx`, `cy` in
    px, optionally `depth_scale_m_per_unit` (default 0.001) and `distortion_k1k2p1p2k3`,
    five coefficients of Brown and Conrady, which are taken off.

    Source: Brown, "Close-range camera calibration", 1971.

    Args:
        path: 16-bit PNG, 0 = no measurement.
        intrinsics_path: The JSON file.

    Returns:
        p_CQs (3, N) m, in C (x right, y down, z ahead); pixels without a measurement
        are left out.

    Raises:
        CloudReadError: A file is missing or unusable, or sizes disagree; names the
            file, the field, the value and the bound.
    """
    camera = _read_intrinsics(intrinsics_path)
    _check_file(path)
    try:
        with Image.open(path) as image:
            mode, depth = image.mode, np.asarray(image)
    except (OSError, SyntaxError, ValueError) as error:
        raise CloudReadError(f"{path}: cannot read the picture: {error}.") from error
    if depth.ndim != 2 or depth.dtype.itemsize < 2 or depth.dtype.kind not in "iu":
        raise CloudReadError(f"{path}: expected 16-bit grey depth, got mode {mode!r}.")
    height, width = depth.shape
    if (width, height) != (camera["width"], camera["height"]):
        raise CloudReadError(
            f"{path}: the image is {width} x {height} px, {intrinsics_path} is for "
            f"{camera['width']} x {camera['height']} px."
        )
    rows, columns = np.nonzero(depth)
    z = depth[rows, columns] * float(camera["depth_scale_m_per_unit"])
    x = (columns - camera["cx"]) / camera["fx"]
    y = (rows - camera["cy"]) / camera["fy"]
    x, y = _undistorted(x, y, camera["distortion_k1k2p1p2k3"])
    return _checked(path, np.stack([x * z, y * z, z]))


def _check_file(path: Path) -> None:
    if not path.is_file():
        reason = "is a folder" if path.is_dir() else "no such file"
        raise CloudReadError(f"{path}: {reason}.")
    try:
        with path.open("rb") as file:
            empty = not file.read(1)
    except OSError as error:
        raise CloudReadError(f"{path}: {error.strerror}.") from error
    if empty:
        raise CloudReadError(f"{path}: the file is empty.")


def _checked(path: Path, points: FloatArray) -> FloatArray:
    if points.shape[1] == 0:
        raise CloudReadError(f"{path}: the cloud has no points.")
    if not np.any(np.all(np.isfinite(points), axis=0)):
        raise CloudReadError(
            f"{path}: none of the {points.shape[1]} points is finite (NaN or infinite)."
        )
    return np.ascontiguousarray(points, dtype=np.float64)


def _read_open3d(path: Path) -> FloatArray:
    header = read_header(path)
    with o3d.utility.VerbosityContextManager(o3d.utility.VerbosityLevel.Error):
        cloud = o3d.io.read_point_cloud(
            path, remove_nan_points=False, remove_infinite_points=False
        )
    points: FloatArray = np.asarray(cloud.points, dtype=np.float64).T
    if points.shape[1] != header.count:
        raise CloudReadError(
            f"{path}: the header promises {header.count} points, "
            f"{points.shape[1]} could be read."
        )
    return points


def _read_text(path: Path) -> FloatArray:
    try:
        rows = np.loadtxt(path, usecols=(0, 1, 2), ndmin=2, comments=("#", "//"))
    except (ValueError, IndexError, UnicodeDecodeError) as error:
        raise CloudReadError(f"{path}: not lines of x, y and z: {error}") from error
    return rows.T


def _read_array(path: Path) -> FloatArray:
    try:
        content: Any = np.load(path, allow_pickle=False)
        if path.suffix.lower() == ".npz":
            names = [name for name in ("points", "xyz", "p_WQs") if name in content]
            names = names or list(content)
            if len(names) != 1:
                raise CloudReadError(
                    f'{path}: expected one array, or one named "points", "xyz" or '
                    f'"p_WQs", found {", ".join(names) or "none"}.'
                )
            content = content[names[0]]
    except (OSError, ValueError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise CloudReadError(f"{path}: cannot read the array: {error}") from error
    if content.ndim == 2 and content.dtype.kind in "fiu":
        if content.shape[1] == 3:
            return np.asarray(content.T, dtype=np.float64)
        if content.shape[0] == 3:
            return np.asarray(content, dtype=np.float64)
    raise CloudReadError(
        f"{path}: expected numbers of shape (N, 3) or (3, N), "
        f"got {content.dtype} of shape {content.shape}."
    )


def _read_intrinsics(path: Path) -> dict[str, Any]:
    """Reads and checks the camera; the optional fields are filled in."""
    _check_file(path)
    try:
        camera: Any = json.loads(path.read_text())
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise CloudReadError(f"{path}: not JSON: {error}") from error
    if not isinstance(camera, dict):
        raise CloudReadError(f"{path}: expected a JSON object.")
    camera = _OPTIONAL_INTRINSICS | camera
    positive = ("width", "height", "fx", "fy", "depth_scale_m_per_unit")
    for name in (*positive, "cx", "cy"):
        value = camera.get(name)
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if not number or not math.isfinite(value):
            raise CloudReadError(f"{path}: {name} must be a number, got {value!r}.")
        if name in positive and value <= 0:
            raise CloudReadError(f"{path}: {name} must be > 0, got {value!r}.")
    coefficients: Any = camera["distortion_k1k2p1p2k3"]
    if np.array(coefficients).shape != (5,):
        raise CloudReadError(
            f"{path}: distortion_k1k2p1p2k3 must be 5 numbers, got {coefficients!r}."
        )
    return dict(camera)


def _undistorted(
    x: FloatArray, y: FloatArray, coefficients: list[float]
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
