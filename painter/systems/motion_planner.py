"""The stage that plans the cycle's motions with the gun closed."""

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.planning import CollisionChecker
from pydrake.systems.framework import Context

from painter.errors import PainterError
from painter.planning.config import (
    MotionConfig,
    RasterConfig,
    ScanConfig,
    TileConfig,
)
from painter.planning.kinematics import ArmKinematics, ArmLimits
from painter.planning.spray_path import Motion
from painter.planning.tile import nominal_tile_pose
from painter.planning.transfer import GOALS, plan_more_looks, plan_transfer
from painter.systems.ports import EvalAs
from painter.systems.stage import Stage
from painter.systems.values import StageResult
from perception.config import SegmentationConfig, check_positive
from perception.shadows import find_relief
from perception.values import FloatArray, SurfaceMap, Wall

MORE_LOOKS = "more looks"


class MotionPlanner(Stage):
    """Plans the way home, to first sight, along the scan, more looks, and back.

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
        state: (10,) q and v, rad and rad/s, where the arm stands, at rest.
        wall: StageResult of the wall finder; until it holds a Wall the wall is taken
            to be where the job expects it.
        surface_map: SurfaceMap in W, of the whole scan; read for "more looks" alone.
        result: StageResult; its value is a Motion, or None where no more looks are
            wanted.

    State is the last StageResult.
    """

    def __init__(
        self,
        *,
        kinematics: ArmKinematics,
        limits: ArmLimits,
        checker: CollisionChecker,
        tile: TileConfig,
        scan: ScanConfig,
        motion: MotionConfig,
        cell: float = SegmentationConfig.cell,
        period: float,
        standoff: float = RasterConfig.standoff,
    ) -> None:
        """Creates the stage.

        Args:
            kinematics: Of the arm.
            limits: Of its joints.
            checker: Of the robot's cell: arm, frame and floor.
            tile: Size of the tile, and where the job expects it.
            scan: Settings of first sight and scan.
            motion: Settings of the motion.
            cell: Of the grid on which the scan is looked at for shadows, m.
            period: Time between looks at the request, s.
            standoff: Of the gun when it paints, m; before first sight and scan it is
                made sure that the arm reaches the whole tile with it.

        Raises:
            ValueError: A setting is out of bounds.
        """
        check_positive("motion_planner", cell=cell, standoff=standoff, period=period)
        for config in (tile, scan, motion):
            config.validate()
        super().__init__(stage="motion_planner", period=period)
        self._X_WT_expected = nominal_tile_pose(tile)
        self._settings = {
            "kinematics": kinematics,
            "limits": limits,
            "checker": checker,
            "tile": tile,
            "scan": scan,
            "motion": motion,
        }
        self._standoff = standoff
        self._cell = cell
        # Inputs.
        self._state_port = self.DeclareVectorInputPort("state", 10)
        self._wall_port = self.DeclareAbstractInputPort("wall", Value(StageResult()))
        self._map_port = self.DeclareAbstractInputPort(
            "surface_map", Value(SurfaceMap.empty())
        )

    def _Work(self, context: Context, goal: str) -> Motion | None:
        if goal not in (*GOALS, MORE_LOOKS):
            raise PainterError(
                f"{self.GetSystemPathname()}: goal must be one of "
                f"{', '.join((*GOALS, MORE_LOOKS))}, got {goal!r}."
            )
        wall = EvalAs(self._wall_port, context, StageResult).value
        X_WT = wall.X_WT if isinstance(wall, Wall) else self._X_WT_expected
        q0 = np.array(self._state_port.Eval(context)[:5])
        if goal == MORE_LOOKS:
            return self._MoreLooks(context, X_WT, q0)
        return plan_transfer(
            goal, q0, X_WT=X_WT, standoff=self._standoff, **self._settings
        )

    def _MoreLooks(
        self, context: Context, X_WT: RigidTransform, q0: FloatArray
    ) -> Motion | None:
        surface_map = EvalAs(self._map_port, context, SurfaceMap)
        tile = self._settings["tile"]
        X_TW = X_WT.inverse()
        relief = find_relief(
            X_TW @ surface_map.p_WQs,
            X_TW @ surface_map.p_WCs,
            width=tile.width,
            height=tile.height,
            cell=self._cell,
        )
        return plan_more_looks(q0, relief=relief, X_WT=X_WT, **self._settings)
