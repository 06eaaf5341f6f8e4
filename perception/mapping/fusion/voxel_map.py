"""Voxel map of a tile: fuses pictures one by one and returns one surface."""

import dataclasses
import functools
from dataclasses import dataclass
from typing import Self

import numpy as np
from pydrake.math import RigidTransform

from perception.config import MapConfig
from perception.ground import FloatArray, FrozenValue
from perception.mapping.fusion.voxels import Voxels, normals_of
from perception.settings import validate
from perception.values import SurfaceMap

_NORMAL_RADIUS = 3.0
"""Normals come from the neighbours within so many voxel sizes."""


@dataclass(frozen=True, eq=False)
class VoxelMap(FrozenValue):
    """Voxels in a box around a tile of the expected wall.

    Attributes:
        X_WV: Grid frame V in W: the expected wall's tile frame.
        width: Of the tile, along V x, m.
        height: Of the tile, along V y, m.
        config: Sizes and thresholds; never changed.
        voxels: Sums over the points.
        p_WCs: (3, n) float64, m, in W: camera centres of the n pictures fused.
    """

    X_WV: RigidTransform
    width: float
    height: float
    config: MapConfig
    voxels: Voxels
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
        voxels = Voxels.empty(config.voxel_size, config.layer)
        copy = dataclasses.replace(config)
        return cls(X_WV, width, height, copy, voxels, np.zeros((3, 0)))

    @property
    def frame_count(self) -> int:
        """Pictures fused so far."""
        return int(self.p_WCs.shape[1])

    def fuse(self, p_WQs: FloatArray, p_WC: FloatArray) -> Self:
        """Adds the points of one picture.

        Args:
            p_WQs: (3, N) float64, m, in W; those outside the tile, its margins and
                `config.depth_range` are dropped.
            p_WC: (3,) m, camera centre in W.

        Returns:
            The map with the points added; this one stays as it is.
        """
        X_VW, config = self.X_WV.inverse(), self.config
        x, y, z = p_VQs = X_VW @ p_WQs
        inside = (x >= -config.margin) & (x < self.width + config.margin)
        inside &= (y >= -config.margin) & (y < self.height + config.margin)
        inside &= np.abs(z) < config.depth_range
        return self.replace(
            voxels=self.voxels.add(p_VQs[:, inside], X_VW @ p_WC),
            p_WCs=np.column_stack([self.p_WCs, p_WC]),
        )

    @functools.cached_property
    def surface_map(self) -> SurfaceMap:
        """Surface points without outliers, in the order of voxels; see `Voxels`."""
        config = self.config
        surface = self.voxels.surface(config.min_count, config.outlier_share)
        p_WQs, p_WCs = self.X_WV @ surface.p_VQs, self.X_WV @ surface.p_VCs
        normals_W = normals_of(p_WQs, p_WCs, _NORMAL_RADIUS * config.voxel_size)
        return SurfaceMap(
            p_WQs=p_WQs,
            normals_W=normals_W.astype(np.float32),
            counts=surface.counts,
            variances=surface.variances.astype(np.float32),
            frames=self.frame_count,
            p_WCs=self.p_WCs,
        )
