"""Segmentation files, as specified in DESIGN.md, section 5."""

import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image
from pydrake.math import RigidTransform

from perception.errors import CloudReadError
from perception.ground import BoolArray, FloatArray
from perception.values import Opening, WallSegmentation

_FIELDS = ("labels", "depth", "wall_mask", "X_WT", "cell")
_EXTRAS = ("surface", "normals", "confidence", "reason")  # Of fine steps alone.
_NUMBERS = ("kind", "area", "depth", "glass_share")
_OPENINGS = tuple(f"opening_{name}" for name in (*_NUMBERS, "corners", "p_TVs"))


def save_segmentation(path: Path, segmentation: WallSegmentation) -> None:
    """Writes a segmentation.

    Args:
        path: File to write, `segmentation.npz`: `labels` (ny, nx) uint16, `depth`
            (ny, nx) float32 m, `wall_mask` (ny, nx) bool, `X_WT` (4, 4), `cell` m; row
            0 at the bottom; and, where fine steps drew the mask, `surface` (ny, nx)
            float32 m, `normals` (ny, nx, 3) float32, `confidence` (ny, nx) float32 and
            `reason` (ny, nx) uint8. Of openings, the largest first: `opening_kind`
            (k,) str, `opening_area` (k,) m², `opening_depth` (k,) m,
            `opening_glass_share` (k,), and their corners, one after another,
            `opening_p_TVs` (2, n) m in T, `opening_corners` (k,) of each.
        segmentation: What to write.
    """
    values = {name: getattr(segmentation, name) for name in (*_FIELDS, *_EXTRAS)}
    values["X_WT"] = segmentation.X_WT.GetAsMatrix4()
    arrays = {name: value for name, value in values.items() if value is not None}
    arrays |= _opening_arrays(segmentation.openings)
    np.savez_compressed(path, **arrays)


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
        raise CloudReadError(f"{path}: no such file.", code="PNT-SEGMENT-001")
    try:
        file = np.load(path, allow_pickle=False)
        # A lone array, from a .npy file, has no names.
        missing = [name for name in _FIELDS if name not in getattr(file, "files", ())]
        if missing:
            raise CloudReadError(
                f"{path}: not a segmentation: {missing[0]} is missing.",
                code="PNT-SEGMENT-002",
            )
        content = {name: file[name] for name in _FIELDS}
        extras = {name: file[name] for name in _EXTRAS if name in file.files}
        openings = _openings({name: file[name] for name in _OPENINGS if name in file})
    except (OSError, ValueError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise CloudReadError(
            f"{path}: not a segmentation: {error}", code="PNT-SEGMENT-003"
        ) from error
    labels = content["labels"]
    for name in ("labels", "depth", "wall_mask", *extras):
        shape = (content | extras)[name].shape
        rest = (3,) if name == "normals" else ()
        if labels.ndim != 2 or shape != (*labels.shape, *rest):
            raise CloudReadError(
                f"{path}: {name} has shape {shape}, labels {labels.shape}; "
                "they must be of one grid (ny, nx).",
                code="PNT-SEGMENT-004",
            )
    matrix = content["X_WT"]
    if matrix.shape != (4, 4) or not _is_rotation(matrix[:3, :3]):
        raise CloudReadError(
            f"{path}: X_WT is not a rigid transform.", code="PNT-SEGMENT-006"
        )
    cell = float(content["cell"])
    if not (np.isfinite(cell) and cell > 0.0):
        raise CloudReadError(
            f"{path}: cell must be > 0 m, got {cell!r}.", code="PNT-SEGMENT-007"
        )
    return WallSegmentation(
        labels=labels.astype(np.uint16),
        depth=content["depth"].astype(np.float32),
        wall_mask=content["wall_mask"].astype(np.bool_),
        X_WT=RigidTransform(matrix),
        cell=cell,
        openings=openings,
        **extras,
    )


def save_wall_mask(path: Path, wall_mask: BoolArray) -> None:
    """Writes a mask as a picture: white = paint, as seen from the robot.

    Args:
        path: PNG file to write; row 0 of the picture is the top.
        wall_mask: (ny, nx), row 0 at the bottom.
    """
    Image.fromarray(np.flipud(wall_mask).astype(np.uint8) * 255, mode="L").save(path)


def _opening_arrays(openings: tuple[Opening, ...]) -> dict[str, npt.NDArray[Any]]:
    """Returns openings as arrays by name; none where there are none."""
    if not openings:
        return {}
    columns = [
        np.array([getattr(opening, name) for opening in openings]) for name in _NUMBERS
    ]
    outlines = [opening.p_TVs for opening in openings]
    columns.append(np.array([outline.shape[1] for outline in outlines]))
    columns.append(np.concatenate(outlines, axis=1))
    return dict(zip(_OPENINGS, columns, strict=True))


def _openings(arrays: dict[str, npt.NDArray[Any]]) -> tuple[Opening, ...]:
    """Returns the openings of arrays.

    Raises:
        ValueError: The arrays do not match.
    """
    if not arrays:
        return ()
    missing = [name for name in _OPENINGS if name not in arrays]
    if missing:
        raise ValueError(f"{missing[0]} is missing.")
    *columns, corners, p_TVs = (arrays[name] for name in _OPENINGS)
    lengths = {column.shape for column in (*columns, corners)}
    if len(lengths) != 1 or p_TVs.shape != (2, int(corners.sum())):
        raise ValueError(
            f"opening arrays do not match: shapes {lengths}, corners {p_TVs.shape}."
        )
    outlines = np.split(p_TVs, np.cumsum(corners)[:-1], axis=1)
    return tuple(
        Opening(str(kind), outline, *map(float, numbers))
        for kind, *numbers, outline in zip(*columns, outlines, strict=True)
    )


def _is_rotation(matrix: FloatArray) -> bool:
    square = np.allclose(matrix @ matrix.T, np.eye(3), atol=1e-6)
    return square and float(np.linalg.det(matrix)) > 0.0
