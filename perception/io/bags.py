"""Depth from recordings of RealSense cameras, through librealsense.

The driver is native code that a damaged file may crash or hang, so it runs in a process
of its own:

    python -m perception.io.bags RECORDING FOLDER
"""

import importlib.util
import itertools
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from perception.depth_camera.depth import CameraIntrinsics
from perception.errors import CloudReadError
from perception.ground import FloatArray
from perception.io.camera_file import CAMERA_FILE, read_camera, write_camera
from perception.io.clouds import check_file, checked_points
from perception.io.depth_images import MAX_FRAMES, median_depth

# librealsense records ROS 1 bags, from 2.58 on ROS 2 ones; it plays both.
BAG_SUFFIXES = (".bag", ".db3")
_DEPTH_FILE = "depth.npy"
_TIMEOUT = 25.0  # s
_FRAME_WAIT_MS = 2000


def read_bag(path: Path) -> FloatArray:
    """Reads the depth of a RealSense recording of a static scene.

    Args:
        path: A `.bag` or `.db3` file with a depth stream; `median_depth` fuses its
            first `MAX_FRAMES` images.

    Returns:
        p_CQs (3, N) m, in C (x right, y down, z ahead).

    Raises:
        CloudReadError: The file is missing or unusable, or pyrealsense2 is not
            installed; names the reason.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        play_apart("perception.io.bags", path, folder, timeout=_TIMEOUT)
        camera = read_camera(folder / CAMERA_FILE)
        depth = np.load(folder / _DEPTH_FILE)
    return checked_points(path, camera.points(depth))


def play_apart(module: str, path: Path, folder: Path, *, timeout: float) -> None:
    """Plays a recording in a process of its own.

    Args:
        module: Program to run, with the paths of recording and folder. Its last line on
            stderr says why it failed.
        path: A `.bag` or `.db3` file.
        folder: Existing folder of the result.
        timeout: Kills the process after this time, s.

    Raises:
        CloudReadError: The file is missing or unusable, or pyrealsense2 is not
            installed; names the reason.
    """
    check_file(path)
    if importlib.util.find_spec("pyrealsense2") is None:
        raise CloudReadError(
            f"{path}: reading RealSense recordings needs pyrealsense2; "
            "install it with: pip install 'painter[hardware]'.",
            code="PNT-FRAMES-001",
        )
    words = [sys.executable, "-m", module, str(path), str(folder)]
    try:
        done = subprocess.run(words, capture_output=True, timeout=timeout, check=False)
    except subprocess.TimeoutExpired as error:
        raise CloudReadError(
            f"{path}: librealsense did not finish within {timeout:g} s.",
            code="PNT-FRAMES-002",
        ) from error
    if done.returncode != 0:
        reason = done.stderr.decode(errors="replace").strip().splitlines()
        raise CloudReadError(
            f"{path}: librealsense cannot read the recording: "
            f"{reason[-1] if reason else f'exit status {done.returncode}'}.",
            code="PNT-FRAMES-003",
        )


def depth_groups(path: str, *streams: Any) -> Iterator[tuple[Any, Any]]:
    """Plays a recording's depth frames, as fast as the caller takes them.

    Args:
        path: Of the recording.
        *streams: Streams of librealsense to play; all if left out.

    Yields:
        Each depth frame, and the set of frames that it came in.

    Raises:
        ValueError: There is no depth image.
    """
    import pyrealsense2 as rs

    config, pipeline = rs.config(), rs.pipeline()
    rs.config.enable_device_from_file(config, path, repeat_playback=False)
    for stream in streams:
        config.enable_stream(stream)
    profile = pipeline.start(config)
    profile.get_device().as_playback().set_real_time(False)
    empty = True
    while True:
        there, group = pipeline.try_wait_for_frames(_FRAME_WAIT_MS)
        frame = group.get_depth_frame() if there else None
        if not frame:
            break
        empty = False
        yield frame, group
    if empty:
        raise ValueError("no depth images")


def intrinsics_of(frame: Any) -> CameraIntrinsics:
    """Returns the intrinsics of a depth frame; ValueError = it is distorted."""
    lens = frame.profile.as_video_stream_profile().intrinsics
    return CameraIntrinsics.from_librealsense(lens)


def main_apart(play: Callable[[str, Path], None]) -> None:
    """Plays a recording as the program that `play_apart` starts.

    Args:
        play: Gets the paths of recording and folder; its RuntimeError or ValueError
            says why it failed.
    """
    try:
        play(sys.argv[1], Path(sys.argv[2]))
    except (RuntimeError, ValueError) as error:
        raise SystemExit(" ".join(str(error).split())) from None


def _play(path: str, folder: Path) -> None:
    """Plays a recording; writes its depth in units and its camera."""
    import pyrealsense2 as rs

    frames: list[Any] = []
    for frame, _ in itertools.islice(depth_groups(path, rs.stream.depth), MAX_FRAMES):
        scale = frame.get_units()
        camera = intrinsics_of(frame)
        frames.append(np.array(frame.get_data()))
    write_camera(folder / CAMERA_FILE, camera, scale)
    np.save(folder / _DEPTH_FILE, median_depth(frames))


if __name__ == "__main__":
    main_apart(_play)
