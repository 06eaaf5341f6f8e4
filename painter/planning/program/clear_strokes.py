"""Cuts strokes back to where the gun keeps clear and the arm reaches."""

from collections.abc import Sequence

import numpy as np

from painter.planning.motion.reach import require_reach
from painter.planning.motion.transitions import TransitionPlanner
from painter.planning.spray_path import SkippedStroke, Stroke
from painter.planning.strokes.film_fit import LEAST_FLOW
from perception.ground import BoolArray, FloatArray

_STEP = 0.03  # m along a stroke, between the places that are checked.
# m, cut off a stroke before an obstacle that the gun cannot pass with its clearance:
# the arm stops and turns there at 0.6 m/s.
_STOPPING = 0.12
# m beyond a stroke's end and m away from the wall: where the arm stops, and half way.
RUN_OUT = ((0.10, 0.03), (0.05, 0.01))
_SLOWER = (1.0, 0.9, 0.8, 0.7, 0.6, 0.5)  # Shares of a stroke's speed, in turn.
_TOO_BENT = "the wall's surface bends too sharply for the joints at this speed"
# Share of the strokes' length; if more is out of reach the base is in the wrong place.
# A touch-up also finds what the job itself could not reach: it sprays the rest.
_MOST_OUT_OF_REACH = 0.05


def clear_strokes(
    strokes: Sequence[Stroke], transitions: TransitionPlanner, min_stroke: float
) -> tuple[list[Stroke], list[SkippedStroke]]:
    """Cuts strokes back to their feasible parts.

    On a wall that is not flat, strokes that the joints cannot follow are slowed first.

    Args:
        strokes: In T.
        transitions: Gives reach and clearance.
        min_stroke: Shorter parts are skipped, m.

    Returns:
        The parts that are kept, and those that are skipped with the reason.

    Raises:
        ReachError: More than a twentieth of the strokes' length is out of the arm's
            reach; of touch-ups, all of it.
    """
    if not strokes:
        return [], []
    if transitions.ik.surface is not None:
        strokes = [_slowed(stroke, transitions) for stroke in strokes]
    shares = [_shares(stroke) for stroke in strokes]
    counts = [share.size for share in shares]
    # All at once: checking one place takes as long as checking fifty.
    p_TGs = np.concatenate(
        [
            nozzle_points(
                stroke.start_T + np.outer(share, stroke.end_T - stroke.start_T),
                stroke.standoff,
            )
            for stroke, share in zip(strokes, shares, strict=True)
        ]
    )
    q = transitions.ik.inverse_kinematics(p_TGs)
    reached = transitions.limits.contains(q)
    total = sum(stroke.length for stroke in strokes)
    first_time = np.repeat([stroke.kind != "touch_up" for stroke in strokes], counts)
    missed = np.count_nonzero(first_time & ~reached) * _STEP
    if missed > _MOST_OUT_OF_REACH * total or not reached.any():
        require_reach(
            p_TGs, ik=transitions.ik, limits=transitions.limits, what="strokes"
        )
    free = np.array(reached)
    free[reached] = transitions.space.free(q[reached])
    turns = np.ones(len(q), dtype=bool)
    if transitions.ik.surface is not None:
        turns = np.concatenate(
            [_keeps_rates(stroke, transitions) for stroke in strokes]
        )
    free &= turns
    clear: list[Stroke] = []
    skipped: list[SkippedStroke] = []
    ends = np.cumsum(counts)
    for stroke, end, count in zip(strokes, ends, counts, strict=True):
        rows = slice(end - count, end)
        if free[rows].all():
            clear.append(stroke)
            continue
        kept, lost = _cut_back(
            stroke, q[rows], free[rows], turns[rows], transitions, min_stroke
        )
        clear += kept
        skipped += lost
    return clear, skipped


