"""Gun-off moves between strokes, from rest and to rest, each checked for clearance."""

import functools
import itertools
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from painter.errors import CollisionError, PainterError, ReachError
from painter.planning.arm.kinematics import ArmLimits
from painter.planning.clearance.obstacles import ClearSpace
from painter.planning.motion.blend import MovingState
from painter.planning.motion.gun_path import WallIk, fastest_tool_blend
from painter.planning.motion.joint_motion import (
    Segment,
    fastest_joint_blend,
    least_travel,
    rest_to_rest,
)
from perception.ground import FloatArray

_STEP = 0.02  # s, spacing of the samples that are checked for clearance.
_RAMP_SHARES = (0.5, 0.35, 0.25, 0.15)  # See `ToolBlend.ramp_share`.
_RETRACT_STEP = 0.05  # m; retracts are rounded up to a multiple of it.
# Rest poses from which a pass is approached and to which it is left: (distance back
# along the pass, distance away from the wall), m. The quickest come first.
_APPROACH_POSES = (
    (0.10, 0.03),
    (0.07, 0.0),
    (0.03, 0.06),
    (0.0, 0.10),
    (-0.10, 0.10),
    (-0.10, 0.20),
    (-0.30, 0.15),
    (-0.30, 0.30),
)
_RETREATS = (0.3, 0.2, 0.1)  # m away from the wall, tried in turn.
_RETRACTS_FROM_REST = (0.05, 0.10, 0.20)  # m, between two rest poses.
# Via poses of a free motion; see `TransitionPlanner.free_motion`.
_ROUTES = (
    ("fold",),
    ("unfold",),
    ("fold", "unfold"),
    ("back", "forth"),
    ("back", "fold", "unfold"),
    ("fold", "unfold", "forth"),
    ("back", "fold", "unfold", "forth"),
)
_SQUARE = 1e-6  # rad, largest joint error of a gun that counts as square to the wall.


