"""The stage that plans the cycle's motions with the gun closed."""

from pydrake.systems.framework import Context

from painter.errors import PainterError
from painter.planning.arm.kinematics import NQ
from painter.planning.scan.free_motion import GOALS, FreeMotionPlanner
from painter.planning.spray_path import Motion
from painter.planning.tile import nominal_tile_pose
from painter.systems.stage import Stage
from perception.config import SegmentationConfig
from perception.fine_steps.shadows import find_relief
from perception.ground import check_positive
from perception.settings import validate
from perception.values import SurfaceMap, TileSize, Wall

MORE_LOOKS = "more looks"


class MotionPlanner(Stage):
    """Plans the motions home, to the first look, along the scan, and the retreat.

    .. pydrake_system::

        name: MotionPlanner
        input_ports:
        - request
        - state
        - wall
        - surface_map
        output_ports:
        - result

    Ports:
        request: StageRequest; acted on when it names "motion_planner" and is new; its
            goal is "home", "look", "scan", "more looks" or "retract".
        state: (10,) q and v, rad and rad/s, of the arm, at rest.
        wall: StageResult of the wall finder; until it holds a Wall, the wall is
            assumed where the job expects it.
        surface_map: SurfaceMap in W, of the whole scan; read for "more looks" alone.
        result: StageResult; its value is a Motion, or None where no more looks are
            needed.

    State is the last StageResult.
    """

    def __init__(
        self,
        *,
        planner: FreeMotionPlanner,
        cell: float = SegmentationConfig.cell,
        period: float,
    ) -> None:
        """Creates the stage.

        Args:
            planner: Of the robot and its settings; before look and scan it checks that
                the arm reaches the whole tile.
            cell: Edge of a cell of the grid on which shadows of the scan are sought, m.
            period: Time between checks for a new request, s.

        Raises:
            ValueError: A setting is out of bounds.
        """
        check_positive(
            "motion_planner", cell=cell, standoff=planner.standoff, period=period
        )
        validate(planner.tile, "tile")
        validate(planner.scan, "scan")
        validate(planner.motion, "motion")
        super().__init__(stage="motion_planner", period=period)
        self._planner = planner
        self._cell = cell

    def Work(self, context: Context, goal: str) -> Motion | None:
        """Returns the motion to a goal; see `Stage.Work`."""
        if goal not in (*GOALS, MORE_LOOKS):
            raise PainterError(
                f"{self.GetSystemPathname()}: goal must be one of "
                f"{', '.join((*GOALS, MORE_LOOKS))}, got {goal!r}.",
                code="PNT-CYCLE-004",
            )
        wall = self.Read(context, "wall").value
        tile = self._planner.tile
        X_WT = wall.X_WT if isinstance(wall, Wall) else nominal_tile_pose(tile)
        q0 = self.Read(context, "state")[:NQ]
        if goal != MORE_LOOKS:
            return self._planner.plan(goal, q0, X_WT)
        surface_map: SurfaceMap = self.Read(context, "surface_map")
        X_TW = X_WT.inverse()
        relief = find_relief(
            X_TW @ surface_map.p_WQs,
            X_TW @ surface_map.p_WCs,
            TileSize(tile.width, tile.height),
            cell=self._cell,
        )
        return self._planner.more_looks(q0, relief, X_WT)