def has_run_out(strokes: Sequence[Stroke], transitions: TransitionPlanner) -> BoolArray:
    """Returns beyond which strokes the gun has room to stop.

    Args:
        strokes: In T, in their direction of travel.
        transitions: Gives reach and clearance.

    Returns:
        (n,) bool; where it is True, a transition from the stroke hardly ever fails.
    """
    if not strokes:
        return np.zeros(0, dtype=bool)
    along = [(stroke.end_T - stroke.start_T) / stroke.length for stroke in strokes]
    p_TGs = np.stack(
        [
            np.append(stroke.end_T + beyond * ahead, stroke.standoff + out)
            for stroke, ahead in zip(strokes, along, strict=True)
            for beyond, out in RUN_OUT
        ]
    )
    q = transitions.ik.inverse_kinematics(p_TGs)
    free = transitions.limits.contains(q)
    free[free] = transitions.space.free(q[free])
    return np.asarray(free.reshape(len(strokes), -1).all(axis=1))


def _shares(stroke: Stroke) -> FloatArray:
    """Returns the shares (n,) of a stroke's length at which it is checked."""
    return np.linspace(0.0, 1.0, max(2, int(np.ceil(stroke.length / _STEP)) + 1))


def _slowed(stroke: Stroke, transitions: TransitionPlanner) -> Stroke:
    """Slows a stroke until the joints can follow it over a bent wall.

    Its flow falls by the same share, so that its film stays. A stroke that is too fast
    even at half its speed is returned unchanged.
    """
    for factor in _SLOWER:
        slower = stroke.replace(speed=factor * stroke.speed, flow=factor * stroke.flow)
        enough = slower.flow >= min(LEAST_FLOW, stroke.flow)
        if enough and _keeps_rates(slower, transitions).all():
            return slower
    return stroke


def _keeps_rates(stroke: Stroke, transitions: TransitionPlanner) -> BoolArray:
    """Returns at which places (n,) of a stroke the joints can follow its speed."""
    travel = stroke.end_T - stroke.start_T
    p_TGs = nozzle_points(
        stroke.start_T + np.outer(_shares(stroke), travel), stroke.standoff
    )
    v_TG = np.append(travel * (stroke.speed / stroke.length), 0.0)
    return transitions.ik.within_rates(p_TGs, v_TG, transitions.limits)


def nozzle_points(p_T: FloatArray, standoff: float) -> FloatArray:
    """Returns nozzle positions (n, 3), m, over wall points (n, 2), in T."""
    return np.column_stack([p_T, np.full(len(p_T), standoff)])


def _cut_back(
    stroke: Stroke,
    q: FloatArray,
    free: BoolArray,
    turns: BoolArray,
    transitions: TransitionPlanner,
    min_stroke: float,
) -> tuple[list[Stroke], list[SkippedStroke]]:
    """Splits a stroke, free at some of its places, into kept and skipped parts."""
    share = np.linspace(0.0, 1.0, len(free))
    stopping = _STOPPING / stroke.length
    clear: list[Stroke] = []
    skipped: list[SkippedStroke] = []
    for first, last, is_free in _runs(free):
        cut_start, cut_end = first > 0, last < len(free) - 1
        if is_free:
            begin = share[first] + stopping * cut_start
            end = max(share[last] - stopping * cut_end, begin)
        else:
            begin = max(share[first] - stopping - share[1], 0.0) if cut_start else 0.0
            end = min(share[last] + stopping + share[1], 1.0) if cut_end else 1.0
        part = stroke.part(begin, end)
        if is_free and part.length >= min_stroke:
            clear.append(part)
        elif is_free:
            skipped.append(SkippedStroke(part, "shorter than raster.min_stroke"))
        else:
            middle = (first + last) // 2
            if not transitions.limits.contains(q[[middle]])[0]:
                reason = "out of the arm's reach"
            elif not turns[middle]:
                reason = _TOO_BENT
            else:
                reason = transitions.space.worst_pair(q[middle])
            skipped.append(SkippedStroke(part, reason))
    return clear, skipped


def _runs(free: BoolArray) -> list[tuple[int, int, bool]]:
    """Returns (first, last, value) of each run of equal values."""
    edges = np.flatnonzero(np.diff(free.astype(int))) + 1
    firsts = [0, *edges.tolist()]
    lasts = [*(edges - 1).tolist(), len(free) - 1]
    return [(a, b, bool(free[a])) for a, b in zip(firsts, lasts, strict=True)]
