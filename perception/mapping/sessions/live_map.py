"""The map while the arm scans: fused at once, corrected on request."""

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
    """A fused picture, kept so that it can be fused again at a corrected pose.

    Attributes:
        picture: Its pixels.
        X_WN: Pose of the nominal camera by the arm.
        keyframe: Number of the last keyframe when it was taken.
    """

    picture: ThinPicture
    X_WN: RigidTransform
    keyframe: int


@dataclass(frozen=True, eq=False)
class LiveMap(FrozenValue):
    """One map of the wall, fused at the arm's poses and corrected by a pose graph.

    Incoming pictures are fused at the poses of arm and mount, which is cheap. When the
    surface is requested, while the arm stands still, the pose graph is solved. If that
    moves the surface by more than `PoseGraphConfig.refuse_distance`, all pictures are
    fused again at their corrected poses. Otherwise the arm's poses stand: a scan by a
    good arm gives the same map, to the bit, as without the graph.

    Time and memory are bounded by one tile's scan: a restart drops the pictures. Use a
    `Mapper` for longer sequences.

    Attributes:
        voxels: Fused at the arm's poses and `X_NC`.
        pictures: Those in `voxels`.
        graph: Keyframes of all pictures, also of those before the last restart.
        X_NC: The mount's error as estimated at the last restart: pose of the camera in
            the nominal camera frame of the arm's model.
    """

    voxels: VoxelMap
    pictures: tuple[FusedPicture, ...]
    graph: KeyframeGraph
    X_NC: RigidTransform

    @classmethod
    def empty(
        cls,
        X_WV: RigidTransform,
        size: tuple[float, float],
        config: MapConfig,
        intrinsics: CameraIntrinsics,
        graph_config: PoseGraphConfig,
    ) -> Self:
        """Makes an empty map around a tile.

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
        """Returns an empty map in another tile frame; keeps the graph and the mount.

        Args:
            X_WV: Tile frame of the wall that was found, in W.
        """
        old = self.voxels
        voxels = VoxelMap.empty(X_WV, old.width, old.height, old.config)
        X_NC = self.solution.mount if self.is_moved else self.X_NC
        return self.replace(voxels=voxels, pictures=(), X_NC=X_NC)

    def fused(self, time: float, depth_mm: DepthImage, X_WN: RigidTransform) -> Self:
        """Returns the map with one more picture.

        Args:
            time: When it was taken, s.
            depth_mm: (H, W) uint16, mm, 0 = no return.
            X_WN: Pose of the nominal camera by the arm.

        Raises:
            ValueError: The picture is not of the camera's size.
        """
        config, intrinsics = self.voxels.config, self.graph.intrinsics
        usable = usable_pixels(depth_mm, config)
        p_CQs = depth_points(depth_mm, usable, intrinsics, config.stride)
        graph = self._with_keyframe(time, depth_mm, usable, X_WN)
        thin = ThinPicture.of(depth_mm, usable, config.stride)
        picture = FusedPicture(thin, X_WN, len(graph.keyframes) - 1)
        X_WC = X_WN @ self.X_NC
        return self.replace(
            voxels=self.voxels.fuse(X_WC @ p_CQs, X_WC.translation()),
            pictures=(*self.pictures, picture),
            graph=graph,
        )

    @functools.cached_property
    def solution(self) -> Solution:
        """The optimised pose graph."""
        return self.graph.solved()

    @functools.cached_property
    def moved_by(self) -> float:
        """How far the solution moves the points in the voxels, root mean square, m."""
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
        """Whether `moved_by` exceeds `PoseGraphConfig.refuse_distance`."""
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
        """Returns the pose at which keyframe k was fused."""
        X_WN = self.graph.keyframes[k].X_WN
        assert X_WN is not None  # Every keyframe here was made with one.
        return X_WN @ self.X_NC

    def _with_keyframe(
        self,
        time: float,
        depth_mm: DepthImage,
        usable: BoolArray,
        X_WN: RigidTransform,
    ) -> KeyframeGraph:
        graph = self.graph
        if graph.keyframes:
            X_before = graph.keyframes[-1].X_WN
            if X_before is not None and not graph.is_new(X_before.inverse() @ X_WN):
                return graph
        number = len(graph.keyframes)
        z = mean_depth(depth_mm, usable)
        planes = see_planes(grid_of(z, graph.intrinsics), graph.config, number)
        sample = sample_of(z, graph.intrinsics)
        keyframe = Keyframe(number, time, X_WN, tuple(planes), sample, View(z))
        return graph.extended(keyframe, X_WN @ self.X_NC)

    def _fused_again(self) -> VoxelMap:
        """Fuses all pictures at their corrected poses."""
        old, intrinsics = self.voxels, self.graph.intrinsics
        voxels = VoxelMap.empty(old.X_WV, old.width, old.height, old.config)
        for fused in self.pictures:
            k, thin = fused.keyframe, fused.picture
            depth_mm = thin.depth_mm
            p_CQs = depth_points(depth_mm, depth_mm > 0, thin.camera(intrinsics))
            X_KC = self._X_WCf(k).inverse() @ fused.X_WN @ self.X_NC
            X_WC = self.solution.graph.poses[k] @ X_KC
            voxels = voxels.fuse(X_WC @ p_CQs, X_WC.translation())
        return voxels
