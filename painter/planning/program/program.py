"""From a segmentation to a paint program: strokes, their order, every move."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.planning import CollisionChecker

from painter.errors import InputError
from painter.planning.arm.kinematics import ArmKinematics, ArmLimits
from painter.planning.clearance.obstacles import ClearSpace, segmentation_boxes
from painter.planning.clearance.tool_shape import standoffs_beside, tool_boxes
from painter.planning.config import MotionConfig, RasterConfig, TipConfig
from painter.planning.film.film_model import Site, margin_cells
from painter.planning.motion.gun_path import WallIk
from painter.planning.motion.joint_motion import chain, planning_limits, start_times
from painter.planning.motion.reach import nearest_standoffs
from painter.planning.motion.surface_frame import SurfaceFrame, above_wall
from painter.planning.motion.transitions import TransitionPlanner
from painter.planning.motion.verify import verify_motion, verify_strokes
from painter.planning.program.clear_strokes import RUN_OUT, clear_strokes
from painter.planning.program.connect_strokes import connect_strokes
from painter.planning.spray_path import PaintProgram, Stroke
from painter.planning.strokes.raster import plan_strokes
from painter.planning.strokes.spray_settings import SpraySettings
from painter.planning.strokes.touch_up import touch_up_strokes
from painter.planning.tile import cell_centres
from painter.planning.zones import in_zones
from perception.ground import BoolArray, FloatArray
from perception.values import WallSegmentation


@dataclass(frozen=True, eq=False)
class ProgramPlanner:
    """Plans paint programs for one robot with one set of settings.

    Strokes are cut back where they are out of reach or come nearer to an obstacle than
    the clearance. What is cut, and strokes without a feasible approach, are listed in
    the program's `skipped`. Where the wall is not flat the gun follows its surface; see
    `SurfaceFrame`.

    Attributes:
        kinematics: Of the arm.
        limits: Of its joints.
        checker: Of the robot's cell: arm, frame and floor.
        tip: The spray tip.
        raster: Settings of the strokes.
        motion: Settings of the motion.
    """

    kinematics: ArmKinematics
    limits: ArmLimits
    checker: CollisionChecker
    tip: TipConfig
    raster: RasterConfig
    motion: MotionConfig

    def strokes(self, segmentation: WallSegmentation) -> tuple[Stroke, ...]:
        """Returns the strokes of a tile as `plan_strokes` finds them."""
        return plan_strokes(
            np.asarray(segmentation.wall_mask),
            segmentation.cell,
            self.spray,
            height=above_wall(segmentation),
            nearest=self._nearest(segmentation),
        )

    @property
    def spray(self) -> SpraySettings:
        """The tip and the settings of its strokes."""
        return SpraySettings(self.tip, self.raster)

    def paintable(self, segmentation: WallSegmentation) -> BoolArray:
        """Returns the cells (ny, nx) of the wall that the zones leave to be painted."""
        mask = np.asarray(segmentation.wall_mask)
        return in_zones(mask, segmentation.cell, self.raster.zones)

    def touch_up_strokes(
        self, segmentation: WallSegmentation, film: FloatArray
    ) -> tuple[Stroke, ...]:
        """Returns the strokes that touch up a film where it is thin.

        Args:
            segmentation: Of the tile.
            film: m, on the tile and `margin_cells` around it.
        """
        site = Site.of_tile(
            self.paintable(segmentation),
            segmentation.cell,
            above_wall(segmentation),
            self._nearest(segmentation),
        )
        return touch_up_strokes(
            film,
            site,
            self.spray,
            nominal=self.nominal_film(segmentation),
        )

    def nominal_film(self, segmentation: WallSegmentation) -> float:
        """Returns the wet film that the raster of a tile aims at, m."""
        width = segmentation.wall_mask.shape[1] * segmentation.cell
        return self.spray.nominal_film(width)

    def program(
        self, strokes: Sequence[Stroke], segmentation: WallSegmentation, q0: FloatArray
    ) -> PaintProgram:
        """Plans the motion that sprays given strokes.

        Args:
            strokes: In T, in any order and direction; coats follow one another.
            segmentation: Of the tile; what stands out of the wall is an obstacle.
            q0: (5,) rad, where the arm is at rest.

        Returns:
            The program, verified; its motion ends at the home pose.

        Raises:
            ReachError: More than a twentieth of the strokes is out of the arm's reach.
            CollisionError: There is no clear way to any stroke, or home.
            MotionLimitError: The finished motion fails its verification.
        """
        motion, limits = self.motion, self.limits
        ik = self._wall_ik(segmentation)
        space = ClearSpace(
            self.checker,
            X_WT=segmentation.X_WT,
            boxes=segmentation_boxes(segmentation),
            clearance=motion.clearance,
            floor_clearance=motion.floor_clearance,
        )
        transitions = TransitionPlanner(
            ik=ik,
            limits=planning_limits(limits, motion.limit_share),
            space=space,
            q_home=np.deg2rad(motion.home_deg),
        )
        clear, skipped = clear_strokes(strokes, transitions, self.raster.min_stroke)
        connected = connect_strokes(clear, q0, transitions, self.raster.flash_off)
        path, sprayed = connected.path, connected.strokes
        starts = start_times(path)[:-1]
        open_times = [
            [starts[i], starts[i] + path[i].duration] for i in connected.passes
        ]
        program = PaintProgram(
            strokes=tuple(sprayed),
            motion=chain(
                path,
                period=motion.sample_period,
                spray_on=np.reshape(open_times, (-1, 2)) - self.tip.valve_delay,
                flow=np.array([stroke.flow for stroke in sprayed]),
            ),
            X_WT=segmentation.X_WT,
            standoff=self.raster.standoff,
            nominal_thickness=self.nominal_film(segmentation),
            paint_volume=self.tip.flow
            * sum(stroke.flow * stroke.length / stroke.speed for stroke in sprayed),
            skipped=(*skipped, *connected.skipped),
        )
        verify_motion(
            program.motion,
            kinematics=self.kinematics,
            limits=limits,
            limit_share=motion.limit_share,
            space=space,
            what="program",
        )
        verify_strokes(
            program,
            kinematics=self.kinematics,
            valve_delay=self.tip.valve_delay,
            surface=ik.surface,
        )
        return program

    def _wall_ik(self, segmentation: WallSegmentation) -> WallIk:
        """Returns the arm's inverse kinematics before a wall, along its surface."""
        surface = SurfaceFrame.of_wall(segmentation)
        return WallIk(self.kinematics, segmentation.X_WT, surface)

    def _nearest(self, segmentation: WallSegmentation) -> FloatArray:
        """Returns the least stand-offs on a tile, by reach and by what stands out."""
        cell = segmentation.cell
        border = margin_cells(cell)
        ny, nx = (size + 2 * border for size in segmentation.wall_mask.shape)
        x, y = cell_centres((ny, nx), cell, margin=border * cell)
        reached = nearest_standoffs(
            x,
            y,
            ik=self._wall_ik(segmentation),
            limits=self.limits,
            near=self.raster.cut_in_standoff,
            far=self.raster.standoff,
            stopping=RUN_OUT[0][0],
        )
        _, *obstacles = segmentation_boxes(segmentation)  # The first is the wall.
        clear = standoffs_beside(
            x,
            y,
            obstacles=obstacles,
            tool=tool_boxes(self.checker),
            clearance=self.motion.clearance,
            run_out=RUN_OUT,
        )
        return np.maximum(reached, clear)


def strokes_from(strokes: Sequence[Stroke], from_stroke: float) -> tuple[Stroke, ...]:
    """Returns the strokes that remain once those before a number are done.

    Args:
        strokes: In order of execution.
        from_stroke: Number of the first, from 1; 12.4 begins four tenths along the
            twelfth.

    Raises:
        InputError: There is no such stroke.
    """
    if not 1.0 <= from_stroke < len(strokes) + 1.0:
        raise InputError(
            f"from_stroke must be 1 to {len(strokes)}, the number of strokes, got "
            f"{from_stroke!r}.",
            code="PNT-PROGRAM-001",
        )
    first = int(from_stroke)
    return (
        strokes[first - 1].part(from_stroke - first, 1.0),
        *strokes[first:],
    )
