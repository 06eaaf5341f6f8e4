"""Fuses depth pictures into one map of the wall, and corrects it."""

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, EventStatus, State
from pydrake.systems.sensors import ImageDepth16U

from painter.planning.config import TileConfig
from painter.systems.ports import DeclareInputs, EvalAs
from painter.systems.value_system import ValueSystem
from painter.systems.values import StageResult
from perception.config import MapConfig
from perception.depth_camera.depth import CameraIntrinsics
from perception.ground import FrozenValue
from perception.mapping.config import PoseGraphConfig
from perception.mapping.sessions.live_map import LiveMap
from perception.values import Wall

ACCUMULATOR_INPUTS = {
    "depth_image": ImageDepth16U(),
    "image_time": 1,
    "X_WC": RigidTransform(),
    "wall": StageResult(),
    "enabled": 1,
}


@dataclass(frozen=True, eq=False)
class MapProgress(FrozenValue):
    """The map and what is already in it.

    Attributes:
        map: The map.
        image_time: Time of the last picture fused, s; -1 = none yet.
        wall_number: Number of the StageResult whose tile frame the map uses; 0 = the
            nominal one.
    """

    map: LiveMap
    image_time: float = -1.0
    wall_number: int = 0


class MapAccumulator(ValueSystem):
    """Fuses depth pictures into one map in the wall's tile frame.

    .. pydrake_system::

        name: MapAccumulator
        input_ports:
        - depth_image
        - image_time
        - X_WC
        - wall
        - enabled
        output_ports:
        - surface_map

    Ports:
        depth_image: ImageDepth16U, mm, 0 = no return.
        image_time: (1,) s, when it was taken; negative before the first.
        X_WC: RigidTransform, pose of the camera at `image_time`; read only when there
            is a new picture.
        wall: StageResult; each new one that holds a Wall restarts the map in that
            wall's tile frame. May be left unconnected.
        enabled: (1,); 0 = fuse nothing. May be left unconnected: fuse all.
        surface_map: SurfaceMap in W of all pictures fused since the last restart, at
            the arm's poses as the pose graph corrects them; see `LiveMap`. Evaluating
            it takes up to some seconds, once after each picture.

    State is one MapProgress, updated every `period` s, first at t = 0. Each picture is
    fused once; one taken while `enabled` was 0 is not fused later unless it is still
    the last one.
    """

    def __init__(
        self,
        *,
        config: MapConfig,
        pose_graph: PoseGraphConfig,
        intrinsics: CameraIntrinsics,
        tile: TileConfig,
        X_WT: RigidTransform,
        period: float,
    ) -> None:
        """Creates the system.

        Args:
            config: Of the map.
            pose_graph: Of the correction of the arm's poses.
            intrinsics: Of the depth camera.
            tile: Gives the size.
            X_WT: Expected pose of the tile, until `wall` gives a better one.
            period: Time between checks for a new picture, s.

        Raises:
            ValueError: A setting is out of bounds or `period` not a positive number.
        """
        super().__init__()
        if not (np.isfinite(period) and period > 0.0):
            raise ValueError(f"period must be > 0 s, got {period!r}.")
        # Inputs.
        image = ImageDepth16U(intrinsics.width, intrinsics.height)
        ports = DeclareInputs(self, ACCUMULATOR_INPUTS | {"depth_image": image})
        self._depth_port, self._time_port = ports["depth_image"], ports["image_time"]
        self._pose_port, self._wall_port = ports["X_WC"], ports["wall"]
        self._enabled_port = ports["enabled"]
        # State.
        empty = LiveMap.empty(
            X_WT, (tile.width, tile.height), config, intrinsics, pose_graph
        )
        self.DeclareValue(MapProgress(empty))
        # Outputs. The map caches its surface itself: every event clears Drake's cache.
        self.DeclareValueOutput("surface_map", lambda now: now.map.surface_map)
        # Events.
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._UpdateMap)

    def _UpdateMap(self, context: Context, state: State) -> EventStatus:
        before: MapProgress = self.GetValue(context)
        progress = self._Fuse(context, self._Restart(context, before))
        if progress is before:
            return EventStatus.DidNothing()
        return self.SetValue(state, progress)

    def _Restart(self, context: Context, progress: MapProgress) -> MapProgress:
        """Returns an empty map in the tile frame of a newly found wall, if any."""
        if not self._wall_port.HasValue(context):
            return progress
        result = EvalAs(self._wall_port, context, StageResult)
        if result.number == progress.wall_number or not isinstance(result.value, Wall):
            return progress
        empty = progress.map.restarted(result.value.X_WT)
        return progress.replace(map=empty, wall_number=result.number)

    def _Fuse(self, context: Context, progress: MapProgress) -> MapProgress:
        """Returns the map with the last picture fused, if that is a new one."""
        if self._enabled_port.HasValue(context) and (
            self._enabled_port.Eval(context)[0] == 0.0
        ):
            return progress
        image_time = float(self._time_port.Eval(context)[0])
        if image_time < 0.0 or image_time == progress.image_time:
            return progress
        depth_mm = EvalAs(self._depth_port, context, ImageDepth16U).data[:, :, 0]
        # A copy: the port's value is overwritten with the next pose.
        X_WC = RigidTransform(EvalAs(self._pose_port, context, RigidTransform))
        fused = progress.map.fused(image_time, depth_mm, X_WC)
        return progress.replace(map=fused, image_time=image_time)
