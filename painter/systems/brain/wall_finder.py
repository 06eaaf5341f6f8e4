"""The stage that finds the wall in the first pictures."""

import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context

from painter.systems.stage import Stage
from painter.systems.values import UP_W
from perception.config import SegmentationConfig
from perception.ground import check_positive
from perception.mapping.config import PoseGraphConfig
from perception.paper_steps.wall import find_wall
from perception.settings import validate
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
        surface_map: SurfaceMap in W, of the pictures taken in LOOK.
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
            period: Time between checks for a new request, s.
            mount_limit_deg: The stage warns of a camera tilted by more, deg.

        Raises:
            ValueError: A number is not positive or a threshold out of bounds.
        """
        check_positive("wall_finder", period=period, mount_limit_deg=mount_limit_deg)
        validate(config, "segmentation")
        super().__init__(stage="wall_finder", period=period)
        self._X_WT_expected = X_WT_expected
        self._tile = tile
        self._config = config
        self._seed = seed
        self._mount_limit_deg = mount_limit_deg

    def Warning(self, context: Context) -> str | None:
        """Warns of a tilted camera mount; see `Stage.Warning`."""
        surface_map: SurfaceMap = self.Read(context, "surface_map")
        tilt_deg = float(np.degrees(surface_map.mount_tilt))
        if tilt_deg <= self._mount_limit_deg:
            return None
        return (
            f"the camera mount is tilted by {tilt_deg:.2f} deg from its model (limit "
            f"{self._mount_limit_deg:g} deg): calibrate it with `painter calibrate`."
        )

    def Work(self, context: Context, goal: str) -> Wall:
        """Returns the wall that was found; see `Stage.Work`."""
        surface_map: SurfaceMap = self.Read(context, "surface_map")
        return find_wall(
            surface_map.p_WQs,
            self._X_WT_expected,
            self._tile,
            config=self._config,
            seed=self._seed,
            up_W=UP_W,
        )
