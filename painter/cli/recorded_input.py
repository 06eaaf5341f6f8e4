"""Words of `painter segment` about its input, and reading what they name."""

import enum
import math
from pathlib import Path

import numpy as np

from painter.errors import InputError
from perception.ground import FloatArray
from perception.io.bags import BAG_SUFFIXES, read_bag
from perception.io.camera_file import INTRINSICS_FILE
from perception.io.clouds import RecordedCloud, read_cloud
from perception.io.depth_images import DEPTH_SUFFIX, read_depth_frames


class Unit(enum.StrEnum):
    """A unit of length."""

    M = "m"
    CM = "cm"
    MM = "mm"

    @property
    def metres(self) -> float:
        """Its length, m."""
        return {"m": 1.0, "cm": 0.01, "mm": 0.001}[self.value]


def parse_direction(words: str) -> FloatArray:
    """Reads a direction of the cloud's frame.

    Args:
        words: An axis, as "z" or "-y", or "X,Y,Z".

    Returns:
        (3,) unit vector.

    Raises:
        InputError: It is neither, or of no length.
    """
    axis = words.strip().lower().lstrip("+")
    if axis.removeprefix("-") in ("x", "y", "z"):
        sign = -1.0 if axis.startswith("-") else 1.0
        return sign * np.eye(3)["xyz".index(axis[-1])]
    vector = _numbers(words)
    length = float(np.linalg.norm(vector)) if vector is not None else 0.0
    if vector is None or not 0.0 < length < math.inf:
        raise InputError(
            f"--up must be x, -x, ... -z or X,Y,Z, got {words!r}.", code="PNT-USE-037"
        )
    return vector / length


def parse_point(words: str) -> FloatArray:
    """Reads a point of the cloud's frame.

    Args:
        words: "X,Y,Z", m.

    Returns:
        (3,) m.

    Raises:
        InputError: It is not three numbers.
    """
    point = _numbers(words)
    if point is None:
        raise InputError(
            f"--viewpoint must be X,Y,Z in m, got {words!r}.", code="PNT-USE-038"
        )
    return point


def parse_tile(words: str) -> tuple[float, float]:
    """Reads the size of a tile.

    Args:
        words: "WxH", m.

    Returns:
        Width and height, m.

    Raises:
        InputError: It is not two positive numbers.
    """
    try:
        width, height = (float(word) for word in words.lower().split("x"))
    except ValueError:
        raise InputError(
            f"--tile must be WxH in m, e.g. 2x2, got {words!r}.", code="PNT-USE-039"
        ) from None
    if not (0.0 < width < math.inf and 0.0 < height < math.inf):
        raise InputError(f"--tile must be > 0 m, got {words!r}.", code="PNT-USE-040")
    return width, height


def read_input(path: Path, *, intrinsics: Path | None, unit: Unit) -> RecordedCloud:
    """Reads a cloud, a RealSense recording, or depth images.

    Args:
        path: The file, or a folder of depth images of a scene at rest.
        intrinsics: Camera of depth images; if left out, `intrinsics.json` beside them.
        unit: Of a cloud's numbers; depth images and recordings have their own.

    Returns:
        The cloud, m.

    Raises:
        InputError: The words do not fit the file.
        CloudReadError: A file is unusable.
    """
    suffix = path.suffix.lower()
    if path.is_dir() or suffix == DEPTH_SUFFIX:
        images = _depth_images(path) if path.is_dir() else [path]
        if not path.is_dir() and not path.exists():
            raise InputError(f"{path}: no such file.", code="PNT-USE-041")
        beside = images[0].with_name(INTRINSICS_FILE)
        camera = beside if intrinsics is None and beside.exists() else intrinsics
        if camera is None:
            raise InputError(
                f"{path}: a depth image needs --intrinsics JSON.", code="PNT-USE-042"
            )
        _refuse_unit(path, unit)
        return RecordedCloud(p_WQs=read_depth_frames(images, camera))
    if intrinsics is not None:
        raise InputError(
            f"--intrinsics is for a depth PNG; {path} is none.", code="PNT-USE-043"
        )
    if suffix in BAG_SUFFIXES:
        _refuse_unit(path, unit)
        return RecordedCloud(p_WQs=read_bag(path))
    cloud = read_cloud(path)
    with np.errstate(over="ignore"):
        return RecordedCloud(
            p_WQs=cloud.p_WQs * unit.metres,
            p_WC=None if cloud.p_WC is None else cloud.p_WC * unit.metres,
        )


def _numbers(words: str) -> FloatArray | None:
    try:
        numbers = np.array([float(word) for word in words.split(",")])
    except ValueError:
        return None
    return numbers if numbers.size == 3 and np.isfinite(numbers).all() else None


def _depth_images(folder: Path) -> list[Path]:
    """Lists a folder's depth images: those with "depth" in their name, or else all."""
    images = sorted(folder.glob(f"*{DEPTH_SUFFIX}"))
    images = [path for path in images if "depth" in path.name.lower()] or images
    if not images:
        raise InputError(
            f"{folder}: there is no {DEPTH_SUFFIX} in this folder.", code="PNT-USE-044"
        )
    return images


def _refuse_unit(path: Path, unit: Unit) -> None:
    if unit is not Unit.M:
        raise InputError(
            f"--unit is for clouds; {path} has the depth scale of its camera.",
            code="PNT-USE-045",
        )
