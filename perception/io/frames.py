"""RGB-D frames and the folders they are recorded in."""

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
from pydrake.math import RigidTransform, RotationMatrix
from scipy.spatial.transform import Rotation

from perception.depth_camera.depth import CameraIntrinsics
from perception.errors import CloudReadError
from perception.ground import FloatArray, FrozenValue
from perception.io.camera_file import (
    CAMERA_FILE,
    INTRINSICS_FILE,
    RecordedCamera,
    read_camera,
    write_camera,
)

DEPTH_UNITS_PER_M = 5000.0
"""Source: TUM RGB-D benchmark, "File formats": 5000 units of depth are a metre."""
MAX_TIME_DIFFERENCE = 0.02
"""Colour, depth and pose belong together within this, s; TUM's `associate.py`."""
MAX_POSE_GAP = 0.1
"""Poses no farther apart than this are interpolated, s."""
TRUTH_FILE = "groundtruth.txt"
ARM_FILE = "arm.txt"

DepthImage = npt.NDArray[np.uint16]
ColorImage = npt.NDArray[np.uint8]

_NUMBERED = re.compile(r"^(?:frame-(\d+)\.depth|depth_(\d+))\.png$")


@dataclass(frozen=True, eq=False)
class Frame(FrozenValue):
    """One picture of an RGB-D camera.

    Attributes:
        time: When it was taken, s.
        depth_mm: (H, W) uint16, mm along C's z, 0 = no return.
        color: (H, W, 3) uint8, RGB, seen through the depth camera's pinhole.
        X_WC: Pose that the arm (or a recording) gives; None = unknown.
    """

    time: float
    depth_mm: DepthImage
    color: ColorImage
    X_WC: RigidTransform | None = None


@dataclass(frozen=True)
class FramePaths:
    """Where a frame's pictures lie, and its pose if one was recorded."""

    time: float
    depth: Path
    color: Path
    X_WC: RigidTransform | None


@dataclass(frozen=True)
class Recording:
    """A folder of frames.

    Attributes:
        intrinsics: Of the camera.
        depth_unit_mm: Length of one unit of the depth pictures, mm.
        entries: The frames, in order of time.
    """

    intrinsics: CameraIntrinsics
    depth_unit_mm: float
    entries: tuple[FramePaths, ...]

    def frames(self) -> Iterator[Frame]:
        """Reads the frames one after the other.

        Raises:
            CloudReadError: A picture is missing or damaged; names the file.
        """
        for entry in self.entries:
            depth = _read_image(entry.depth, cv2.IMREAD_UNCHANGED)
            color = _read_image(entry.color, cv2.IMREAD_COLOR)
            if depth.dtype != np.uint16 or depth.ndim != 2:
                raise CloudReadError(
                    f"{entry.depth}: expected 16-bit grey depth.", code="PNT-FRAMES-013"
                )
            depth_mm = np.rint(depth * self.depth_unit_mm).astype(np.uint16)
            yield Frame(entry.time, depth_mm, color[:, :, ::-1].copy(), entry.X_WC)


def open_recording(
    folder: Path, *, poses: Path | None = None, use_poses: bool = True
) -> Recording:
    """Opens a folder of RGB-D frames.

    Either TUM's form (`rgb.txt`, `depth.txt`, 16-bit depth in 1/5000 m, poses in a
    file of TUM's form) or numbered files (`frame-000700.depth.png`, `.color.jpg`,
    `.pose.txt`, or `depth_0.png`, `color_0.jpg`, `pose_0.txt`; depth in mm, poses
    4 x 4, camera in world). The camera is `camera.json` or `intrinsics.json`.

    Args:
        folder: The folder.
        poses: TUM pose file to use; without it `arm.txt`, or the numbered pose files.
        use_poses: False = leave the poses out.

    Raises:
        CloudReadError: A file is missing or unusable; names the file and the reason.
    """
    if not folder.is_dir():
        raise CloudReadError(f"{folder}: no such folder.", code="PNT-FRAMES-014")
    tum = (folder / "depth.txt").is_file()
    camera = _find_camera(folder, 1.0 / DEPTH_UNITS_PER_M if tum else 0.001)
    if tum:
        source = poses or folder / ARM_FILE
        stamped = None
        if use_poses and (poses is not None or source.is_file()):
            stamped = read_poses(source)
        entries = _tum_entries(folder, stamped)
    else:
        entries = _numbered_entries(folder, use_poses)
    if not entries:
        raise CloudReadError(
            f"{folder}: no frames; expected rgb.txt and depth.txt, or frame-N.depth.png"
            " or depth_N.png.",
            code="PNT-FRAMES-015",
        )
    return Recording(camera.intrinsics, 1000.0 * camera.depth_scale, tuple(entries))


