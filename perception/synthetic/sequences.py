"""Rendered RGB-D sequences of a wall, with the true and the arm's poses.

The wall lies in T's plane z = 0 (x right, y up, z towards the camera); W is T. Depth is
cast analytically on the wall, its recess and its boxes, and goes through the D435's
forward model; colour is looked up in a picture of the wall and gets sensor noise.
"""

import enum
import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import cv2
import numpy as np
import numpy.typing as npt
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix

from perception.config import StereoConfig
from perception.depth_camera.depth import CameraIntrinsics
from perception.depth_camera.stereo import FloatImage, StereoModel
from perception.ground import FloatArray
from perception.io.frames import Frame

_PIXELS = 800.0
"""Of the wall's picture, a metre; the camera sees about 640 a metre at 0.7 m."""
_MARGIN = 0.8
"""Wall beside the scanned square, m."""
_SPAN = 2.0
_RECESS = (0.75, 0.85, 1.35, 1.55, 0.12)
"""Window: x and y from, x and y to, and its depth, m."""
_BOXES = ((0.25, 0.30, 0.40, 0.50, 0.06), (1.55, 1.10, 1.70, 1.40, 0.04))
"""Boxes on the wall: the same, and how far they stand out, m."""
_COLOR_NOISE = 2.0
"""Standard deviation of a colour pixel, grey levels; as for the peer's runs."""
_LOOKING = RotationMatrix(np.diag([1.0, -1.0, -1.0]))
"""R_TC of a camera that looks straight at the wall."""


class WallKind(enum.StrEnum):
    """What the wall looks like."""

    TEXTURED = "textured"
    PAINTED = "painted"
    WINDOW = "window"
    BLANK = "blank"


_SOLID = (WallKind.PAINTED, WallKind.WINDOW)
"""Walls with a recess and boxes."""


@dataclass(frozen=True, kw_only=True)
class SequenceConfig:
    """One sequence.

    Attributes:
        wall: Its looks; painted and window walls have a recess and boxes.
        rate: Frames a second, Hz.
        speed: Of the camera, m/s.
        distance: From camera to wall, m.
        rows: Of the zig-zag.
        vibration: Amplitude of the camera's sway, m; true, and known to the arm.
        vibration_deg: The same in rotation.
        arm_error: Root mean square of the arm's position error, m; smooth in time.
        arm_error_deg: The same in rotation.
        mount_error: Length of the camera mount's constant position error, m.
        mount_error_deg: The same in rotation.
        base_shift: How far the base moves half way, unknown to the arm, m.
        base_shift_deg: The same in rotation.
        stereo: The camera.
    """

    wall: WallKind = WallKind.TEXTURED
    rate: float = 5.0
    speed: float = 0.2
    distance: float = 0.7
    rows: int = 5
    vibration: float = 0.0015
    vibration_deg: float = 0.3
    arm_error: float = 0.0008
    arm_error_deg: float = 0.03
    mount_error: float = 0.0
    mount_error_deg: float = 0.0
    base_shift: float = 0.0
    base_shift_deg: float = 0.0
    stereo: StereoConfig = field(default_factory=StereoConfig)


def outlines(wall: WallKind) -> list[tuple[float, float, float, float]]:
    """Returns where a wall has steps: x and y from, x and y to, in T, m."""
    if wall not in _SOLID:
        return []
    return [(part[0], part[1], part[2], part[3]) for part in (_RECESS, *_BOXES)]


def distance_to_surface(p_TQs: FloatArray, wall: WallKind) -> FloatArray:
    """Returns how far points are from the nearest surface of a wall.

    Args:
        p_TQs: (3, n) m, in T.
        wall: Which one; its boundless front, its recess and its boxes count.

    Returns:
        (n,) m.
    """
    front = np.abs(p_TQs[2])
    if wall not in _SOLID:
        return np.asarray(front)
    others = np.full_like(front, np.inf)
    *opening, deep = _RECESS
    for x0, y0, x1, y1, height in ((*opening, -deep), *_BOXES):
        low = np.array([[x0], [y0], [min(height, 0.0)]])
        high = np.array([[x1], [y1], [max(height, 0.0)]])
        beside = np.any((p_TQs[:2] <= low[:2]) | (p_TQs[:2] >= high[:2]), axis=0)
        front = np.where(beside, front, np.inf)  # The front has a hole there.
        for axis, value in ((0, x0), (0, x1), (1, y0), (1, y1), (2, height)):
            nearest = np.clip(p_TQs, low, high)
            nearest[axis] = value
            others = np.minimum(others, np.linalg.norm(p_TQs - nearest, axis=0))
    return np.asarray(np.minimum(front, others))


