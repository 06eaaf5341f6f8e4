"""Joins one stroke to the pass before it, trimmed where the arm cannot turn."""

from dataclasses import dataclass

import numpy as np

from painter.errors import CollisionError, ReachError
from painter.planning.motion.blend import MovingState
from painter.planning.motion.gun_path import Pass
from painter.planning.motion.joint_motion import Segment
from painter.planning.motion.transitions import TransitionPlanner
from painter.planning.program.clear_strokes import nozzle_points
from painter.planning.spray_path import SkippedStroke, Stroke
from perception.ground import FloatArray

_TRIMS = (0.0, 0.02, 0.05, 0.10, 0.20)  # m, off a stroke's end to make room for a turn.
_LEAST_LEFT = 1e-3  # m, of a trimmed stroke; shorter is rounding.
_SAME = 1e-9  # m and m/s; strokes that differ in flow alone follow without a gap.


@dataclass(frozen=True)
class JoinedStroke:
    """A stroke with the transition to it.

    Attributes:
        stroke: The feasible part; None = there is none.
        transition: From the pass before, or from rest, to its start.
        skipped: The parts that are left out.
    """

    stroke: Stroke | None
    transition: list[Segment]
    skipped: list[SkippedStroke]


def join_stroke(
    stroke: Stroke,
    last: Pass | None,
    q0: FloatArray,
    transitions: TransitionPlanner,
    *,
    has_run_out: bool,
    in_full: bool = False,
) -> JoinedStroke:
    """Joins a stroke to the last pass, trimming it if need be.

    In a corner of the tile, or close to the floor, there may be no room to turn at full
    speed beyond a stroke's end; then the end is trimmed until there is.

    Args:
        stroke: In T.
        last: The pass before; None = the arm is at rest at `q0`.
        q0: (5,) rad.
        transitions: Finds the moves.
        has_run_out: There is room beyond its end; no way to stop is searched for.
        in_full: Raise if the start of the stroke has to be trimmed.

    Raises:
        CollisionError: There is no clear way to the stroke's own start; if `in_full`.
        ReachError: The same, for the arm's reach.
    """
    trims = np.array(_TRIMS) / stroke.length
    most = 1.0 - _LEAST_LEFT / stroke.length
    first_failure = ""
    for end in range(len(trims)):
        if trims[end] > most:
            return _left_out(stroke, first_failure)
        if has_run_out:
            break
        try:
            transitions.to_rest(stroke_pass(stroke.part(0.0, 1.0 - trims[end])).end)
            break
        except (CollisionError, ReachError) as error:
            first_failure = first_failure or str(error)
    else:
        return _left_out(stroke, first_failure)
    for begin in range(len(trims)):
        if trims[begin] + trims[end] > most:
            break
        trimmed = stroke.part(trims[begin], 1.0 - trims[end])
        try:
            transition = _transition(last, stroke_pass(trimmed).start, q0, transitions)
        except (CollisionError, ReachError) as error:
            if in_full:
                raise
            first_failure = first_failure or str(error)
            continue
        parts = ((0.0, trims[begin]), (1.0 - trims[end], 1.0))
        skipped = [
            SkippedStroke(stroke.part(a, b), first_failure) for a, b in parts if b > a
        ]
        return JoinedStroke(trimmed, transition, skipped)
    return _left_out(stroke, first_failure)


def stroke_pass(stroke: Stroke) -> Pass:
    """Returns the nozzle's pass over a stroke."""
    start, end = nozzle_points(
        np.stack([stroke.start_T, stroke.end_T]), stroke.standoff
    )
    return Pass.between(start, end, stroke.speed)


def _transition(
    last: Pass | None,
    start: MovingState,
    q0: FloatArray,
    transitions: TransitionPlanner,
) -> list[Segment]:
    """Returns the way to a pass; none where it continues the last one straight on."""
    if last is None:
        return transitions.from_rest(q0, start)
    gaps = np.abs([last.end.x - start.x, last.end.v - start.v])
    return [] if gaps.max() < _SAME else transitions.connect(last.end, start)


def _left_out(stroke: Stroke, reason: str) -> JoinedStroke:
    return JoinedStroke(None, [], [SkippedStroke(stroke, reason)])
