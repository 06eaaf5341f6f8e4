"""Segmentations in files, as DESIGN.md section 5 lays them down."""

import zipfile
import zlib
from pathlib import Path

import numpy as np
from PIL import Image
from pydrake.math import RigidTransform

from perception.errors import CloudReadError
from perception.values import BoolArray, FloatArray, WallSegmentation

_FIELDS = ("labels", "depth", "wall_mask", "X_WT", "cell")
_EXTRAS = ("surface", "normals", "confidence", "reason")  # Where they were made.


def save_segmentation(path: Path, segmentation: WallSegmentation) -> None:
    """Writes a segmentation.

    Args:
        path: File to write, `segmentation.npz`: `labels` (ny, nx) uint16, `depth`
            (ny, nx) float32 m, `wall_mask` (ny, nx) bool, `X_WT` (4, 4), `cell` m; row
            0 at the bottom; and, where fine steps drew the mask, `surface` (ny, nx)
            float32 m, `normals` (ny, nx, 3) float32, `confidence` (ny, nx) float32 and
            `reason` (ny, nx) uint8. Openings are not kept.
        segmentation: What to write.
    """
    extras = {name: getattr(segmentation, name) for name in _EXTRAS}
    np.savez_compressed(
        path,
        labels=segmentation.labels,
        depth=segmentation.depth,
        wall_mask=segmentation.wall_mask,
        X_WT=segmentation.X_WT.GetAsMatrix4(),
        cell=np.float64(segmentation.cell),
        **{name: grid for name, grid in extras.items() if grid is not None},
    )


def load_segmentation(path: Path) -> WallSegmentation:
    """Reads a segmentation.

    Args:
        path: File that `save_segmentation` wrote.

    Returns:
        The segmentation.

    Raises:
        CloudReadError: The file is missing, damaged or not a segmentation; names the
            file and the field.
    """
    if not path.is_file():
        raise CloudReadError(f"{path}: no such file.")
    try:
        file = np.load(path, allow_pickle=False)
        # A lone array, from a .npy file, has no names.
        missing = [name for name in _FIELDS if name not in getattr(file, "files", ())]
        if missing:
            raise CloudReadError(f"{path}: no segmentation: {missing[0]} is missing.")
        content = {name: file[name] for name in _FIELDS}
        extras = {name: file[name] for name in _EXTRAS if name in file.files}
    except (OSError, ValueError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise CloudReadError(f"{path}: no segmentation: {error}") from error
    labels = content["labels"]
    for name in ("labels", "depth", "wall_mask"):
        if content[name].ndim != 2 or content[name].shape != labels.shape:
            raise CloudReadError(
                f"{path}: {name} has shape {content[name].shape}, "
                f"labels {labels.shape}; both must be (ny, nx)."
            )
    for name, grid in extras.items():
        if grid.shape[:2] != labels.shape:
            raise CloudReadError(
                f"{path}: {name} has shape {grid.shape}, labels {labels.shape}."
            )
    matrix = content["X_WT"]
    if matrix.shape != (4, 4) or not _is_rotation(matrix[:3, :3]):
        raise CloudReadError(f"{path}: X_WT is no pose.")
    cell = float(content["cell"])
    if not (np.isfinite(cell) and cell > 0.0):
        raise CloudReadError(f"{path}: cell must be > 0 m, got {cell!r}.")
    return WallSegmentation(
        labels=labels.astype(np.uint16),
        depth=content["depth"].astype(np.float32),
        wall_mask=content["wall_mask"].astype(np.bool_),
        X_WT=RigidTransform(matrix),
        cell=cell,
        **extras,
    )


def save_wall_mask(path: Path, wall_mask: BoolArray) -> None:
    """Writes a mask as a picture: white = paint, as seen from the robot.

    Args:
        path: PNG file to write; row 0 of the picture is the top.
        wall_mask: (ny, nx), row 0 at the bottom.
    """
    Image.fromarray(np.flipud(wall_mask).astype(np.uint8) * 255, mode="L").save(path)


def _is_rotation(matrix: FloatArray) -> bool:
    square = np.allclose(matrix @ matrix.T, np.eye(3), atol=1e-6)
    return square and float(np.linalg.det(matrix)) > 0.0
