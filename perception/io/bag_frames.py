"""RealSense recordings as folders of frames in TUM's form, through librealsense.

The driver is native code that a damaged file may crash or hang, so it runs in a process
of its own:

    python -m perception.io.bag_frames RECORDING FOLDER
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from perception.io.bags import depth_groups, intrinsics_of, main_apart, play_apart
from perception.io.camera_file import CAMERA_FILE, write_camera
from perception.io.frames import write_pictures

TIMEOUT = 1800.0
"""Longest time that unpacking may take, s."""
_QUICK_PNG = [cv2.IMWRITE_PNG_COMPRESSION, 1]


def unpack_bag(path: Path, folder: Path) -> None:
    """Writes a recording's depth, and colour seen through the depth camera, as files.

    Args:
        path: A `.bag` or `.db3` file with a depth stream.
        folder: Existing, empty folder; gets camera.json, depth.txt, rgb.txt and the
            pictures. Times are the recording's, s; without a colour stream the
            pictures are black.

    Raises:
        CloudReadError: The file is missing or unusable, or pyrealsense2 is not
            installed; names the reason.
    """
    play_apart("perception.io.bag_frames", path, folder, timeout=TIMEOUT)


def _play(path: str, folder: Path) -> None:
    """Plays a recording into files."""
    write_pictures(folder, _pictures(path, folder / CAMERA_FILE), png=_QUICK_PNG)


def _pictures(path: str, camera: Path) -> Iterator[tuple[float, Any, Any]]:
    """Yields time, depth and colour; the camera's file comes with the first of them."""
    import pyrealsense2 as rs

    align = rs.align(rs.stream.depth)
    last = -1.0
    for frame, group in depth_groups(path):
        time = frame.get_timestamp() / 1000.0
        if time <= last:
            continue
        if last < 0.0:
            write_camera(camera, intrinsics_of(frame), frame.get_units())
        color = group.get_color_frame()
        if color:
            color = align.process(group).get_color_frame()
        last = time
        depth = np.array(frame.get_data())
        yield time, depth, _as_bgr(color, depth.shape)


def _as_bgr(frame: Any, shape: tuple[int, ...]) -> Any:
    """Returns a colour frame as OpenCV writes it; black if there is none."""
    if not frame:
        return np.zeros((*shape, 3), np.uint8)
    picture = np.array(frame.get_data())
    kind = str(frame.profile.format())
    if kind.endswith("bgr8"):
        return picture
    if kind.endswith("rgb8"):
        return picture[:, :, ::-1].copy()
    raise ValueError(f"colour format {kind} is unknown; known: rgb8, bgr8")


if __name__ == "__main__":
    main_apart(_play)
