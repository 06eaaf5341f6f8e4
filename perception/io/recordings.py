"""Any recording of one wall as one cloud: cloud file, depth images or bag."""

from pathlib import Path

import numpy as np

from perception.errors import CloudReadError
from perception.io.bags import BAG_SUFFIXES, read_bag
from perception.io.camera_file import INTRINSICS_FILE
from perception.io.clouds import RecordedCloud, read_cloud
from perception.io.depth_images import DEPTH_SUFFIX, read_depth_frames


def read_recording(
    path: Path, *, intrinsics: Path | None = None, unit: float = 1.0
) -> RecordedCloud:
    """Reads a cloud, a RealSense recording, or depth images.

    Args:
        path: The file, or a folder of depth images of a scene at rest.
        intrinsics: Camera of depth images; None = `intrinsics.json` beside them.
        unit: Length of a cloud's unit, m; depth images and bags have their own.

    Returns:
        The cloud, m.

    Raises:
        CloudReadError: A file is unusable, or an argument does not go with it.
    """
    suffix = path.suffix.lower()
    if path.is_dir() or suffix == DEPTH_SUFFIX:
        images = _depth_images(path) if path.is_dir() else [path]
        if not path.is_dir() and not path.exists():
            raise CloudReadError(f"{path}: no such file.", code="PNT-USE-041")
        beside = images[0].with_name(INTRINSICS_FILE)
        camera = beside if intrinsics is None and beside.exists() else intrinsics
        if camera is None:
            raise CloudReadError(
                f"{path}: a depth image needs its camera; give intrinsics, or put "
                f"{INTRINSICS_FILE} beside it.",
                code="PNT-USE-042",
            )
        _refuse_unit(path, unit)
        return RecordedCloud(p_WQs=read_depth_frames(images, camera))
    if intrinsics is not None:
        raise CloudReadError(
            f"{path}: is no depth PNG and takes no intrinsics.", code="PNT-USE-043"
        )
    if suffix in BAG_SUFFIXES:
        _refuse_unit(path, unit)
        return RecordedCloud(p_WQs=read_bag(path))
    cloud = read_cloud(path)
    with np.errstate(over="ignore"):
        return RecordedCloud(
            p_WQs=cloud.p_WQs * unit,
            p_WC=None if cloud.p_WC is None else cloud.p_WC * unit,
        )


def _depth_images(folder: Path) -> list[Path]:
    """Lists a folder's depth images: those with "depth" in their name, or else all."""
    images = sorted(folder.glob(f"*{DEPTH_SUFFIX}"))
    images = [path for path in images if "depth" in path.name.lower()] or images
    if not images:
        raise CloudReadError(
            f"{folder}: there is no {DEPTH_SUFFIX} file in this folder.",
            code="PNT-USE-044",
        )
    return images


def _refuse_unit(path: Path, unit: float) -> None:
    if unit != 1.0:
        raise CloudReadError(
            f"{path}: has the depth scale of its camera; a unit is for clouds only.",
            code="PNT-USE-045",
        )
