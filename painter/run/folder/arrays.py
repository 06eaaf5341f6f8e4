"""Arrays of a run on disk: .npz files and the map as .ply."""

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
from perception.values import SurfaceMap

_PLY_POINT = np.dtype([(name, "<f4") for name in ("x", "y", "z", "nx", "ny", "nz")])


def write_whole(path: Path, write: Callable[[Path], None]) -> None:
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
    _save(path, vars(executed))


def load_executed(path: Path) -> Executed:
    """Reads executed.npz; raises InputError if it is not one."""
    return Executed(
        **_load(path, ("time", "q", "v", "trigger", "X_WG", "X_WG_desired"))
    )


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
    points = np.empty(surface_map.p_WQs.shape[1], dtype=_PLY_POINT)
    rows = [*surface_map.p_WQs, *surface_map.normals_W]
    for name, row in zip(_PLY_POINT.names or (), rows, strict=True):
        points[name] = row
    header = [
        "ply",
        "format binary_little_endian 1.0",
        "comment Painter map: points and normals in the world frame W, m",
        f"element vertex {len(points)}",
        *(f"property float {name}" for name in _PLY_POINT.names or ()),
        "end_header",
    ]
    text = ("\n".join(header) + "\n").encode()
    write_whole(path, lambda draft: _write(draft, text + points.tobytes()))


def load_map(path: Path) -> np.ndarray:
    """Reads the points of a map that `save_map` wrote.

    Returns:
        (3, N) float64, m, in W.

    Raises:
        InputError: The file is not such a map or is cut short.
    """
    head, mark, body = path.read_bytes().partition(b"end_header\n")
    words = head.decode("ascii", "replace").split()
    if not mark or "vertex" not in words:
        raise InputError(
            f"{path}: not a map of Painter's (no PLY header).", code="PNT-RUN-009"
        )
    count = int(words[words.index("vertex") + 1])
    if len(body) != count * _PLY_POINT.itemsize:
        raise InputError(
            f"{path}: {len(body)} bytes of points, expected "
            f"{count * _PLY_POINT.itemsize} for {count} points.",
            code="PNT-RUN-010",
        )
    points = np.frombuffer(body, dtype=_PLY_POINT)
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


def _write(path: Path, content: bytes) -> None:
    path.write_bytes(content)
