"""The stage that segments the scanned wall into paintable area and the rest."""

from pydrake.systems.framework import Context

from painter.systems.stage import Stage
from painter.systems.values import UP_W
from perception.config import SegmentationConfig
from perception.ground import check_positive
from perception.segmentation import segment_wall
from perception.settings import validate
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
            config: Thresholds of the segmentation.
            seed: Of RANSAC's random draws.
            period: Time between checks for a new request, s.

        Raises:
            ValueError: A number is not positive or a threshold out of bounds.
        """
        check_positive("wall_segmenter", period=period)
        validate(config, "segmentation")
        super().__init__(stage="wall_segmenter", period=period)
        self._tile = tile
        self._config = config
        self._seed = seed

    def Work(self, context: Context, goal: str) -> WallSegmentation:
        """Returns the wall's segmentation; see `Stage.Work`."""
        surface_map: SurfaceMap = self.Read(context, "surface_map")
        return segment_wall(
            surface_map,
            self.ReadAnswer(context, "wall", Wall).X_WT,
            self._tile,
            config=self._config,
            seed=self._seed,
            up_W=UP_W,
        )
