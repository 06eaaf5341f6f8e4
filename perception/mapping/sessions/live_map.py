"""The map while the arm scans: fused at once, and corrected when it is asked for."""

import functools
from dataclasses import dataclass
from typing import Self

import numpy as np
from pydrake.math import RigidTransform

from perception.config import MapConfig
from perception.depth_camera.depth import CameraIntrinsics, depth_points, usable_pixels
from perception.ground import BoolArray, FrozenValue
from perception.io.frames import DepthImage
from perception.mapping.config import PoseGraphConfig
from perception.mapping.fusion.voxel_map import VoxelMap
from perception.mapping.keyframes.keyframe import (
    Keyframe,
    grid_of,
    mean_depth,
    sample_of,
    see_planes,
)
from perception.mapping.keyframes.view import ThinPicture, View
from perception.mapping.pose_graph.keyframe_graph import KeyframeGraph, Solution
from perception.values import SurfaceMap


@dataclass(frozen=True, eq=False)
class FusedPicture(FrozenValue):
    """A picture as it went into the voxels, kept to be fused again elsewhere.

    Attributes:
        picture: Its pixels.
        X_arm: Where the arm says that it was taken, in W.
        keyframe: Number of the keyframe that it goes with.
    """

    picture: ThinPicture
    X_arm: RigidTransform
    keyframe: int


@dataclass(frozen=True, eq=False)
class LiveMap(FrozenValue):
    """One map of the wall, fused by the arm's poses and put right by what it shows.

    While pictures come they are fused where arm and mount say, which costs little. When
    the surface is asked for, and the arm stands still, the pose graph is solved; if
    that moves the surface by more than `PoseGraphConfig.refuse_distance`, all pictures
    are fused again where they really were taken. Below that the arm is believed: a scan
    by a good arm gives the same map, to the bit, as without the graph.

    Time and memory are those of one tile's scan: a restart drops the pictures. What is
    to go on for longer is a `Mapper`'s work.

    Attributes:
        voxels: Fused by the arm's poses and `X_CCm`.
        pictures: What is in them.
        graph: Keyframes of all pictures, also of those before the last restart.
        X_CCm: The mount's error as known at the last restart: where the camera is, seen
            from where the arm's model has it.
    """

    voxels: VoxelMap
    pictures: tuple[FusedPicture, ...]
    graph: KeyframeGraph
    X_CCm: RigidTransform

    @classmethod
    def empty(
        cls,
        X_WV: RigidTransform,
        size: tuple[float, float],
        config: MapConfig,
        intrinsics: CameraIntrinsics,
        graph_config: PoseGraphConfig,
    ) -> Self:
        """Makes a map of nothing round a tile.

        Args:
            X_WV: Tile frame of the expected wall in W.
            size: Width and height of the tile, m.
            config: Of the voxels.
            intrinsics: Of the depth camera.
            graph_config: Of the pose graph.

        Raises:
            ValueError: A setting is out of bounds.
        """
        graph = KeyframeGraph.empty(intrinsics, graph_config)
        voxels = VoxelMap.empty(X_WV, *size, config)
        return cls(voxels, (), graph, RigidTransform())

    def restarted(self, X_WV: RigidTransform) -> Self:
        """Returns a map of nothing in another tile frame, with what was learned.

        Args:
            X_WV: Tile frame of the wall that was found, in W.
        """
        old = self.voxels
        voxels = VoxelMap.empty(X_WV, old.width, old.height, old.config)
        X_CCm = self.solution.mount if self.is_moved else self.X_CCm
        return self.replace(voxels=voxels, pictures=(), X_CCm=X_CCm)

    def fused(self, time: float, depth_mm: DepthImage, X_arm: RigidTransform) -> Self:
        """Returns the map with a picture more.

        Args:
            time: When it was taken, s.
            depth_mm: (H, W) uint16, mm, 0 = no return.
            X_arm: Where the arm says that it was taken, in W.

        Raises:
            ValueError: The picture is not of the camera's size.
        """
        config, intrinsics = self.voxels.config, self.graph.intrinsics
        usable = usable_pixels(depth_mm, config)
        p_CQs = depth_points(depth_mm, usable, intrinsics, config.stride)
        graph = self._with_keyframe(time, depth_mm, usable, X_arm)
        thin = ThinPicture.of(depth_mm, usable, config.stride)
        picture = FusedPicture(thin, X_arm, len(graph.keyframes) - 1)
        X_WC = X_arm @ self.X_CCm
        return self.replace(
            voxels=self.voxels.fuse(X_WC @ p_CQs, X_WC.translation()),
            pictures=(*self.pictures, picture),
            graph=graph,
        )

    @functools.cached_property
    def solution(self) -> Solution:
        """The pose graph's answer."""
        return self.graph.solved()

    @functools.cached_property
    def moved_by(self) -> float:
        """How far the answer moves what is in the voxels, root mean square, m."""
        squares = []
        for k in sorted({picture.keyframe for picture in self.pictures}):
            X_CfC = self._X_WCf(k).inverse() @ self.solution.graph.poses[k]
            points = self.graph.keyframes[k].sample.astype(float)
            if points.size:
                away = X_CfC @ points - points
                squares.append(np.mean(np.sum(away**2, axis=0)))
        return float(np.sqrt(np.mean(squares))) if squares else 0.0

    @property
    def is_moved(self) -> bool:
        """Whether that is more than may be left as it is."""
        return self.moved_by > self.graph.config.refuse_distance

    @functools.cached_property
    def surface_map(self) -> SurfaceMap:
        """The surface, in W."""
        if not self.pictures:
            return self.voxels.surface_map
        surface = (self._fused_again() if self.is_moved else self.voxels).surface_map
        tilt = np.linalg.norm(self.solution.estimate.mount[:3])
        return surface.replace(mount_tilt=float(tilt))

    def _X_WCf(self, k: int) -> RigidTransform:
        """Returns where keyframe k was fused."""
        X_arm = self.graph.keyframes[k].X_arm
        assert X_arm is not None  # Every keyframe here was made with one.
        return X_arm @ self.X_CCm

    def _with_keyframe(
        self,
        time: float,
        depth_mm: DepthImage,
        usable: BoolArray,
        X_arm: RigidTransform,
    ) -> KeyframeGraph:
        graph = self.graph
        if graph.keyframes:
            X_before = graph.keyframes[-1].X_arm
            if X_before is not None and not graph.is_new(X_before.inverse() @ X_arm):
                return graph
        number = len(graph.keyframes)
        z = mean_depth(depth_mm, usable)
        planes = see_planes(grid_of(z, graph.intrinsics), graph.config, number)
        sample = sample_of(z, graph.intrinsics)
        keyframe = Keyframe(number, time, X_arm, tuple(planes), sample, View(z))
        return graph.extended(keyframe, X_arm @ self.X_CCm)

    def _fused_again(self) -> VoxelMap:
        """Fuses all pictures where the graph's answer has them."""
        old, intrinsics = self.voxels, self.graph.intrinsics
        voxels = VoxelMap.empty(old.X_WV, old.width, old.height, old.config)
        for fused in self.pictures:
            k, thin = fused.keyframe, fused.picture
            depth_mm = thin.depth_mm
            p_CQs = depth_points(depth_mm, depth_mm > 0, thin.camera(intrinsics))
            X_KC = self._X_WCf(k).inverse() @ fused.X_arm @ self.X_CCm
            X_WC = self.solution.graph.poses[k] @ X_KC
            voxels = voxels.fuse(X_WC @ p_CQs, X_WC.translation())
        return voxels
