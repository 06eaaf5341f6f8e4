"""The stage that plans the paint program."""

from collections.abc import Sequence

import numpy as np
from pydrake.common.value import Value
from pydrake.systems.framework import Context

from painter.errors import PainterError
from painter.planning.config import TileConfig
from painter.planning.program.program import ProgramPlanner
from painter.planning.spray_path import PaintProgram, Stroke
from painter.planning.tile import grid_shape
from painter.systems.ports import EvalAs
from painter.systems.stage import Stage
from painter.systems.values import StageResult
from perception.ground import check_positive
from perception.values import WallSegmentation


class SprayPathPlanner(Stage):
    """Plans strokes over the wall alone, or takes given ones, and their motion.

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
        state: (10,) q and v, rad and rad/s, where the arm stands, at rest.
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
            period: Time between looks at the request, s.
            strokes: What is left to be sprayed; None = all of the wall.

        Raises:
            ValueError: A setting is out of bounds.
        """
        check_positive("spray_path_planner", period=period)
        for config in (tile, planner.tip, planner.raster, planner.motion):
            config.validate()
        super().__init__(stage="spray_path_planner", period=period)
        self._tile = tile
        self._planner = planner
        self._strokes = strokes
        # Inputs.
        self._state_port = self.DeclareVectorInputPort("state", 10)
        self._segmentation_port = self.DeclareAbstractInputPort(
            "segmentation", Value(StageResult())
        )

    def _Work(self, context: Context, goal: str) -> PaintProgram:
        segmentation = EvalAs(self._segmentation_port, context, StageResult).value
        if not isinstance(segmentation, WallSegmentation):
            raise PainterError(
                f"{self.GetSystemPathname()}:segmentation carries no segmentation: "
                f"none was made yet.",
                code="PNT-CYCLE-006",
            )
        shape = grid_shape(self._tile, segmentation.cell)
        if segmentation.wall_mask.shape != shape:
            raise PainterError(
                f"{self.GetSystemPathname()}:segmentation has "
                f"{segmentation.wall_mask.shape} cells, the tile {shape}.",
                code="PNT-CYCLE-007",
            )
        q0 = np.array(self._state_port.Eval(context)[:5])
        strokes = self._strokes
        if strokes is None:
            strokes = self._planner.strokes(segmentation)
        return self._planner.program(strokes, segmentation, q0)
