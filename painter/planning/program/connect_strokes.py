"""From strokes to every move of the arm: their order, and the transitions between them.

Strokes are trimmed where the arm cannot turn, and infeasible ones are left out with the
reason.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from painter.errors import CollisionError, ReachError
from painter.planning.motion.gun_path import Pass, ToolMove
from painter.planning.motion.joint_motion import Dwell, Segment
from painter.planning.motion.transitions import TransitionPlanner, end_q
from painter.planning.program.clear_strokes import has_run_out
from painter.planning.program.join_stroke import JoinedStroke, join_stroke, stroke_pass
from painter.planning.spray_path import SkippedStroke, Stroke
from painter.planning.strokes.stroke_order import order_strokes
from perception.ground import FloatArray


@dataclass(frozen=True)
class ConnectedStrokes:
    """Strokes and the transitions between them, as one path.

    Attributes:
        path: All segments, in order.
        strokes: The feasible strokes, trimmed, in order.
        passes: Index in `path` of each stroke's segment.
        skipped: Strokes, or parts of them, that are left out.
    """

    path: list[Segment]
    strokes: list[Stroke]
    passes: list[int]
    skipped: list[SkippedStroke]


def connect_strokes(
    strokes: Sequence[Stroke],
    q0: FloatArray,
    transitions: TransitionPlanner,
    flash_off: float,
) -> ConnectedStrokes:
    """Orders and joins strokes coat by coat; the arm rests at home between coats.

    Args:
        strokes: Clear of obstacles, in any order.
        q0: (5,) rad, where the arm is at rest.
        transitions: Finds the moves; the path ends at rest at its home.
        flash_off: Time between two coats, s.

    Raises:
        CollisionError: There is no clear way to any stroke, or home.
        ReachError: The same, for the arm's reach.
    """
    connected = ConnectedStrokes([], [], [], [])
    ik, q = transitions.ik, q0
    for coat in sorted({stroke.coat for stroke in strokes}) or [1]:
        if connected.path and flash_off > 0.0:
            connected.path.append(Dwell(q, flash_off))
        rests = [
            ik.place(p_WG)
            for p_WG in ik.kinematics.nozzle(np.stack([q, transitions.q_home]))
        ]
        of_coat = [stroke for stroke in strokes if stroke.coat == coat]
        _connect_coat(connected, order_strokes(of_coat, *rests), q, transitions)
        q = transitions.q_home
    return connected


def _connect_coat(
    connected: ConnectedStrokes,
    strokes: Sequence[Stroke],
    q0: FloatArray,
    transitions: TransitionPlanner,
) -> None:
    """Adds strokes and their transitions, from rest at `q0` to rest at home."""
    joined, home = join_all(strokes, q0, transitions)
    for part in joined:
        connected.skipped.extend(part.skipped)
        if part.stroke is not None:
            connected.path.extend(part.transition)
            connected.passes.append(len(connected.path))
            connected.path.append(ToolMove(stroke_pass(part.stroke), transitions.ik))
            connected.strokes.append(part.stroke)
    if strokes and all(part.stroke is None for part in joined):
        raise CollisionError(
            f"no stroke can be approached: {joined[0].skipped[0].reason}",
            code="PNT-PROGRAM-007",
        )
    connected.path.extend(home)


def join_all(
    strokes: Sequence[Stroke], q0: FloatArray, transitions: TransitionPlanner
) -> tuple[list[JoinedStroke], list[Segment]]:
    """Joins strokes one after another; returns them and the way home from the last.

    A stroke with run-out is assumed to have a way on from its end. If there turns out
    to be none, the stroke is joined again and a way to stop beyond it searched for.
    """
    run_out = has_run_out(strokes, transitions)
    joined: list[JoinedStroke] = []
    while True:
        done = [
            (number, part.stroke)
            for number, part in enumerate(joined)
            if part.stroke is not None
        ]
        number, stroke = done[-1] if done else (-1, None)
        last = None if stroke is None else stroke_pass(stroke)
        is_assumed = stroke is not None and bool(run_out[number])
        try:
            if len(joined) == len(strokes):
                return joined, _way_home(last, q0, transitions)
            joined.append(
                join_stroke(
                    strokes[len(joined)],
                    last,
                    q0,
                    transitions,
                    has_run_out=bool(run_out[len(joined)]),
                    in_full=is_assumed,
                )
            )
        except (CollisionError, ReachError):
            if not is_assumed:
                raise
            run_out[number] = False
            del joined[number:]


def _way_home(
    last: Pass | None, q0: FloatArray, transitions: TransitionPlanner
) -> list[Segment]:
    """Returns the way from the last pass, or from rest at `q0`, to rest at home."""
    if last is None:
        return transitions.free_motion(q0, transitions.q_home)
    leave = transitions.to_rest(last.end)
    return [leave, *transitions.free_motion(end_q(leave), transitions.q_home)]
