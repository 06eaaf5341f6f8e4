"""Arrays of a run on disk: .npz files and the map as .ply."""

import dataclasses
import os
import zipfile
import zlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.math import RigidTransform

from painter.errors import InputError
from painter.run.folder.values import Executed, Film, Truth
from perception.io.clouds import read_fields
from perception.io.ply import write_ply
from perception.values import SurfaceMap

_EXECUTED = tuple(field.name for field in dataclasses.fields(Executed))
_MAP_FIELDS = ("x", "y", "z", "nx", "ny", "nz")
_MAP_COMMENT = "Painter map: points and normals in the world frame W, m"


def write_whole(path: Path, write: Callable[[Path], object]) -> None:
    """Writes a file so that it is there whole or not at all.

    Args:
        path: The file.
        write: Writes the content to the path it is given.
    """
    draft = path.with_name(f".{path.stem}.draft{path.suffix}")
    write(draft)
    os.replace(draft, path)


def save_executed(path: Path, executed: Executed) -> None:
    """Writes executed.npz."""
    _save(path, {name: getattr(executed, name) for name in _EXECUTED})


def load_executed(path: Path) -> Executed:
    """Reads executed.npz; raises InputError if it is not one."""
    return Executed(**_load(path, _EXECUTED))


def save_film(path: Path, film: Film) -> None:
    """Writes film.npz."""
    grids = {"thickness": film.thickness, "before": film.before}
    _save(
        path,
        {name: value for name, value in vars(film).items() if name not in grids}
        | {k: v.astype(np.float32) for k, v in grids.items() if v is not None},
    )


def load_film(path: Path) -> Film:
    """Reads film.npz; raises InputError if it is not one."""
    grids = ("thickness", "kind", "truth_paintable", "truth_keepout")
    numbers = ("cell", "x0", "y0", "sprayed", "landed", "missed")
    data = _load(path, grids + numbers, optional=("before",))
    shape = data["thickness"].shape
    for name in data.keys() - set(numbers):
        if data[name].shape != shape or len(shape) != 2:
            raise InputError(
                f"{path}: {name} has shape {data[name].shape}, not {shape}.",
                code="PNT-RUN-008",
            )
    for name in data.keys() & {"thickness", "before"}:
        data[name] = data[name].astype(float)
    return Film(**data | {name: float(data[name]) for name in numbers})


def save_truth(path: Path, truth: Truth) -> None:
    """Writes truth.npz."""
    _save(path, vars(truth) | {"X_WS": truth.X_WS.GetAsMatrix4()})


def load_truth(path: Path) -> Truth:
    """Reads truth.npz; raises InputError if it is not one."""
    data = _load(path, ("wall_mask", "X_WS", "source"))
    return Truth(
        wall_mask=data["wall_mask"],
        X_WS=RigidTransform(data["X_WS"]),
        source=str(data["source"]),
    )


def save_map(path: Path, surface_map: SurfaceMap) -> None:
    """Writes the points (m, in W) and normals of a map as binary PLY."""
    rows = np.concatenate([surface_map.p_WQs, surface_map.normals_W])
    fields = dict(zip(_MAP_FIELDS, rows.astype(np.float32), strict=True))
    write_whole(path, lambda draft: write_ply(draft, fields, comment=_MAP_COMMENT))


def load_map(path: Path) -> np.ndarray:
    """Reads the points of a map that `save_map` wrote.

    Returns:
        (3, N) float64, m, in W.

    Raises:
        CloudReadError: The file is not such a map or is cut short.
    """
    points = read_fields(path)
    return np.stack([points[name].astype(float) for name in "xyz"])


def _save(path: Path, arrays: Mapping[str, Any]) -> None:
    write_whole(path, lambda draft: np.savez_compressed(draft, **arrays))


def _load(path: Path, names: Sequence[str], optional: Sequence[str] = ()) -> dict:
    try:
        with np.load(path) as file:
            present = [name for name in optional if name in file]
            return {name: file[name] for name in (*names, *present)}
    except KeyError as error:
        raise InputError(f"{path}: {error.args[0]}", code="PNT-RUN-011") from error
    except (OSError, ValueError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise InputError(
            f"{path}: not a readable .npz file ({error}).", code="PNT-RUN-012"
        ) from error
