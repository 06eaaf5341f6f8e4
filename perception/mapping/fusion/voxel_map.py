"""Voxel map of a wall: fuses points into voxels and returns one surface."""

import dataclasses
import functools
from dataclasses import dataclass
from typing import Self

import numpy as np
import numpy.typing as npt
import open3d as o3d
from pydrake.math import RigidTransform

from perception.config import MapConfig
from perception.depth_camera.windows import moving_max
from perception.ground import FloatArray, FrozenValue, IntArray
from perception.settings import validate
from perception.values import SurfaceMap

_NORMAL_RADIUS = 3.0
"""Normals come from the neighbours within so many voxel sizes."""
_NORMAL_NEIGHBORS = 30


@dataclass(frozen=True, eq=False)
class VoxelMap(FrozenValue):
    """Sums over the points in each voxel, sorted by voxel.

    Voxels are square in the plane of the expected wall and `config.layer` high along
    its normal, with the wall in the middle of a layer. A surface with a few mm of
    depth noise then fills one voxel per column instead of a slab of small ones.

    Attributes:
        X_WV: Grid frame V in W: the expected wall's tile frame.
        width: Of the tile, along V x, m.
        height: Of the tile, along V y, m.
        config: Sizes and thresholds; never changed.
        keys: (N,) int64, ascending, one per voxel; see `_keys`.
        counts: (N,) int64, points fused.
        frames: (N,) int64, pictures that had a point in the voxel.
        sums: (4, N) float64, m and m²: sums of x, y, z and z² of the points in V.
        camera_sums: (3, N) float32, m: sum over `frames` of the camera centres in V.
        p_WCs: (3, n) float64, m, in W: camera centres of the n pictures fused.
    """

    X_WV: RigidTransform
    width: float
    height: float
    config: MapConfig
    keys: IntArray
    counts: IntArray
    frames: IntArray
    sums: FloatArray
    camera_sums: npt.NDArray[np.float32]
    p_WCs: FloatArray

    @classmethod
    def empty(
        cls, X_WV: RigidTransform, width: float, height: float, config: MapConfig
    ) -> Self:
        """Makes an empty map around a tile.

        Args:
            X_WV: Tile frame of the expected wall in W.
            width: Of the tile, m.
            height: Of the tile, m.
            config: Sizes and thresholds; copied.

        Raises:
            ValueError: A setting is out of bounds.
        """
        validate(config, "map")
        return cls(
            X_WV=X_WV,
            width=width,
            height=height,
            config=dataclasses.replace(config),
            keys=np.zeros(0, dtype=np.int64),
            counts=np.zeros(0, dtype=np.int64),
            frames=np.zeros(0, dtype=np.int64),
            sums=np.zeros((4, 0)),
            camera_sums=np.zeros((3, 0), dtype=np.float32),
            p_WCs=np.zeros((3, 0)),
        )

    @property
    def frame_count(self) -> int:
        """Pictures fused so far."""
        return int(self.p_WCs.shape[1])

    def fuse(self, p_WQs: FloatArray, p_WC: FloatArray) -> Self:
        """Adds the points of one picture.

        Args:
            p_WQs: (3, N) float64, m, in W; those outside the tile and its margins are
                dropped.
            p_WC: (3,) m, origin of the camera in W.

        Returns:
            The map with the points added; this one stays as it is.
        """
        X_VW = self.X_WV.inverse()
        p_VQs = X_VW @ p_WQs
        keys, inside = self._keys(p_VQs)
        x, y, z = p_VQs[:, inside]
        voxels, index, counts = np.unique(keys, return_inverse=True, return_counts=True)
        sums = np.stack(
            [np.bincount(index, part, voxels.size) for part in (x, y, z, z * z)]
        )
        # Make room for the voxels that are new, then add to old and new alike.
        place = np.searchsorted(self.keys, voxels)
        new = np.append(self.keys, -1)[place] != voxels
        room = place[new]
        place += np.cumsum(new) - new
        merged_sums = np.insert(self.sums, room, 0.0, axis=1)
        merged_sums[:, place] += sums
        merged_camera_sums = np.insert(self.camera_sums, room, 0.0, axis=1)
        merged_camera_sums[:, place] += (X_VW @ p_WC)[:, np.newaxis]
        merged_counts = np.insert(self.counts, room, 0)
        merged_counts[place] += counts
        merged_frames = np.insert(self.frames, room, 0)
        merged_frames[place] += 1
        return self.replace(
            keys=np.insert(self.keys, room, voxels[new]),
            counts=merged_counts,
            frames=merged_frames,
            sums=merged_sums,
            camera_sums=merged_camera_sums,
            p_WCs=np.column_stack([self.p_WCs, p_WC]),
        )

    @functools.cached_property
    def surface_map(self) -> SurfaceMap:
        """Surface points, one per voxel, in the order of voxels, without outliers.

        A voxel is an outlier if it has fewer than `config.min_count` points, or less
        than `config.outlier_share` of the points or pictures of the best voxel in the
        3 x 3 columns around it. A flying pixel or a false match does not reappear when
        the camera moves; a surface does.
        """
        keys, counts, frames, sums, camera_sums = self._join_layers()
        column = keys // self._shape[2]
        share = self.config.outlier_share
        real = counts >= self.config.min_count
        real &= counts >= share * self._best_around(column, counts)
        real &= frames >= share * self._best_around(column, frames)
        if not real.any():
            return SurfaceMap.empty().replace(frames=self.frame_count, p_WCs=self.p_WCs)
        mean = sums[:, real] / counts[real]
        p_WQs = self.X_WV @ mean[:3]
        p_WCs = self.X_WV @ (camera_sums[:, real] / frames[real])
        return SurfaceMap(
            p_WQs=p_WQs,
            normals_W=_normals(
                p_WQs, p_WCs, radius=_NORMAL_RADIUS * self.config.voxel_size
            ),
            counts=counts[real],
            variances=np.maximum(mean[3] - mean[2] ** 2, 0.0).astype(np.float32),
            frames=self.frame_count,
            p_WCs=self.p_WCs,
        )

    @property
    def _shape(self) -> tuple[int, int, int]:
        """Voxels along V x, y, z; an odd number of layers, the wall in the middle."""
        config = self.config
        return (
            int(np.ceil((self.width + 2 * config.margin) / config.voxel_size)),
            int(np.ceil((self.height + 2 * config.margin) / config.voxel_size)),
            2 * int(np.ceil(config.depth_range / config.layer)) + 1,
        )

    def _keys(self, p_VQs: FloatArray) -> tuple[IntArray, npt.NDArray[np.intp]]:
        """Numbers the voxels: layer by layer up a column, column by column.

        Returns:
            Keys of the points in the box, and the indices of these points.
        """
        config = self.config
        nx, ny, nz = self._shape
        ix = np.floor((p_VQs[0] + config.margin) / config.voxel_size)
        iy = np.floor((p_VQs[1] + config.margin) / config.voxel_size)
        iz = np.rint(p_VQs[2] / config.layer) + nz // 2
        inside = np.flatnonzero(
            (ix >= 0) & (ix < nx) & (iy >= 0) & (iy < ny) & (iz >= 0) & (iz < nz)
        )
        keys = (ix[inside] * ny + iy[inside]) * nz + iz[inside]
        return keys.astype(np.int64), inside

    def _join_layers(
        self,
    ) -> tuple[IntArray, IntArray, IntArray, FloatArray, npt.NDArray[np.float32]]:
        """Joins stacked voxels that hold one surface.

        A surface on the border of two layers fills both. Their means are then much
        closer than the layers; half a layer separates them from a true step.

        Returns:
            Keys (of the lower voxel), counts, frames, sums and camera sums.
        """
        if self.keys.size == 0:
            return self.keys, self.counts, self.frames, self.sums, self.camera_sums
        z = self.sums[2] / self.counts
        apart = np.diff(self.keys) > 1
        apart |= np.diff(self.keys // self._shape[2]) > 0
        apart |= np.diff(z) > self.config.layer / 2
        first = np.flatnonzero(np.concatenate([[True], apart]))
        mean_camera = self.camera_sums[:, first] / self.frames[first]
        frames = np.maximum.reduceat(self.frames, first)
        return (
            self.keys[first],
            np.add.reduceat(self.counts, first),
            frames,
            np.add.reduceat(self.sums, first, axis=1),
            (mean_camera * frames).astype(np.float32),
        )

    def _best_around(self, column: IntArray, values: IntArray) -> IntArray:
        """Returns the largest value in the 3 x 3 columns around each voxel."""
        nx, ny, _ = self._shape
        best = np.zeros(nx * ny, dtype=np.int64)
        np.maximum.at(best, column, values)
        return moving_max(best.reshape(nx, ny), 3).ravel()[column]


def _normals(
    p_WQs: FloatArray, p_WCs: FloatArray, radius: float
) -> npt.NDArray[np.float32]:
    """Fits a plane to the neighbours of each point; normals face the cameras."""
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(p_WQs.T))
    cloud.estimate_normals(
        o3d.geometry.KDTreeSearchParamHybrid(radius=radius, max_nn=_NORMAL_NEIGHBORS)
    )
    normals = np.asarray(cloud.normals).T
    away = np.sum(normals * (p_WCs - p_WQs), axis=0) < 0
    return np.where(away, -normals, normals).astype(np.float32)