def write_recording(
    folder: Path,
    intrinsics: CameraIntrinsics,
    frames: Iterable[tuple[Frame, RigidTransform]],
) -> int:
    """Writes frames in TUM's form.

    Args:
        folder: Existing folder; gets rgb/, depth/, rgb.txt, depth.txt, camera.json,
            groundtruth.txt and, for frames with a pose, arm.txt.
        intrinsics: Of the camera.
        frames: Frames, each with its true pose.

    Returns:
        Number of frames.
    """
    write_camera(folder / CAMERA_FILE, intrinsics)
    truth, arm = [], []

    def pictures() -> Iterator[tuple[float, DepthImage, ColorImage]]:
        for frame, X_WC in frames:
            units = np.rint(frame.depth_mm * (DEPTH_UNITS_PER_M / 1000.0))
            depth = np.where(units > 65535, 0, units).astype(np.uint16)
            yield frame.time, depth, frame.color[:, :, ::-1]
            truth.append((frame.time, X_WC))
            if frame.X_WC is not None:
                arm.append((frame.time, frame.X_WC))

    write_pictures(folder, pictures())
    write_poses(folder / TRUTH_FILE, truth)
    if arm:
        write_poses(folder / ARM_FILE, arm)
    return len(truth)


def write_pictures(
    folder: Path,
    pictures: Iterable[tuple[float, DepthImage, ColorImage]],
    *,
    png: Sequence[int] = (),
) -> None:
    """Writes rgb/, depth/, rgb.txt and depth.txt of TUM's form.

    Args:
        folder: Existing folder.
        pictures: Time, s, depth in the file's units and colour (BGR) of each frame.
        png: OpenCV's options of PNG.
    """
    for name in ("rgb", "depth"):
        (folder / name).mkdir(exist_ok=True)
    with (folder / "rgb.txt").open("w") as rgb, (folder / "depth.txt").open("w") as dep:
        for time, depth, color in pictures:
            stamp = f"{time:.6f}"
            cv2.imwrite(str(folder / f"depth/{stamp}.png"), depth, png)
            cv2.imwrite(str(folder / f"rgb/{stamp}.png"), color, png)
            rgb.write(f"{stamp} rgb/{stamp}.png\n")
            dep.write(f"{stamp} depth/{stamp}.png\n")


def write_poses(path: Path, poses: Iterable[tuple[float, RigidTransform]]) -> None:
    """Writes poses as TUM does: time, position, quaternion x y z w; camera in world."""
    lines = ["# timestamp tx ty tz qx qy qz qw"]
    for time, X_WC in poses:
        quaternion = Rotation.from_matrix(X_WC.rotation().matrix()).as_quat()
        numbers = [*X_WC.translation(), *quaternion]
        lines.append(f"{time:.6f} " + " ".join(f"{value:.9f}" for value in numbers))
    path.write_text("\n".join(lines) + "\n")


def read_poses(path: Path) -> list[tuple[float, RigidTransform]]:
    """Reads poses of TUM's form.

    Returns:
        Times, s, and X_WC, in the file's order.

    Raises:
        CloudReadError: The file is missing or a line is not a pose; names the line.
    """
    if not path.is_file():
        raise CloudReadError(f"{path}: no such file.", code="PNT-FRAMES-016")
    poses = []
    for number, line in enumerate(path.read_text().splitlines(), 1):
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        try:
            time, x, y, z, qx, qy, qz, qw = map(float, words)
            R = RotationMatrix(Rotation.from_quat([qx, qy, qz, qw]).as_matrix())
        except ValueError as error:
            raise CloudReadError(
                f"{path}: line {number} is not a pose (time, x y z, qx qy qz qw).",
                code="PNT-FRAMES-017",
            ) from error
        poses.append((time, RigidTransform(R, [x, y, z])))
    if not poses:
        raise CloudReadError(f"{path}: the file has no poses.", code="PNT-FRAMES-018")
    return poses


def _read_image(path: Path, mode: int) -> npt.NDArray[Any]:
    image = cv2.imread(str(path), mode)
    if image is None:
        raise CloudReadError(f"{path}: missing or not an image.", code="PNT-FRAMES-019")
    return np.asarray(image)


