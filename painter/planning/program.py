"""From a segmentation to a paint program: strokes, their order in time, every move."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.planning import CollisionChecker

from painter.errors import CollisionError, InputError, ReachError
from painter.planning.blend import MovingState
from painter.planning.config import MotionConfig, RasterConfig, TipConfig
from painter.planning.gun_path import Pass, SquareGun, ToolMove
from painter.planning.joint_motion import Segment, chain, planning_limits, start_times
from painter.planning.kinematics import ArmKinematics, ArmLimits
from painter.planning.linker import Linker, end_q
from painter.planning.obstacles import ClearSpace, segmentation_boxes
from painter.planning.raster import plan_strokes, raster_film
from painter.planning.reach import require_reach
from painter.planning.spray_path import PaintProgram, SkippedStroke, Stroke
from painter.planning.stroke_order import order_strokes
from painter.planning.verify import verify_motion, verify_strokes
from perception.values import FloatArray, WallSegmentation

_STEP = 0.02  # m along a stroke, between the places that are looked at.
# m, cut off a stroke before an obstacle that the gun cannot pass under its clearance:
# the room in which the arm stops and turns at 0.6 m/s.
_STOPPING = 0.12
# Share of the strokes' length; if more is out of reach the arm stands in the wrong
# place.
_MOST_OUT_OF_REACH = 0.05
_TRIMS = (0.0, 0.02, 0.05, 0.10, 0.20)  # m, off a stroke's end for room to turn.

# m and m/s; strokes whose flow alone differs follow one another without a gap.
_SAME = 1e-9


def plan_program(
    segmentation: WallSegmentation,
    q0: FloatArray,
    *,
    kinematics: ArmKinematics,
    limits: ArmLimits,
    checker: CollisionChecker,
    tip: TipConfig,
    raster: RasterConfig,
    motion: MotionConfig,
    from_stroke: float = 1.0,
) -> PaintProgram:
    """Plans strokes over the wall alone and the motion that makes them.

    Strokes that come nearer than the clearance to an obstacle, or out of reach, are cut
    back; what is cut, and strokes that cannot be come to, stand in the program's
    `skipped`.

    Args:
        segmentation: Of the tile.
        q0: (5,) rad, where the arm stands, at rest.
        kinematics: Of the arm.
        limits: Of its joints.
        checker: Of the robot's cell: arm, frame and floor.
        tip: The spray tip.
        raster: Settings of the strokes.
        motion: Settings of the motion.
        from_stroke: Number of the stroke to begin with, from 1; 12.4 begins where four
            tenths of the twelfth are done.

    Returns:
        The program, verified; its motion ends at the home pose.

    Raises:
        InputError: There is no such stroke.
        ReachError: More than a twentieth of the strokes is out of the arm's reach.
        CollisionError: There is no clear way to any stroke, or home.
        MotionLimitError: The finished motion fails its verification.
    """
    wanted = plan_strokes(
        np.asarray(segmentation.wall_mask),
        segmentation.cell,
        tip=tip,
        raster=raster,
        height=np.asarray(segmentation.depth, dtype=np.float64),
    )
    return program_of(
        wanted,
        segmentation,
        q0,
        kinematics=kinematics,
        limits=limits,
        checker=checker,
        tip=tip,
        raster=raster,
        motion=motion,
        from_stroke=from_stroke,
    )


def program_of(
    wanted: Sequence[Stroke],
    segmentation: WallSegmentation,
    q0: FloatArray,
    *,
    kinematics: ArmKinematics,
    limits: ArmLimits,
    checker: CollisionChecker,
    tip: TipConfig,
    raster: RasterConfig,
    motion: MotionConfig,
    from_stroke: float = 1.0,
) -> PaintProgram:
    """Plans the motion that makes given strokes; see `plan_program`.

    Args:
        wanted: Strokes in T, in any order and direction.
        segmentation: Of the tile; what stands before the wall is kept clear of.
        q0: See `plan_program`, as all that follows.
        kinematics: Of the arm.
        limits: Of its joints.
        checker: Of the robot's cell.
        tip: The spray tip.
        raster: Settings of the strokes.
        motion: Settings of the motion.
        from_stroke: Number of the stroke to begin with.
    """
    gun = SquareGun(kinematics, segmentation.X_WT)
    space = ClearSpace(
        checker,
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
    clear, skipped = _clear_strokes(wanted, linker, raster)
    # The same order wherever the arm starts from, so that a resumed job finds it again.
    _, p_WGs = kinematics.gun_poses(linker.q_home[None])
    p_TG_home = gun.X_WT.inverse() @ p_WGs[0]
    ordered = order_strokes(clear, p_TG_home, p_TG_home)
    path, strokes, passes, unlinked = _link(ordered, q0, linker)
    if from_stroke != 1.0:
        rest = strokes_from(strokes, from_stroke)
        path, strokes, passes, unlinked = _link(rest, q0, linker)
    starts = start_times(path)[:-1]
    flows = [[starts[i], starts[i] + path[i].duration] for i in passes]
    spray_on = np.reshape(flows, (-1, 2)) - tip.valve_delay
    program = PaintProgram(
        strokes=strokes,
        motion=chain(
            path,
            period=motion.sample_period,
            spray_on=spray_on,
            flow=np.array([stroke.flow for stroke in strokes]),
        ),
        X_WT=segmentation.X_WT,
        standoff=raster.standoff,
        nominal_thickness=nominal_film(segmentation, tip=tip, raster=raster),
        paint_volume=tip.flow
        * sum(stroke.flow * stroke.length / stroke.speed for stroke in strokes),
        skipped=(*skipped, *unlinked),
    )
    verify_motion(
        program.motion,
        limits=limits,
        limit_share=motion.limit_share,
        space=space,
        what="program",
    )
    verify_strokes(program, kinematics=kinematics, valve_delay=tip.valve_delay)
    return program


def strokes_from(strokes: Sequence[Stroke], from_stroke: float) -> tuple[Stroke, ...]:
    """Returns what is left of strokes once those before a number are done.

    Args:
        strokes: In order of execution.
        from_stroke: Number of the first, from 1; its fraction is the share of that
            stroke that is done.

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
        _part(strokes[first - 1], from_stroke - first, 1.0),
        *strokes[first:],
    )