def render_sequence(
    config: SequenceConfig, seed: int
) -> Iterator[tuple[Frame, RigidTransform]]:
    """Renders a zig-zag over 2 x 2 m and back to its start.

    Args:
        config: What to render.
        seed: Of the camera's patterns, the noise and the errors.

    Yields:
        Each frame, whose X_WC is the arm's, and the true X_WC.
    """
    intrinsics = CameraIntrinsics.from_stereo(config.stereo)
    model = StereoModel(config.stereo, seed)
    picture = _wall_picture(config.wall, np.random.default_rng([seed, 1]))
    solid = config.wall in _SOLID
    times, truth, arm = _poses(config, np.random.default_rng([seed, 2]))
    for number, (time, X_WC, X_arm) in enumerate(zip(times, truth, arm, strict=True)):
        rng = np.random.default_rng([seed, 3, number])
        depth, x, y = cast_rays(X_WC, intrinsics, solid)
        depth_mm = model.measure(depth, depth, rng)
        color = _look_up(picture, x, y, rng)
        yield Frame(float(time), depth_mm, color, X_arm), X_WC


def _poses(
    config: SequenceConfig, rng: np.random.Generator
) -> tuple[FloatArray, list[RigidTransform], list[RigidTransform]]:
    """Returns times, true poses and the arm's."""
    low, high = 0.35, _SPAN - 0.35
    heights = np.linspace(0.25, _SPAN - 0.25, config.rows)
    corners = []
    for row, height in enumerate(heights):
        ends = (low, high) if row % 2 == 0 else (high, low)
        corners += [(end, height) for end in ends]
    corners.append(corners[0])
    path = np.array(corners)
    along = np.concatenate(
        [[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))]
    )
    times = np.arange(0.0, along[-1] / config.speed, 1.0 / config.rate)
    x, y = (np.interp(config.speed * times, along, axis) for axis in path.T)
    sway = _smooth(times, rng, 0.5)
    error = _smooth(times, rng, 0.1)
    X_mount = _error(config.mount_error, config.mount_error_deg, rng)
    X_shift = _error(config.base_shift, config.base_shift_deg, rng)
    truth, arm = [], []
    for k in range(times.size):
        X_sway = _small(sway[k], config.vibration, math.radians(config.vibration_deg))
        X_WC = RigidTransform(_LOOKING, [x[k], y[k], config.distance]) @ X_sway
        X_noise = _small(error[k], config.arm_error, math.radians(config.arm_error_deg))
        X_arm = X_WC @ X_noise @ X_mount.inverse()
        if k >= times.size // 2:
            # About the base, which stands a metre in front of the scan's middle.
            X_WB = RigidTransform([_SPAN / 2, 0.5, 1.0])
            X_arm = X_WB @ X_shift.inverse() @ X_WB.inverse() @ X_arm
        truth.append(X_WC)
        arm.append(X_arm)
    return times, truth, arm


def _smooth(
    times: FloatArray, rng: np.random.Generator, frequency: float
) -> FloatArray:
    """Draws (n, 6) smooth signals; vectors of three have unit root mean square."""
    rates = frequency * rng.uniform(0.5, 2.0, (4, 6))
    phases = rng.uniform(0.0, 2.0 * np.pi, (4, 6))
    waves = np.sin(2.0 * np.pi * rates * times[:, None, None] + phases)
    return np.asarray(waves.sum(axis=1) / math.sqrt(2.0 * 3.0))


def _small(unit: FloatArray, length: float, angle: float) -> RigidTransform:
    return RigidTransform(RollPitchYaw(angle * unit[:3]), length * unit[3:])


def _error(length: float, angle_deg: float, rng: np.random.Generator) -> RigidTransform:
    """Draws an error of a given size, in any direction."""
    unit = rng.standard_normal((2, 3))
    unit /= np.linalg.norm(unit, axis=1, keepdims=True)
    return _small(unit.ravel(), length, math.radians(angle_deg))


