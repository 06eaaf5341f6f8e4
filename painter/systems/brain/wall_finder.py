"""The stage that finds the wall at first sight."""

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context

from painter.systems.ports import EvalAs
from painter.systems.stage import Stage
from painter.systems.values import UP_W
from perception.config import SegmentationConfig
from perception.ground import check_positive
from perception.mapping.config import PoseGraphConfig
from perception.paper_steps.wall import find_wall
from perception.values import SurfaceMap, TileSize, Wall


class WallFinder(Stage):
    """Finds the wall near where the job expects it and lays the tile on it.

    .. pydrake_system::

        name: WallFinder
        input_ports:
        - request
        - surface_map
        output_ports:
        - result

    Ports:
        request: StageRequest; acted on when it names "wall_finder" and is new.
        surface_map: SurfaceMap in W, of the first look.
        result: StageResult; its value is a Wall.

    State is the last StageResult.
    """

    def __init__(
        self,
        *,
        X_WT_expected: RigidTransform,
        tile: TileSize,
        config: SegmentationConfig,
        seed: int,
        period: float,
        mount_limit_deg: float = PoseGraphConfig.mount_limit_deg,
    ) -> None:
        """Creates the stage.

        Args:
            X_WT_expected: Tile frame where the job expects it.
            tile: Its size.
            config: Thresholds.
            seed: Of RANSAC's random draws.
            period: Time between reads of the request, s.
            mount_limit_deg: A camera found to be tilted by more is warned of.

        Raises:
            ValueError: A number is not positive or a threshold out of bounds.
        """
        check_positive("wall_finder", period=period, mount_limit_deg=mount_limit_deg)
        config.validate()
        super().__init__(stage="wall_finder", period=period)
        self._X_WT_expected = X_WT_expected
        self._tile = tile
        self._config = config
        self._seed = seed
        self._mount_limit_deg = mount_limit_deg
        # Inputs.
        self._map_port = self.DeclareAbstractInputPort(
            "surface_map", Value(SurfaceMap.empty())
        )

    def _Warning(self, context: Context) -> str | None:
        surface_map = EvalAs(self._map_port, context, SurfaceMap)
        tilt_deg = float(np.degrees(surface_map.mount_tilt))
        if tilt_deg <= self._mount_limit_deg:
            return None
        return (
            f"the camera's mount is tilted by {tilt_deg:.2f} deg against its model "
            f"(limit {self._mount_limit_deg:g} deg): calibrate it (painter calibrate)."
        )

    def _Work(self, context: Context, goal: str) -> Wall:
        surface_map = EvalAs(self._map_port, context, SurfaceMap)
        return find_wall(
            surface_map.p_WQs,
            self._X_WT_expected,
            self._tile,
            config=self._config,
            seed=self._seed,
            up_W=UP_W,
        )