def nominal_film(
    segmentation: WallSegmentation, *, tip: TipConfig, raster: RasterConfig
) -> float:
    """Returns the wet film that the raster of a tile aims at, m."""
    width = segmentation.wall_mask.shape[1] * segmentation.cell
    return raster_film(width, tip=tip, raster=raster)


def _clear_strokes(
    strokes: Sequence[Stroke], linker: Linker, raster: RasterConfig
) -> tuple[list[Stroke], list[SkippedStroke]]:
    """Cuts strokes back to what keeps clear; returns what stays and what does not."""
    clear: list[Stroke] = []
    skipped: list[SkippedStroke] = []
    out_of_reach: list[FloatArray] = []
    for stroke in strokes:
        count = max(2, int(np.ceil(stroke.length / _STEP)) + 1)
        share = np.linspace(0.0, 1.0, count)
        p_TGs = _nozzle(
            stroke.start_T + np.outer(share, stroke.end_T - stroke.start_T),
            stroke.standoff,
        )
        q = linker.gun.solve(p_TGs)
        reached = linker.limits.contains(q)
        free = np.array(reached)
        free[reached] = linker.space.free(q[reached])
        out_of_reach += [p_TGs[~reached]] if not reached.all() else []
        if free.all():
            clear.append(stroke)
            continue
        for first, last, is_free in _runs(free):
            room = _STOPPING / stroke.length
            cut_start, cut_end = first > 0, last < count - 1
            if is_free:
                begin = share[first] + room * cut_start
                end = max(share[last] - room * cut_end, begin)
            else:
                begin = max(share[first] - room - share[1], 0.0) if cut_start else 0.0
                end = min(share[last] + room + share[1], 1.0) if cut_end else 1.0
            part = _part(stroke, begin, end)
            if is_free and part.length >= raster.min_stroke:
                clear.append(part)
            elif is_free:
                skipped.append(SkippedStroke(part, "shorter than raster.min_stroke"))
            else:
                middle = (first + last) // 2
                reason = (
                    linker.space.worst_pair(q[middle])
                    if reached[middle]
                    else "out of the arm's reach"
                )
                skipped.append(SkippedStroke(part, reason))
    if out_of_reach:
        points, total = np.concatenate(out_of_reach), sum(s.length for s in strokes)
        if len(points) * _STEP > _MOST_OUT_OF_REACH * total:
            require_reach(points, gun=linker.gun, limits=linker.limits, what="strokes")
    return clear, skipped