@dataclass(frozen=True, eq=False)
class TransitionPlanner:
    """Finds moves within joint limits and clearance; remembers what it found.

    Attributes:
        ik: Inverse kinematics before the wall.
        limits: Of the joints, as far as the plan may use them.
        space: What the arm keeps clear of.
        q_home: (5,) rad, folded pose over which detours go.
    """

    ik: WallIk
    limits: ArmLimits
    space: ClearSpace
    q_home: FloatArray
    # Moves found, or why there are none: a program that is linked once more asks for
    # most of them again.
    _known: dict[tuple[bytes, ...], list[Segment] | PainterError] = field(
        default_factory=dict, init=False, repr=False
    )

    def connect(self, start: MovingState, end: MovingState) -> list[Segment]:
        """Joins two moving states: by a blend, a retract, or a detour through rest.

        Args:
            start: State of the nozzle at the start.
            end: State of the nozzle at the end.

        Returns:
            The moves, first to last.

        Raises:
            CollisionError: Every route violates the clearance.
            ReachError: Every route leaves the arm's reach or joint limits.
        """

        def search() -> list[Segment]:
            for retract in self._retracts(min(start.x[2], end.x[2])):
                move = self._quickest_blend(start, end, retract)
                if move is not None:
                    return [move]
            leave = self.to_rest(start)
            return [leave, *self.from_rest(end_q(leave), end)]

        return self._memoised((start.key, end.key), search)

    def from_rest(self, q: FloatArray, end: MovingState) -> list[Segment]:
        """Goes from rest at `q` (5,), rad, to `end`; raises as `connect` does."""

        def arrive(pose: MovingState, failure: PainterError | None) -> list[Segment]:
            blend = self._joint_blend(pose, end, failure)
            return [*self.free_motion(q, start_q(blend)), blend]

        return self._memoised(
            (b"from rest", q.tobytes(), end.key),
            lambda: _first_that_works(arrive, _approach_poses(end, -1.0)),
        )

    def to_rest(self, start: MovingState) -> Segment:
        """Goes from `start` to rest nearby; raises as `connect` does."""

        def leave(pose: MovingState, failure: PainterError | None) -> list[Segment]:
            return [self._joint_blend(start, pose, failure)]

        (move,) = self._memoised(
            (start.key,),
            lambda: _first_that_works(leave, _approach_poses(start, 1.0)),
        )
        return move

    def free_motion(self, q0: FloatArray, q1: FloatArray) -> list[Segment]:
        """Goes from rest to rest: directly, or over poses with more room.

        These are the folded pose with the yaw of the start, with that of the end, and
        with both (fold, turn, unfold); and, before and after, poses straight back from
        the wall.

        Args:
            q0: (5,) rad.
            q1: (5,) rad.

        Returns:
            The moves of the quickest clear route, first to last.

        Raises:
            CollisionError: Every route violates the clearance; names where the direct
                one does.
        """
        direct = rest_to_rest(q0, q1, self.limits)
        best: list[Segment] = [direct] if self.clear(direct) else []
        best = best or self._retracted(q0, q1)
        poses = {"start": q0, "end": q1}
        for q, fold, back in ((q0, "fold", "back"), (q1, "unfold", "forth")):
            poses[fold] = self.folded(float(q[0]))
            retreat = self.retreat(q)
            if retreat is not None:
                poses[back] = retreat

        # Routes share legs, and a clearance check takes time.
        @functools.cache
        def leg(a: str, b: str) -> Segment:
            return rest_to_rest(poses[a], poses[b], self.limits)

        @functools.cache
        def clear(a: str, b: str) -> bool:
            return self.clear(leg(a, b))

        def least(route: list[tuple[str, str]]) -> float:
            travels = (least_travel(poses[a], poses[b], self.limits) for a, b in route)
            return sum(travel.duration for travel in travels)

        routes = [
            list(itertools.pairwise(["start", *filter(poses.__contains__, via), "end"]))
            for via in _ROUTES
        ]
        for route in sorted(routes, key=least):
            if least(route) >= _duration(best):
                break
            moves = [leg(*pair) for pair in route]
            if _duration(moves) < _duration(best) and all(
                clear(*pair) for pair in route
            ):
                best = moves
        if not best:
            self.require_clear(direct, what="free motion")
            raise AssertionError("the direct route was not clear a moment ago")
        return best

    def clear(self, segment: Segment) -> bool:
        """Tells whether a segment keeps the clearance all along."""
        return self.space.all_free(segment.q(sample_times(segment)))

    def require_clear(self, segment: Segment, *, what: str) -> None:
        """Raises CollisionError for a segment, called `what`, that is not clear."""
        time = sample_times(segment)
        self.space.require(segment.q(time), time, what=what)

    def _memoised(
        self, key: tuple[bytes, ...], search: Callable[[], list[Segment]]
    ) -> list[Segment]:
        """Returns or raises what `search` does, which runs once for a key."""
        if key not in self._known:
            try:
                self._known[key] = search()
            except (CollisionError, ReachError) as error:
                self._known[key] = error
        known = self._known[key]
        if isinstance(known, PainterError):
            raise known
        return known

    def _retracted(self, q0: FloatArray, q1: FloatArray) -> list[Segment]:
        """Returns the quickest clear move of the square gun with a retract, if any."""
        _, p_WGs = self.ik.kinematics.gun_poses(np.stack([q0, q1]))
        p_TGs = np.array([self.ik.place(p_WG) for p_WG in p_WGs])
        if not np.allclose(self.ik.inverse_kinematics(p_TGs), [q0, q1], atol=_SQUARE):
            return []
        start, end = (MovingState.at_rest(p_TG) for p_TG in p_TGs)
        ways = itertools.product(_RETRACTS_FROM_REST, _RAMP_SHARES)
        best = self._quickest_tool_blend(start, end, ways)
        return [] if best is None else [best]

    def _quickest_blend(
        self, start: MovingState, end: MovingState, retract: float
    ) -> Segment | None:
        """Returns the quickest clear blend: of the nozzle or, if level, of the joints.

        A joint blend turns faster and does not run out of reach at a tile's corners; a
        nozzle's blend keeps straight between strokes of one line.
        """
        if retract:
            ways = itertools.product([retract], _RAMP_SHARES)
            return self._quickest_tool_blend(start, end, ways)
        best: Segment | None = None
        before, after = self.ik.joint_states(start, end)
        turn = fastest_joint_blend(before, after, self.limits)
        if turn is not None and self.clear(turn):
            best = turn
        return self._quickest_tool_blend(start, end, [(0.0, _RAMP_SHARES[0])], best)

    def _quickest_tool_blend(
        self,
        start: MovingState,
        end: MovingState,
        ways: Iterable[tuple[float, float]],
        best: Segment | None = None,
    ) -> Segment | None:
        """Returns the quickest clear tool blend, or `best` if none is quicker.

        Args:
            start: State of the nozzle at the start.
            end: State of the nozzle at the end.
            ways: Retract, m, and ramp share of those to try.
            best: A clear move that is known already.
        """
        for retract, ramp_share in ways:
            move = fastest_tool_blend(
                start,
                end,
                ik=self.ik,
                limits=self.limits,
                retract=retract,
                ramp_share=ramp_share,
                longest=math.inf if best is None else best.duration,
            )
            if move is not None and self.clear(move):
                best = move
        return best

    def _joint_blend(
        self, start: MovingState, end: MovingState, failure: PainterError | None
    ) -> Segment:
        """Joins two states by their joints; raises as `connect` does.

        To say what is wrong with a blend takes time: an earlier `failure` is raised
        again instead.
        """
        what = f"move from {_place(start)} to {_place(end)}"
        before, after = self.ik.joint_states(start, end)
        blend = fastest_joint_blend(before, after, self.limits)
        if blend is None:
            raise failure or ReachError(
                f"{what} leaves the arm's reach or its joint limits.",
                code="PNT-MOTION-002",
            )
        if failure is None:
            self.require_clear(blend, what=what)
        elif not self.clear(blend):
            raise failure
        return blend

    def _retracts(self, standoff: float) -> list[float]:
        """Returns the retracts to try, m: none, then over ever higher obstacles."""
        tops = np.array([box.upper[2] for box in self.space.boxes])
        needed = tops + self.space.clearance - standoff
        steps = np.unique(np.ceil(needed[needed > 0.0] / _RETRACT_STEP))
        return [0.0, *(steps * _RETRACT_STEP).tolist()]

    def retreat(self, q: FloatArray) -> FloatArray | None:
        """Returns the clear pose (5,) with the gun farthest back from that at `q`."""
        _, p_WGs = self.ik.kinematics.gun_poses(q[None])
        p_TG = self.ik.place(p_WGs[0])
        backs = self.ik.inverse_kinematics(p_TG + np.outer(_RETREATS, [0.0, 0.0, 1.0]))
        good = self.limits.contains(backs)
        good[good] = self.space.free(backs[good])
        return np.array(backs[np.argmax(good)]) if good.any() else None

    def folded(self, yaw: float) -> FloatArray:
        """Returns the home pose (5,) at a yaw, rad; the gun keeps its direction."""
        q = np.array(self.q_home, dtype=float)
        q[4] += q[0] - yaw
        q[0] = yaw
        return q


