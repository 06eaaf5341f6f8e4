"""From a segmentation to a paint program: strokes, their order in time, every move."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.planning import CollisionChecker

from painter.errors import CollisionError, InputError, ReachError
from painter.planning.blend import MovingState
from painter.planning.clear_strokes import (
    RUN_OUT,
    clear_strokes,
    has_run_out,
    nozzle_points,
)
from painter.planning.config import MotionConfig, RasterConfig, TipConfig
from painter.planning.film_model import Site, margin_cells
from painter.planning.gun_path import Pass, SquareGun, ToolMove
from painter.planning.joint_motion import (
    Segment,
    Stand,
    chain,
    planning_limits,
    start_times,
)
from painter.planning.kinematics import ArmKinematics, ArmLimits
from painter.planning.linker import Linker, end_q
from painter.planning.obstacles import ClearSpace, segmentation_boxes
from painter.planning.raster import plan_strokes, raster_film
from painter.planning.reach import nearest_standoffs
from painter.planning.spray_path import PaintProgram, SkippedStroke, Stroke
from painter.planning.stroke_order import order_strokes
from painter.planning.surface_frame import SurfaceFrame, above_wall
from painter.planning.tile import cell_centres
from painter.planning.tool_shape import standoffs_beside, tool_boxes
from painter.planning.touch_up import touch_up_strokes
from painter.planning.verify import verify_motion, verify_strokes
from painter.planning.zones import in_zones
from perception.values import BoolArray, FloatArray, FrozenValue, WallSegmentation

_TRIMS = (0.0, 0.02, 0.05, 0.10, 0.20)  # m, off a stroke's end for room to turn.
_LEAST_LEFT = 1e-3  # m, of a trimmed stroke; shorter is rounding.

# m and m/s; strokes whose flow alone differs follow one another without a gap.
_SAME = 1e-9


@dataclass(frozen=True, eq=False)
class ProgramPlanner(FrozenValue):
    """Plans paint programs for one robot with one set of settings.

    Strokes that come nearer than the clearance to an obstacle, or out of reach, are cut
    back; what is cut, and strokes that cannot be come to, stand in the program's
    `skipped`. Where the wall is not flat the gun follows its surface; see
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
        """Returns strokes over a tile's wall alone, as `plan_strokes` finds them."""
        return plan_strokes(
            np.asarray(segmentation.wall_mask),
            segmentation.cell,
            tip=self.tip,
            raster=self.raster,
            height=above_wall(segmentation),
            nearest=self._nearest(segmentation),
        )

    def wanted(self, segmentation: WallSegmentation) -> BoolArray:
        """Returns the wall (ny, nx) that the operator's zones leave to be painted."""
        mask = np.asarray(segmentation.wall_mask)
        return in_zones(mask, segmentation.cell, self.raster.zones)

    def touch_up_strokes(
        self, segmentation: WallSegmentation, film: FloatArray
    ) -> tuple[Stroke, ...]:
        """Returns the strokes that mend a film where it is thin.

        Args:
            segmentation: Of the tile.
            film: m, on the tile and `margin_cells` around it.
        """
        site = Site.of_tile(
            self.wanted(segmentation),
            segmentation.cell,
            above_wall(segmentation),
            self._nearest(segmentation),
        )
        return touch_up_strokes(
            film,
            site,
            nominal=self.nominal_film(segmentation),
            tip=self.tip,
            raster=self.raster,
        )

    def nominal_film(self, segmentation: WallSegmentation) -> float:
        """Returns the wet film that the raster of a tile aims at, m."""
        width = segmentation.wall_mask.shape[1] * segmentation.cell
        return raster_film(width, tip=self.tip, raster=self.raster)

    def program(
        self, wanted: Sequence[Stroke], segmentation: WallSegmentation, q0: FloatArray
    ) -> PaintProgram:
        """Plans the motion that makes given strokes.

        Args:
            wanted: Strokes in T, in any order and direction; coats follow one another.
            segmentation: Of the tile; what stands before the wall is kept clear of.
            q0: (5,) rad, where the arm stands, at rest.

        Returns:
            The program, verified; its motion ends at the home pose.

        Raises:
            ReachError: More than a twentieth of the strokes is out of the arm's reach.
            CollisionError: There is no clear way to any stroke, or home.
            MotionLimitError: The finished motion fails its verification.
        """
        motion, limits = self.motion, self.limits
        gun = self._gun(segmentation)
        space = ClearSpace(
            self.checker,
            X_WT=segmentation.X_WT,
            boxes=segmentation_boxes(segmentation),
            clearance=motion.clearance,
            floor_clearance=motion.floor_clearance,
        )
        linker = Linker(
            gun=gun,
            limits=planning_limits(limits, motion.limit_share),
            space=space,
            q_home=np.deg2rad(motion.home_deg),
        )
        clear, skipped = clear_strokes(wanted, linker, self.raster.min_stroke)
        path, strokes, passes, unlinked = _coats(
            clear, q0, linker, self.raster.flash_off
        )
        starts = start_times(path)[:-1]
        flows = [[starts[i], starts[i] + path[i].duration] for i in passes]
        program = PaintProgram(
            strokes=strokes,
            motion=chain(
                path,
                period=motion.sample_period,
                spray_on=np.reshape(flows, (-1, 2)) - self.tip.valve_delay,
                flow=np.array([stroke.flow for stroke in strokes]),
            ),
            X_WT=segmentation.X_WT,
            standoff=self.raster.standoff,
            nominal_thickness=self.nominal_film(segmentation),
            paint_volume=self.tip.flow
            * sum(stroke.flow * stroke.length / stroke.speed for stroke in strokes),
            skipped=(*skipped, *unlinked),
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
            surface=gun.surface,
        )
        return program

    def _gun(self, segmentation: WallSegmentation) -> SquareGun:
        """Returns the gun before a wall; it follows the wall's surface."""
        surface = SurfaceFrame.of_wall(segmentation)
        return SquareGun(self.kinematics, segmentation.X_WT, surface)

    def _nearest(self, segmentation: WallSegmentation) -> FloatArray:
        """Returns the least stand-offs on a tile, by reach and by what stands out."""
        cell = segmentation.cell
        border = margin_cells(cell)
        ny, nx = (size + 2 * border for size in segmentation.wall_mask.shape)
        x, y = cell_centres((ny, nx), cell, margin=border * cell)
        reached = nearest_standoffs(
            x,
            y,
            gun=self._gun(segmentation),
            limits=self.limits,
            near=self.raster.cut_in_standoff,
            far=self.raster.standoff,
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
    """Returns what is left of strokes once those before a number are done.

    Args:
        strokes: In order of execution.
        from_stroke: Number of the first, from 1; 12.4 begins where four tenths of the
            twelfth are done.

    Raises:
        InputError: There is no such stroke.
    """
    if not 1.0 <= from_stroke < len(strokes) + 1.0:
        raise InputError(
            f"from_stroke must be 1 to {len(strokes)}, the number of strokes, got "
            f"{from_stroke!r}."
        )
    first = int(from_stroke)
    return (
        strokes[first - 1].part(from_stroke - first, 1.0),
        *strokes[first:],
    )


# The segments; the strokes that could be come to; the index of each one's segment; and
# the strokes that could not, with the reason.
_Links = tuple[list[Segment], tuple[Stroke, ...], list[int], list[SkippedStroke]]


def _coats(
    strokes: Sequence[Stroke], q0: FloatArray, linker: Linker, flash_off: float
) -> _Links:
    """Orders and joins strokes coat by coat; the arm rests at home between them."""
    path: list[Segment] = []
    done: list[Stroke] = []
    passes: list[int] = []
    skipped: list[SkippedStroke] = []
    gun, q = linker.gun, q0
    for coat in sorted({stroke.coat for stroke in strokes}) or [1]:
        if path and flash_off > 0.0:
            path.append(Stand(q, flash_off))
        rests = [
            gun.place(p_WG)
            for p_WG in gun.kinematics.nozzle(np.stack([q, linker.q_home]))
        ]
        of_coat = [stroke for stroke in strokes if stroke.coat == coat]
        ordered = order_strokes(of_coat, *rests)
        segments, sprayed, of_path, unlinked = _linked(ordered, q, linker)
        passes += [len(path) + index for index in of_path]
        path += segments
        done += sprayed
        skipped += unlinked
        q = linker.q_home
    return path, tuple(done), passes, skipped


def _linked(strokes: Sequence[Stroke], q0: FloatArray, linker: Linker) -> _Links:
    """Joins strokes by moves, from rest at `q0` to rest at home.

    Beyond a stroke with run-out there is believed to be a way back. Where it turns out
    that from there one cannot go on, the stroke is joined once more, its way back
    looked for.
    """
    believed = has_run_out(strokes, linker)
    fits: list[_Fit] = []
    home: list[Segment] = []
    while not home:
        done = [number for number, fit in enumerate(fits) if fit.stroke is not None]
        last = _last_pass(fits)
        doubtful = bool(done and believed[done[-1]])
        try:
            if len(fits) < len(strokes):
                wanted, roomy = strokes[len(fits)], bool(believed[len(fits)])
                fits.append(_fit(wanted, roomy, last, q0, linker, in_full=doubtful))
            else:
                home = _way_home(last, q0, linker)
        except (CollisionError, ReachError):
            if not doubtful:
                raise
            believed[done[-1]] = False
            del fits[done[-1] :]
    path: list[Segment] = []
    sprayed: list[Stroke] = []
    passes: list[int] = []
    skipped: list[SkippedStroke] = []
    for fit in fits:
        skipped += fit.skipped
        if fit.stroke is not None:
            path += [*fit.link, ToolMove(_pass(fit.stroke), linker.gun)]
            passes.append(len(path) - 1)
            sprayed.append(fit.stroke)
    if strokes and not sprayed:
        raise CollisionError(f"no stroke can be come to: {skipped[0].reason}")
    return [*path, *home], tuple(sprayed), passes, skipped


def _way_home(last: Pass | None, q0: FloatArray, linker: Linker) -> list[Segment]:
    """Goes from the last pass, or from rest at `q0`, to rest at home."""
    if last is None:
        return linker.transit(q0, linker.q_home)
    leave = linker.to_rest(last.end)
    return [leave, *linker.transit(end_q(leave), linker.q_home)]


@dataclass(frozen=True)
class _Fit:
    """What can be done of a stroke, how it is come to, and what is left out."""

    stroke: Stroke | None
    link: list[Segment]
    skipped: list[SkippedStroke]


def _last_pass(fits: Sequence["_Fit"]) -> Pass | None:
    """Returns the pass of the last stroke that can be done, if any."""
    strokes = [fit.stroke for fit in fits if fit.stroke is not None]
    return _pass(strokes[-1]) if strokes else None


def _fit(
    wanted: Stroke,
    roomy: bool,
    last: Pass | None,
    q0: FloatArray,
    linker: Linker,
    *,
    in_full: bool = False,
) -> _Fit:
    """Joins a stroke to the last pass, or to rest at `q0`, trimming it if need be.

    In a corner of the tile, or close to the floor, there may be no room to turn at full
    speed beyond a stroke's end; then the end is trimmed until there is. Where it is
    `roomy` there is. If its start has to be `in_full`, CollisionError or ReachError
    tells why it cannot be.
    """
    trims = np.array(_TRIMS) / wanted.length
    most = 1.0 - _LEAST_LEFT / wanted.length
    first_failure = ""
    for end in range(len(trims)):
        if trims[end] > most:
            return _Fit(None, [], [SkippedStroke(wanted, first_failure)])
        stroke = wanted.part(0.0, 1.0 - trims[end])
        if roomy:
            break
        try:
            linker.to_rest(_pass(stroke).end)  # There must be a way back.
            break
        except (CollisionError, ReachError) as error:
            first_failure = first_failure or str(error)
    else:
        return _Fit(None, [], [SkippedStroke(wanted, first_failure)])
    for begin in range(len(trims)):
        if trims[begin] + trims[end] > most:
            break
        stroke = wanted.part(trims[begin], 1.0 - trims[end])
        start = _pass(stroke).start
        try:
            if last is None:
                link = linker.from_rest(q0, start)
            elif _goes_on(last.end, start):
                link = []
            else:
                link = linker.between(last.end, start)
        except (CollisionError, ReachError) as error:
            if in_full:
                raise
            first_failure = first_failure or str(error)
            continue
        parts = ((0.0, trims[begin]), (1.0 - trims[end], 1.0))
        left_out = [wanted.part(a, b) for a, b in parts if b > a]
        return _Fit(
            stroke, link, [SkippedStroke(part, first_failure) for part in left_out]
        )
    return _Fit(None, [], [SkippedStroke(wanted, first_failure)])


def _goes_on(end: MovingState, start: MovingState) -> bool:
    """Returns whether a stroke goes on where the last one ends, without a bend."""
    return bool(
        np.abs(end.x - start.x).max() < _SAME and np.abs(end.v - start.v).max() < _SAME
    )


def _pass(stroke: Stroke) -> Pass:
    """Returns the nozzle's pass over a stroke."""
    start, end = nozzle_points(
        np.stack([stroke.start_T, stroke.end_T]), stroke.standoff
    )
    return Pass.between(start, end, stroke.speed)
