"""Data of one frame: a grid of oriented points, planes and features."""

from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np
import numpy.typing as npt
from pydrake.math import RigidTransform

from perception.config import MapConfig
from perception.depth_camera.depth import CameraIntrinsics, usable_pixels
from perception.ground import BoolArray, FloatArray, FrozenValue
from perception.io.frames import DepthImage, Frame
from perception.mapping.config import MapperConfig, PoseGraphConfig
from perception.mapping.keyframes.view import Features, ThinPicture, View
from perception.paper_steps.planes import fit_plane, ransac_plane

BLOCK = 8
"""Edge of a block, px: the noise of its mean depth is a third of a pixel's."""
_SAMPLED = 16
"""Every so many-th block is compared between two views."""
_FILLED = 0.75
"""Least share of usable pixels of a block."""
_STEP = 0.02
"""Neighbouring grid points farther apart than this share of depth are a step."""
_NOISE_RANGE = 0.7
"""Range of `MapperConfig.plane_threshold`, m; noise grows with its square."""
_MOST_PLANES = 3


@dataclass(frozen=True, eq=False)
class PlaneSight(FrozenValue):
    """A plane as one keyframe sees it.

    Attributes:
        center: (3,) m, in C, mean of its points.
        normal: (3,) unit, in C, towards the camera.
        axes: (3, 2) unit, in C, in the plane.
        sigma: Standard deviation of the distance, m.
        tilt_sigma: (2,) rad, of the tilts of the two axes.
        share: Of the keyframe's points.
    """

    center: FloatArray
    normal: FloatArray
    axes: FloatArray
    sigma: float
    tilt_sigma: FloatArray
    share: float


@dataclass(frozen=True, eq=False)
class PointGrid(FrozenValue):
    """Mean points of blocks of pixels.

    Attributes:
        points: (h, w, 3) m, in C.
        normals: (h, w, 3) unit, in C, towards the camera; 0 = unknown.
        valid: (h, w) bool, has a point.
    """

    points: FloatArray
    normals: FloatArray
    valid: BoolArray


class ViewSource(Protocol):
    """Holds a view in memory or reads it back."""

    def view(self) -> View:
        """Returns the view."""


@dataclass(frozen=True, eq=False)
class Keyframe(FrozenValue):
    """The data kept of a frame, without its full pictures.

    Attributes:
        number: Of the frame, counted from 0.
        time: s.
        X_WN: Pose of the nominal camera by the arm; None = unknown.
        planes: Largest first.
        sample: (3, n) float32, m, in C, some of its mean points; see `sample_of`.
        source: Of the view, which takes most memory.
    """

    number: int
    time: float
    X_WN: RigidTransform | None
    planes: tuple[PlaneSight, ...]
    sample: npt.NDArray[np.float32]
    source: ViewSource

    @property
    def z(self) -> npt.NDArray[np.float32]:
        """(h, w) m, mean depth of blocks of pixels, 0 = none; see `grid_of`."""
        return self.source.view().z

    @property
    def features(self) -> Features:
        """Its corners."""
        return self.source.view().features

    @property
    def picture(self) -> ThinPicture | None:
        """Pixels for the fusion; None = kept elsewhere."""
        return self.source.view().picture

    def grid(self, intrinsics: CameraIntrinsics) -> PointGrid:
        """Returns its mean points with normals."""
        return grid_of(self.z, intrinsics)


def make_keyframe(
    frame: Frame,
    number: int,
    features: Features,
    intrinsics: CameraIntrinsics,
    config: MapperConfig,
) -> Keyframe:
    """Makes a keyframe of a frame.

    Args:
        frame: The frame.
        number: Its number, counted from 0; also the seed of its planes.
        features: Its corners.
        intrinsics: Of the camera.
        config: Thresholds and sigmas.
    """
    usable = usable_pixels(frame.depth_mm, MapConfig(max_range=config.max_range))
    z = mean_depth(frame.depth_mm, usable)
    picture = ThinPicture.of(frame.depth_mm, usable, config.stride, frame.color)
    return Keyframe(
        number=number,
        time=frame.time,
        X_WN=frame.X_WC,
        planes=tuple(see_planes(grid_of(z, intrinsics), config, number)),
        sample=sample_of(z, intrinsics),
        source=View(z, features, picture),
    )


def mean_depth(depth_mm: DepthImage, usable: BoolArray) -> npt.NDArray[np.float32]:
    """Averages depth over blocks of BLOCK x BLOCK pixels.

    Args:
        depth_mm: (H, W) uint16, mm, 0 = no return.
        usable: (H, W) bool, pixels to average.

    Returns:
        (H // BLOCK, W // BLOCK) float32, m; 0 where too few pixels are usable.
    """
    rows, columns = depth_mm.shape[0] // BLOCK, depth_mm.shape[1] // BLOCK
    shape = (rows, BLOCK, columns, BLOCK)
    cut = np.s_[: rows * BLOCK, : columns * BLOCK]
    weight = usable[cut].reshape(shape)
    count = weight.sum(axis=(1, 3))
    total = np.where(weight, depth_mm[cut].reshape(shape), 0).sum(axis=(1, 3))
    valid = count >= _FILLED * BLOCK * BLOCK
    mean = np.where(valid, total / np.maximum(count, 1) / 1000.0, 0.0)
    return mean.astype(np.float32)


