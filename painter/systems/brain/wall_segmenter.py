"""The stage that parts the scanned wall into what to paint and what not."""

from pydrake.common.value import Value
from pydrake.systems.framework import Context

from painter.errors import PainterError
from painter.systems.ports import EvalAs
from painter.systems.stage import Stage
from painter.systems.values import UP_W, StageResult
from perception.config import SegmentationConfig
from perception.ground import check_positive
from perception.segmentation import segment_wall
from perception.values import SurfaceMap, TileSize, Wall, WallSegmentation


class WallSegmenter(Stage):
    """Segments the surface map on the tile of the wall that was found.

    .. pydrake_system::

        name: WallSegmenter
        input_ports:
        - request
        - surface_map
        - wall
        output_ports:
        - result

    Ports:
        request: StageRequest; acted on when it names "wall_segmenter" and is new.
        surface_map: SurfaceMap in W, of the whole scan.
        wall: StageResult of the wall finder; its tile is where the wall is expected.
        result: StageResult; its value is a WallSegmentation.

    State is the last StageResult.
    """

    def __init__(
        self,
        *,
        tile: TileSize,
        config: SegmentationConfig,
        seed: int,
        period: float,
    ) -> None:
        """Creates the stage.

        Args:
            tile: Its size.
            config: Thresholds of the six steps.
            seed: Of RANSAC's random draws.
            period: Time between reads of the request, s.

        Raises:
            ValueError: A number is not positive or a threshold out of bounds.
        """
        check_positive("wall_segmenter", period=period)
        config.validate()
        super().__init__(stage="wall_segmenter", period=period)
        self._tile = tile
        self._config = config
        self._seed = seed
        # Inputs.
        self._map_port = self.DeclareAbstractInputPort(
            "surface_map", Value(SurfaceMap.empty())
        )
        self._wall_port = self.DeclareAbstractInputPort("wall", Value(StageResult()))

    def _Work(self, context: Context, goal: str) -> WallSegmentation:
        surface_map = EvalAs(self._map_port, context, SurfaceMap)
        wall = EvalAs(self._wall_port, context, StageResult).value
        if not isinstance(wall, Wall):
            raise PainterError(
                f"{self.GetSystemPathname()}:wall carries no wall: none was found yet.",
                code="PNT-CYCLE-008",
            )
        return segment_wall(
            surface_map,
            wall.X_WT,
            self._tile,
            config=self._config,
            seed=self._seed,
            up_W=UP_W,
        )