def _wall_picture(kind: WallKind, rng: np.random.Generator) -> FloatImage:
    """Draws the wall's front, grey levels; row 0 at the bottom."""
    size = round(_PIXELS * (_SPAN + 2 * _MARGIN))
    picture = np.full((size, size), 225.0, dtype=np.float32)
    if kind is WallKind.TEXTURED:
        for sigma, contrast in ((1.0, 22.0), (4.0, 16.0), (20.0, 10.0)):
            noise = rng.standard_normal((size, size), dtype=np.float32)
            blurred = np.asarray(cv2.GaussianBlur(noise, (0, 0), sigma))
            picture += np.float32(contrast / blurred.std()) * blurred
        picture -= np.float32(85.0)
    if kind is WallKind.PAINTED:
        for _ in range(12):  # Pencil marks, 5 cm long and under a pixel wide.
            start = rng.uniform(_MARGIN, _MARGIN + _SPAN, 2) * _PIXELS
            end = start + rng.uniform(-40.0, 40.0, 2)
            ends = [tuple(int(value) for value in point) for point in (start, end)]
            cv2.line(picture, ends[0], ends[1], 205.0, 1, cv2.LINE_AA)
    return np.clip(picture, 5.0, 250.0)


def cast_rays(
    X_WC: RigidTransform, intrinsics: CameraIntrinsics, solid: bool
) -> tuple[FloatImage, FloatImage, FloatImage]:
    """Casts every pixel's ray.

    Args:
        X_WC: Pose of the camera.
        intrinsics: Of the camera.
        solid: Whether the wall has its recess and boxes.

    Returns:
        Depth along C's z (H, W), m, and x and y of what is hit, in T.
    """
    u, v = intrinsics.rays(np.arange(intrinsics.width), np.arange(intrinsics.height))
    R = X_WC.rotation().matrix().astype(np.float32)
    p = X_WC.translation()
    rays = [
        R[i, 0] * u[None, :].astype(np.float32)
        + R[i, 1] * v[:, None].astype(np.float32)
        + R[i, 2]
        for i in range(3)
    ]
    depth: FloatImage = np.float32(-p[2]) / rays[2]
    if solid:
        depth = _into_recess(depth, rays, p)
        for box in _BOXES:
            depth = np.minimum(depth, _box_depth(box, rays, p))
    return depth, p[0] + depth * rays[0], p[1] + depth * rays[1]


def _into_recess(
    depth: FloatImage, rays: list[FloatImage], p: FloatArray
) -> FloatImage:
    """Follows the rays that meet the opening to its back or a side."""
    x0, y0, x1, y1, deep = _RECESS
    x, y = p[0] + depth * rays[0], p[1] + depth * rays[1]
    inside = (x > x0) & (x < x1) & (y > y0) & (y < y1)
    end = np.asarray((-deep - p[2]) / rays[2])
    with np.errstate(divide="ignore", invalid="ignore"):
        for axis, (low, high) in enumerate(((x0, x1), (y0, y1))):
            side = np.where(rays[axis] > 0, high, low)
            end = np.fmin(end, (side - p[axis]) / rays[axis])
    return np.where(inside, end, depth).astype(np.float32)


def _box_depth(
    box: tuple[float, ...], rays: list[FloatImage], p: FloatArray
) -> FloatImage:
    """Returns where the rays enter a box on the wall; inf = they miss it."""
    x0, y0, x1, y1, out = box
    near = np.full_like(rays[0], -np.inf)
    far = np.full_like(rays[0], np.inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        for axis, (low, high) in enumerate(((x0, x1), (y0, y1), (0.0, out))):
            first = np.asarray((low - p[axis]) / rays[axis], dtype=np.float32)
            second = np.asarray((high - p[axis]) / rays[axis], dtype=np.float32)
            near = np.fmax(near, np.fmin(first, second))
            far = np.fmin(far, np.fmax(first, second))
    return np.where(near < far, near, np.inf).astype(np.float32)


def _look_up(
    picture: FloatImage,
    x: FloatImage,
    y: FloatImage,
    rng: np.random.Generator,
) -> npt.NDArray[np.uint8]:
    columns = ((x + _MARGIN) * _PIXELS).astype(np.float32)
    rows = ((y + _MARGIN) * _PIXELS).astype(np.float32)
    grey: FloatImage = np.asarray(
        cv2.remap(
            picture, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
        )
    )
    noise = rng.standard_normal(grey.shape, dtype=np.float32)
    grey = grey + np.float32(_COLOR_NOISE) * noise
    level = np.clip(np.rint(grey), 0, 255).astype(np.uint8)
    return np.repeat(level[:, :, np.newaxis], 3, axis=2)