def _link(
    strokes: Sequence[Stroke], q0: FloatArray, linker: Linker
) -> tuple[list[Segment], tuple[Stroke, ...], list[int], list[SkippedStroke]]:
    """Joins strokes by moves, from rest at `q0` to rest at home.

    Returns:
        The segments; the strokes that could be come to; the index of each one's
        segment; and the strokes that could not, with the reason.
    """
    path: list[Segment] = []
    done: list[Stroke] = []
    passes: list[int] = []
    skipped: list[SkippedStroke] = []
    last: Pass | None = None
    for wanted in strokes:
        fit = _fit(wanted, last, q0, linker)
        skipped += fit.skipped
        if fit.stroke is None:
            continue
        last = _pass(fit.stroke)
        path += [*fit.link, ToolMove(last, linker.gun)]
        passes.append(len(path) - 1)
        done.append(fit.stroke)
    if strokes and not done:
        raise CollisionError(f"no stroke can be come to: {skipped[0].reason}")
    q_end = q0
    if last is not None:
        path.append(linker.to_rest(last.end))
        q_end = end_q(path[-1])
    path += linker.transit(q_end, linker.q_home)
    return path, tuple(done), passes, skipped


@dataclass(frozen=True)
class _Fit:
    """What can be done of a stroke, how it is come to, and what is left out."""

    stroke: Stroke | None
    link: list[Segment]
    skipped: list[SkippedStroke]


def _fit(wanted: Stroke, last: Pass | None, q0: FloatArray, linker: Linker) -> _Fit:
    """Joins a stroke to the last pass, or to rest at `q0`, trimming it if need be.

    In a corner of the tile, or close to the floor, there may be no room to turn at full
    speed beyond a stroke's end; then the end is trimmed until there is.
    """
    trims = np.array(_TRIMS) / wanted.length
    first_failure = ""
    for end in range(len(trims)):
        if trims[end] >= 1.0:
            return _Fit(None, [], [SkippedStroke(wanted, first_failure)])
        stroke = _part(wanted, 0.0, 1.0 - trims[end])
        try:
            linker.to_rest(_pass(stroke).end)  # There must be a way back.
            break
        except (CollisionError, ReachError) as error:
            first_failure = first_failure or str(error)
    else:
        return _Fit(None, [], [SkippedStroke(wanted, first_failure)])
    for begin in range(len(trims)):
        if trims[begin] + trims[end] >= 1.0:
            break
        stroke = _part(wanted, trims[begin], 1.0 - trims[end])
        start = _pass(stroke).start
        try:
            if last is None:
                link = linker.from_rest(q0, start)
            elif _goes_on(last.end, start):
                link = []
            else:
                link = linker.between(last.end, start)
        except (CollisionError, ReachError) as error:
            first_failure = first_failure or str(error)
            continue
        parts = ((0.0, trims[begin]), (1.0 - trims[end], 1.0))
        left_out = [_part(wanted, a, b) for a, b in parts if b > a]
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
    start, end = _nozzle(np.stack([stroke.start_T, stroke.end_T]), stroke.standoff)
    return Pass.between(start, end, stroke.speed)


def _nozzle(p_T: FloatArray, standoff: float) -> FloatArray:
    """Returns nozzle positions (n, 3), m, over wall points (n, 2), in T."""
    return np.column_stack([p_T, np.full(len(p_T), standoff)])


def _part(stroke: Stroke, begin: float, end: float) -> Stroke:
    """Returns a stroke's part between two shares of its length."""
    travel = stroke.end_T - stroke.start_T
    return stroke.replace(
        start_T=stroke.start_T + begin * travel, end_T=stroke.start_T + end * travel
    )


def _runs(free: np.ndarray) -> list[tuple[int, int, bool]]:
    """Returns (first, last, value) of each run of equal values."""
    edges = np.flatnonzero(np.diff(free.astype(int))) + 1
    firsts = [0, *edges.tolist()]
    lasts = [*(edges - 1).tolist(), len(free) - 1]
    return [(a, b, bool(free[a])) for a, b in zip(firsts, lasts, strict=True)]