def grid_of(z: npt.NDArray[np.float32], intrinsics: CameraIntrinsics) -> PointGrid:
    """Places mean depths on the rays of their blocks and finds normals between them.

    Args:
        z: (h, w) float32, m, 0 = none; see `mean_depth`.
        intrinsics: Of the camera.
    """
    row, column = np.arange(z.shape[0])[:, None], np.arange(z.shape[1])
    points = np.moveaxis(_on_rays(row, column, z.astype(float), intrinsics), 0, 2)
    valid = z > 0
    return PointGrid(points, _normals(points, valid), valid)


def sample_of(
    z: npt.NDArray[np.float32], intrinsics: CameraIntrinsics
) -> npt.NDArray[np.float32]:
    """Returns every `_SAMPLED`-th mean point, (3, n) float32, m, in C.

    Args:
        z: (h, w) float32, m, 0 = none; see `mean_depth`.
        intrinsics: Of the camera.
    """
    row, column = (index[::_SAMPLED] for index in np.nonzero(z))
    points = _on_rays(row, column, z[row, column].astype(float), intrinsics)
    return points.astype(np.float32)


def _on_rays(
    row: npt.NDArray[np.intp],
    column: npt.NDArray[np.intp],
    z: FloatArray,
    intrinsics: CameraIntrinsics,
) -> FloatArray:
    """Returns the points at depth z on the middles of blocks, stacked x, y, z."""
    middle = (BLOCK - 1) / 2.0
    return intrinsics.backproject(BLOCK * column + middle, BLOCK * row + middle, z)


def _normals(points: FloatArray, valid: BoolArray) -> FloatArray:
    across, down = np.zeros_like(points), np.zeros_like(points)
    across[:, 1:-1] = points[:, 2:] - points[:, :-2]
    down[1:-1] = points[2:] - points[:-2]
    known = valid.copy()
    known[:, [0, -1]] = known[[0, -1]] = False
    known[:, 1:-1] &= valid[:, 2:] & valid[:, :-2]
    known[1:-1] &= valid[2:] & valid[:-2]
    limit = 2.0 * BLOCK * _STEP * np.maximum(points[:, :, 2], 1e-6) / 4.0
    known &= (np.abs(across[:, :, 2]) < limit) & (np.abs(down[:, :, 2]) < limit)
    normals = np.cross(down, across)
    normals /= np.maximum(np.linalg.norm(normals, axis=2, keepdims=True), 1e-12)
    normals *= np.where(np.sum(normals * points, axis=2) > 0, -1.0, 1.0)[:, :, None]
    return np.where(known[:, :, None], normals, 0.0)


def see_planes(grid: PointGrid, config: PoseGraphConfig, seed: int) -> list[PlaneSight]:
    """Finds the largest planes in a keyframe.

    Args:
        grid: Its points.
        config: `plane_threshold`, `plane_share` and the sigmas are used.
        seed: Of RANSAC's random triples.

    Returns:
        Up to three, the largest first.
    """
    points = grid.points[grid.valid].T
    total = points.shape[1]
    rng = np.random.default_rng(seed)
    sights: list[PlaneSight] = []
    while len(sights) < _MOST_PLANES and points.shape[1] >= config.plane_share * total:
        typical = float(np.median(points[2])) / _NOISE_RANGE if points.size else 1.0
        threshold = config.plane_threshold * max(1.0, typical**2)
        found = ransac_plane(points, threshold=threshold, rng=rng)
        if found is None:
            break
        _, inliers = found
        share = np.count_nonzero(inliers) / total
        if share < config.plane_share:
            break
        sights.append(_sight(points[:, inliers], share, config))
        points = points[:, ~inliers]
    return sights


def _sight(points: FloatArray, share: float, config: PoseGraphConfig) -> PlaneSight:
    plane = fit_plane(points)
    center = points.mean(axis=1)
    normal = plane.normal * (-1.0 if plane.normal @ center > 0 else 1.0)
    axes = np.linalg.svd(normal[None])[2][1:].T
    spread = np.std(axes.T @ (points - center[:, None]), axis=1)
    # Noise of neighbouring blocks is correlated: a quarter count as independent.
    noise = plane.rms / np.sqrt(points.shape[1] / 4.0)
    return PlaneSight(
        center=center,
        normal=normal,
        axes=axes,
        sigma=float(np.hypot(noise, config.plane_sigma)),
        tilt_sigma=np.hypot(
            noise / np.maximum(spread, 1e-3), np.deg2rad(config.plane_sigma_deg)
        ),
        share=share,
    )


def find_features(
    frame: Frame, intrinsics: CameraIntrinsics, config: PoseGraphConfig
) -> Features:
    """Finds corners that have depth, spread over the picture, with ORB descriptors."""
    grey = cv2.cvtColor(frame.color, cv2.COLOR_RGB2GRAY)
    orb = cv2.ORB.create(nfeatures=config.features, fastThreshold=15, nlevels=4)
    corners, descriptors = orb.detectAndCompute(grey, None)
    if descriptors is None:
        return Features.none()
    uv = np.array([corner.pt for corner in corners])
    column, row = np.rint(uv).astype(int).T
    z = _median_depth(frame.depth_mm)[row, column] / 1000.0
    seen = (z > 0) & (z <= config.max_range)
    p_Cs = np.ascontiguousarray(intrinsics.backproject(uv[:, 0], uv[:, 1], z).T)
    return Features(
        uv[seen], p_Cs[seen], np.asarray(descriptors)[seen].astype(np.uint8)
    )


def _median_depth(depth_mm: DepthImage) -> DepthImage:
    return np.asarray(cv2.medianBlur(depth_mm, 5)).astype(np.uint16)