def _find_camera(folder: Path, depth_scale: float) -> RecordedCamera:
    """Reads the camera of a folder, beside its pictures or one level up."""
    names = (CAMERA_FILE, INTRINSICS_FILE)
    paths = [parent / name for name in names for parent in (folder, folder.parent)]
    path = next((path for path in paths if path.is_file()), None)
    if path is None:
        raise CloudReadError(
            f"{folder}: no {CAMERA_FILE} (with width, height, fx, fy, cx, cy).",
            code="PNT-FRAMES-020",
        )
    camera = read_camera(path, depth_scale=depth_scale)
    for name, side in (("cx", "width"), ("cy", "height")):
        value, size = (getattr(camera.intrinsics, key) for key in (name, side))
        if not 0.0 < value < size:
            raise CloudReadError(
                f"{path}: {name} must be > 0 and < {side} {size}, got {value}.",
                code="PNT-FRAMES-023",
            )
    return camera


def _read_list(path: Path) -> tuple[FloatArray, list[Path]]:
    if not path.is_file():
        raise CloudReadError(f"{path}: no such file.", code="PNT-FRAMES-024")
    rows = [line.split() for line in path.read_text().splitlines()]
    rows = [row for row in rows if row and not row[0].startswith("#")]
    try:
        times = np.array([float(row[0]) for row in rows])
        return times, [path.parent / row[1] for row in rows]
    except (ValueError, IndexError) as error:
        raise CloudReadError(
            f"{path}: each line must hold a time and a file name.",
            code="PNT-FRAMES-025",
        ) from error


def _tum_entries(
    folder: Path, poses: list[tuple[float, RigidTransform]] | None
) -> list[FramePaths]:
    depth_times, depths = _read_list(folder / "depth.txt")
    color_times, colors = _read_list(folder / "rgb.txt")
    if not color_times.size:
        return []
    poses = sorted(poses or [], key=lambda pose: pose[0])
    pose_times = np.array([time for time, _ in poses])
    entries = []
    for time, depth in zip(depth_times, depths, strict=True):
        nearest = int(np.argmin(np.abs(color_times - time)))
        if abs(color_times[nearest] - time) > MAX_TIME_DIFFERENCE:
            continue
        X_WC = None if not poses else _pose_at(float(time), pose_times, poses)
        entries.append(FramePaths(float(time), depth, colors[nearest], X_WC))
    return sorted(entries, key=lambda entry: entry.time)


def _pose_at(
    time: float, times: FloatArray, poses: list[tuple[float, RigidTransform]]
) -> RigidTransform | None:
    """Interpolates between two close poses, or returns one that is close enough.

    At 0.2 m/s the camera moves by 4 mm in MAX_TIME_DIFFERENCE.
    """
    after = int(np.searchsorted(times, time))
    if 0 < after < len(times) and times[after] - times[after - 1] <= MAX_POSE_GAP:
        (t0, X0), (t1, X1) = poses[after - 1], poses[after]
        share = (time - t0) / (t1 - t0)
        R01 = (X0.rotation().inverse() @ X1.rotation()).matrix()
        turn = share * Rotation.from_matrix(R01).as_rotvec()
        R = X0.rotation().matrix() @ Rotation.from_rotvec(turn).as_matrix()
        p = (1.0 - share) * X0.translation() + share * X1.translation()
        return RigidTransform(RotationMatrix.ProjectToRotationMatrix(R), p)
    nearest = int(np.argmin(np.abs(times - time)))
    if abs(times[nearest] - time) <= MAX_TIME_DIFFERENCE:
        return poses[nearest][1]
    return None


def _numbered_entries(folder: Path, use_poses: bool) -> list[FramePaths]:
    entries = []
    for depth in sorted(folder.glob("*.png")):
        match = _NUMBERED.match(depth.name)
        if match is None:
            continue
        stem = depth.name.replace("depth.png", "{}").replace("depth_", "{}_")
        color = folder / stem.format("color.jpg")
        pose = folder / stem.format("pose.txt")
        if match[2] is not None:
            color = folder / f"color_{match[2]}.jpg"
            pose = folder / f"pose_{match[2]}.txt"
        X_WC = _read_matrix(pose) if use_poses and pose.is_file() else None
        entries.append(FramePaths(float(match[1] or match[2]), depth, color, X_WC))
    return entries


def _read_matrix(path: Path) -> RigidTransform:
    try:
        matrix = np.loadtxt(path).reshape(4, 4)
        R = RotationMatrix.ProjectToRotationMatrix(matrix[:3, :3])
    except (ValueError, RuntimeError) as error:
        raise CloudReadError(
            f"{path}: not a 4 x 4 pose: {error}.", code="PNT-FRAMES-026"
        ) from error
    return RigidTransform(R, matrix[:3, 3])