def sample_times(segment: Segment) -> FloatArray:
    """Returns the times at which a segment is checked for clearance, s."""
    count = max(2, int(np.ceil(segment.duration / _STEP)) + 1)
    return np.linspace(0.0, segment.duration, count)


def start_q(segment: Segment) -> FloatArray:
    """Returns the joint angles (5,) at a segment's start, rad."""
    return np.array(segment.q(np.zeros(1))[0])


def end_q(segment: Segment) -> FloatArray:
    """Returns the joint angles (5,) at a segment's end, rad."""
    return np.array(segment.q(np.array([segment.duration]))[0])


def _duration(moves: Sequence[Segment]) -> float:
    """Returns how long moves take, s; infinitely long if there are none."""
    return sum(move.duration for move in moves) if moves else math.inf


def _first_that_works(
    attempt: Callable[[MovingState, PainterError | None], list[Segment]],
    poses: Sequence[MovingState],
) -> list[Segment]:
    """Returns the first attempt that succeeds, or raises the first one's failure."""
    failure: PainterError | None = None
    for pose in poses:
        try:
            return attempt(pose, failure)
        except (CollisionError, ReachError) as error:
            failure = failure or error
    assert failure is not None
    raise failure


def _approach_poses(state: MovingState, sign: float) -> list[MovingState]:
    """Returns rest poses behind (-1) or beyond (+1) a moving nozzle in T."""
    along = sign * state.v / np.linalg.norm(state.v)
    away = np.array([0.0, 0.0, 1.0])
    return [
        MovingState.at_rest(state.x + back * along + out * away)
        for back, out in _APPROACH_POSES
    ]


def _place(state: MovingState) -> str:
    x, y, z = state.x
    return f"T ({x:.2f}, {y:.2f}, {z:.2f}) m"
