"""The stage that plans the paint program."""

from collections.abc import Sequence

from pydrake.systems.framework import Context

from painter.errors import PainterError
from painter.planning.arm.kinematics import NQ
from painter.planning.config import TileConfig
from painter.planning.program.program import ProgramPlanner
from painter.planning.spray_path import PaintProgram, Stroke
from painter.planning.tile import grid_shape
from painter.systems.stage import Stage
from perception.ground import check_positive
from perception.settings import validate
from perception.values import WallSegmentation


class SprayPathPlanner(Stage):
    """Plans strokes over the paintable wall, or takes given ones, and their motion.

    .. pydrake_system::

        name: SprayPathPlanner
        input_ports:
        - request
        - state
        - segmentation
        output_ports:
        - result

    Ports:
        request: StageRequest; acted on when it names "spray_path_planner" and is new.
        state: (10,) q and v, rad and rad/s, of the arm, at rest.
        segmentation: StageResult of the wall segmenter.
        result: StageResult; its value is a PaintProgram that starts at `state` and ends
            at the home pose.

    State is the last StageResult.
    """

    def __init__(
        self,
        *,
        planner: ProgramPlanner,
        tile: TileConfig,
        period: float,
        strokes: Sequence[Stroke] | None = None,
    ) -> None:
        """Creates the stage.

        Args:
            planner: Of the robot and its settings.
            tile: Size that the segmentation must have.
            period: Time between checks for a new request, s.
            strokes: Those left to spray; None = plan them for the whole wall.

        Raises:
            ValueError: A setting is out of bounds.
        """
        check_positive("spray_path_planner", period=period)
        validate(tile, "tile")
        validate(planner.tip, "gun.tip")
        validate(planner.raster, "raster")
        validate(planner.motion, "motion")
        super().__init__(stage="spray_path_planner", period=period)
        self._tile = tile
        self._planner = planner
        self._strokes = strokes

    def Work(self, context: Context, goal: str) -> PaintProgram:
        """Returns the paint program; see `Stage.Work`."""
        segmentation = self.ReadAnswer(context, "segmentation", WallSegmentation)
        shape = grid_shape(self._tile, segmentation.cell)
        if segmentation.wall_mask.shape != shape:
            raise PainterError(
                f"{self.GetSystemPathname()}:segmentation has "
                f"{segmentation.wall_mask.shape} cells, the tile {shape}.",
                code="PNT-CYCLE-007",
            )
        q0 = self.Read(context, "state")[:NQ]
        strokes = self._strokes
        if strokes is None:
            strokes = self._planner.strokes(segmentation)
        return self._planner.program(strokes, segmentation, q0)
