"""Voxels: sums over the points in each, and one surface point from each."""

import itertools
from dataclasses import dataclass
from typing import Self

import numpy as np
import numpy.typing as npt
import open3d as o3d

from perception.ground import BoolArray, FloatArray, FrozenValue, IntArray

_REACH = 1 << 20
"""Voxels along each axis, to either side: 5 km at 5 mm."""
_SPAN = 2 * _REACH
_NORMAL_NEIGHBORS = 30
# Columns of the sums.
_WEIGHT, _XYZ, _Z, _ZZ, _COUNT, _FRAMES = 0, slice(1, 4), 3, 4, 5, 6
_CAMERA, _COLOR = slice(7, 10), slice(10, 13)


@dataclass(frozen=True, eq=False)
class Voxels(FrozenValue):
    """Weighted sums over the points in each voxel of a grid frame V without bounds.

    Voxels are square in V's x and y, along the wall, and `layer` high along z, with the
    wall z = 0 in the middle of a layer. A surface with a few mm of depth noise then
    fills one voxel per column instead of a slab of small ones.

    Attributes:
        cell: Edge along x and y, m.
        layer: Height along z, m.
        keys: (N,) int64, ascending: column by column, each from its lowest layer up.
        sums: (N, 10) float64, or (N, 13) with colours: weight, weighted x, y, z and z²,
            points, pictures, camera centres in V (one per picture), red, green, blue.
    """

    cell: float
    layer: float
    keys: IntArray
    sums: FloatArray

    @classmethod
    def empty(cls, cell: float, layer: float, *, colored: bool = False) -> Self:
        """Makes a grid without points."""
        sums = np.zeros((0, 13 if colored else 10))
        return cls(cell, layer, np.zeros(0, np.int64), sums)

    @property
    def p_VQs(self) -> FloatArray:
        """(3, N) m, in V, weighted means of the points."""
        return np.asarray((self.sums[:, _XYZ] / self.sums[:, :1]).T)

    @property
    def p_VCs(self) -> FloatArray:
        """(3, N) m, in V, means of the camera centres."""
        cameras = self.sums[:, _CAMERA] / self.sums[:, _FRAMES, np.newaxis]
        return np.asarray(cameras.T)

    @property
    def variances(self) -> FloatArray:
        """(N,) m², of the points along z."""
        z, zz = (self.sums[:, row] / self.sums[:, _WEIGHT] for row in (_Z, _ZZ))
        return np.maximum(zz - z**2, 0.0)

    @property
    def counts(self) -> IntArray:
        """(N,) int64, points."""
        return self.sums[:, _COUNT].astype(np.int64)

    @property
    def frames(self) -> IntArray:
        """(N,) int64, pictures that had a point in the voxel."""
        return self.sums[:, _FRAMES].astype(np.int64)

    @property
    def colors(self) -> npt.NDArray[np.uint8]:
        """(N, 3) uint8, RGB, means of the points."""
        means = self.sums[:, _COLOR] / self.sums[:, _COUNT, np.newaxis]
        return np.rint(means).astype(np.uint8)

    def add(
        self,
        p_VQs: FloatArray,
        p_VC: FloatArray,
        weights: FloatArray | None = None,
        colors: npt.NDArray[np.uint8] | None = None,
    ) -> Self:
        """Returns the voxels with the points of one picture added.

        Args:
            p_VQs: (3, N) m, in V.
            p_VC: (3,) m, camera centre in V.
            weights: (N,) of the points; None = all one.
            colors: (N, 3) uint8, RGB; given if the grid is coloured.
        """
        x, y, z = p_VQs
        i, j = (np.floor(along / self.cell).astype(np.int64) for along in (x, y))
        k = np.rint(z / self.layer).astype(np.int64)
        keys, index, counts = np.unique(
            ((i + _REACH) * _SPAN + j + _REACH) * _SPAN + k + _REACH,
            return_inverse=True,
            return_counts=True,
        )
        values = [x, y, z, z * z]
        if weights is not None:
            values = [weights, *(weights * value for value in values)]
        values += [] if colors is None else list(colors.T)
        sums: list[FloatArray] = [
            np.asarray(np.bincount(index, value, keys.size), dtype=float)
            for value in values
        ]
        if weights is None:
            sums.insert(_WEIGHT, counts.astype(float))
        once = np.ones(keys.size)
        sums[_COUNT:_COUNT] = [
            counts.astype(float),
            once,
            *(p_VC[:, np.newaxis] * once),
        ]
        # Make room for the voxels that are new, then add to old and new alike.
        place = np.searchsorted(self.keys, keys)
        new = np.append(self.keys, -1)[place] != keys
        merged = np.insert(self.sums, place[new], 0.0, axis=0)
        merged[place + np.cumsum(new) - new] += np.stack(sums, axis=1)
        merged_keys = np.insert(self.keys, place[new], keys[new])
        return self.replace(keys=merged_keys, sums=merged)

    def selected(self, chosen: BoolArray) -> Self:
        """Returns some of the voxels."""
        return self.replace(keys=self.keys[chosen], sums=self.sums[chosen])

    def surface(self, min_count: int, outlier_share: float) -> Self:
        """Returns one voxel per surface and column, without outliers.

        A voxel is an outlier if it has fewer than `min_count` points, or less than
        `outlier_share` of the points or pictures of the best voxel in the 3 x 3 columns
        around it. A flying pixel or a false match does not reappear when the camera
        moves; a surface does.
        """
        if not self.keys.size:
            return self
        joined = self._joined()
        values = joined.sums[:, _COUNT : _FRAMES + 1]
        enough = values >= outlier_share * joined._best_around(values)
        return joined.selected((values[:, 0] >= min_count) & enough.all(axis=1))

    def _joined(self) -> Self:
        """Joins stacked voxels that hold one surface.

        A surface on the border of two layers fills both. Their means are then much
        closer than the layers; half a layer separates them from a true step.
        """
        apart = np.diff(self.keys) > 1
        apart |= np.diff(self.p_VQs[2]) > self.layer / 2
        first = np.flatnonzero(np.concatenate([[True], apart]))
        sums = np.add.reduceat(self.sums, first)
        sums[:, _FRAMES] = np.maximum.reduceat(self.sums[:, _FRAMES], first)
        sums[:, _CAMERA] = (self.p_VCs[:, first] * sums[:, _FRAMES]).T
        return self.replace(keys=self.keys[first], sums=sums)

    def _best_around(self, values: FloatArray) -> FloatArray:
        """Returns the largest (N, c) values in the 3 x 3 columns around each voxel."""
        column = self.keys // _SPAN
        first = np.flatnonzero(np.diff(column, prepend=-1))
        columns, own = column[first], np.maximum.reduceat(values, first)
        best = own.copy()
        for i, j in itertools.product((-1, 0, 1), repeat=2):
            beside = columns + i * _SPAN + j
            place = np.minimum(np.searchsorted(columns, beside), columns.size - 1)
            found = (columns[place] == beside)[:, np.newaxis]
            best = np.maximum(best, np.where(found, own[place], 0.0))
        return np.repeat(best, np.diff(first, append=column.size), axis=0)


def normals_of(p_WQs: FloatArray, p_WCs: FloatArray, radius: float) -> FloatArray:
    """Fits a plane to the neighbours of each point.

    Args:
        p_WQs: (3, N) m, in W.
        p_WCs: (3, N) m, in W, camera centres of the points.
        radius: Of the neighbours, m.

    Returns:
        (3, N) unit normals in W that face the cameras.
    """
    if not p_WQs.size:
        return np.zeros((3, 0))  # Open3D would warn of it on stdout.
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(p_WQs.T))
    cloud.estimate_normals(
        o3d.geometry.KDTreeSearchParamHybrid(radius=radius, max_nn=_NORMAL_NEIGHBORS)
    )
    normals = np.asarray(cloud.normals).T
    away = np.sum(normals * (p_WCs - p_WQs), axis=0) < 0
    return np.where(away, -normals, normals)
