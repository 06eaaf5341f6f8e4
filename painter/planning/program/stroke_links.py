"""From strokes to every move of the arm: their order in time, the ways between them.

Where there is no way to the whole of a stroke it is trimmed, and what cannot be come to
is left out and said.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from painter.errors import CollisionError, ReachError
from painter.planning.motion.blend import MovingState
from painter.planning.motion.gun_path import Pass, ToolMove
from painter.planning.motion.joint_motion import Dwell, Segment
from painter.planning.motion.transitions import TransitionPlanner, end_q
from painter.planning.program.clear_strokes import has_run_out, nozzle_points
from painter.planning.spray_path import SkippedStroke, Stroke
from painter.planning.strokes.stroke_order import order_strokes
from perception.ground import FloatArray

_TRIMS = (0.0, 0.02, 0.05, 0.10, 0.20)  # m, off a stroke's end for room to turn.
_LEAST_LEFT = 1e-3  # m, of a trimmed stroke; shorter is rounding.

# m and m/s; strokes whose flow alone differs follow one another without a gap.
_SAME = 1e-9

# The segments; the strokes that could be come to; the index of each one's segment; and
# the strokes that could not, with the reason.
Links = tuple[list[Segment], tuple[Stroke, ...], list[int], list[SkippedStroke]]


def connect_strokes(
    strokes: Sequence[Stroke],
    q0: FloatArray,
    transitions: TransitionPlanner,
    flash_off: float,
) -> Links:
    """Orders and joins strokes coat by coat; the arm rests at home between them.

    Args:
        strokes: Clear of obstacles, in any order.
        q0: (5,) rad, where the arm is at rest.
        transitions: Finds the moves; its home is where the arm rests at last.
        flash_off: Rest between two coats, s.

    Returns:
        Segments, strokes, their segments, and what is left out; see `Links`.

    Raises:
        CollisionError: There is no clear way to any stroke, or home.
        ReachError: The same, for the arm's reach.
    """
    path: list[Segment] = []
    done: list[Stroke] = []
    passes: list[int] = []
    skipped: list[SkippedStroke] = []
    ik, q = transitions.ik, q0
    for coat in sorted({stroke.coat for stroke in strokes}) or [1]:
        if path and flash_off > 0.0:
            path.append(Dwell(q, flash_off))
        rests = [
            ik.place(p_WG)
            for p_WG in ik.kinematics.nozzle(np.stack([q, transitions.q_home]))
        ]
        of_coat = [stroke for stroke in strokes if stroke.coat == coat]
        ordered = order_strokes(of_coat, *rests)
        segments, sprayed, of_path, unlinked = _linked(ordered, q, transitions)
        passes += [len(path) + index for index in of_path]
        path += segments
        done += sprayed
        skipped += unlinked
        q = transitions.q_home
    return path, tuple(done), passes, skipped


def _linked(
    strokes: Sequence[Stroke], q0: FloatArray, transitions: TransitionPlanner
) -> Links:
    """Joins strokes by moves, from rest at `q0` to rest at home.

    Beyond a stroke with run-out there is believed to be a way back. Where it turns out
    that from there one cannot go on, the stroke is joined once more, its way back
    looked for.
    """
    believed = has_run_out(strokes, transitions)
    fits: list[_Fit] = []
    home: list[Segment] = []
    while not home:
        done = [number for number, fit in enumerate(fits) if fit.stroke is not None]
        last = _last_pass(fits)
        doubtful = bool(done and believed[done[-1]])
        try:
            if len(fits) < len(strokes):
                wanted, roomy = strokes[len(fits)], bool(believed[len(fits)])
                fits.append(
                    _fit(wanted, roomy, last, q0, transitions, in_full=doubtful)
                )
            else:
                home = _way_home(last, q0, transitions)
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
            path += [*fit.link, ToolMove(_pass(fit.stroke), transitions.ik)]
            passes.append(len(path) - 1)
            sprayed.append(fit.stroke)
    if strokes and not sprayed:
        raise CollisionError(
            f"no stroke can be come to: {skipped[0].reason}", code="PNT-PROGRAM-007"
        )
    return [*path, *home], tuple(sprayed), passes, skipped


def _way_home(
    last: Pass | None, q0: FloatArray, transitions: TransitionPlanner
) -> list[Segment]:
    """Goes from the last pass, or from rest at `q0`, to rest at home."""
    if last is None:
        return transitions.free_motion(q0, transitions.q_home)
    leave = transitions.to_rest(last.end)
    return [leave, *transitions.free_motion(end_q(leave), transitions.q_home)]


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
    transitions: TransitionPlanner,
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
            transitions.to_rest(_pass(stroke).end)  # There must be a way back.
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
                link = transitions.from_rest(q0, start)
            elif _goes_on(last.end, start):
                link = []
            else:
                link = transitions.connect(last.end, start)
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
