"""RealSense recordings as folders of frames in TUM's form, through librealsense.

The driver is native code that a damaged file may crash or hang, so it runs in a process
of its own:

    python -m perception.io.bag_frames RECORDING FOLDER
"""

import sys
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from perception.io.bags import depth_groups, intrinsics_of, play_apart
from perception.io.camera_file import CAMERA_FILE, write_camera

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
    """Plays a recording into files; its camera comes with the first picture."""
    import pyrealsense2 as rs

    align = rs.align(rs.stream.depth)
    for name in ("rgb", "depth"):
        (folder / name).mkdir()
    last = -1.0
    with (folder / "rgb.txt").open("w") as rgb, (folder / "depth.txt").open("w") as dep:
        for frame, group in depth_groups(path):
            time = frame.get_timestamp() / 1000.0
            if time <= last:
                continue
            if last < 0.0:
                camera = folder / CAMERA_FILE
                write_camera(camera, intrinsics_of(frame), frame.get_units())
            color = group.get_color_frame()
            if color:
                color = align.process(group).get_color_frame()
            last, stamp = time, f"{time:.6f}"
            depth = np.array(frame.get_data())
            picture = _as_bgr(color, depth.shape)
            cv2.imwrite(str(folder / f"depth/{stamp}.png"), depth, _QUICK_PNG)
            cv2.imwrite(str(folder / f"rgb/{stamp}.png"), picture, _QUICK_PNG)
            rgb.write(f"{stamp} rgb/{stamp}.png\n")
            dep.write(f"{stamp} depth/{stamp}.png\n")


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


def _main() -> None:
    try:
        _play(sys.argv[1], Path(sys.argv[2]))
    except (RuntimeError, ValueError) as error:
        raise SystemExit(" ".join(str(error).split())) from None


if __name__ == "__main__":
    _main()
