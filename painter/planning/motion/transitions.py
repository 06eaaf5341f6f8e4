"""Gun-off moves between strokes, from rest and to rest, each checked for clearance."""

import functools
import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from painter.errors import CollisionError, PainterError, ReachError
from painter.planning.arm.kinematics import ArmLimits
from painter.planning.clearance.obstacles import ClearSpace
from painter.planning.motion.blend import MovingState
from painter.planning.motion.gun_path import ToolMove, WallIk, fastest_tool_blend
from painter.planning.motion.joint_motion import (
    Segment,
    fastest_joint_blend,
    least_travel,
    rest_to_rest,
)
from perception.ground import FloatArray, FrozenValue

_STEP = 0.02  # s, spacing of the samples that are checked for clearance.
_RISES = (0.5, 0.35, 0.25, 0.15)  # See `ToolBlend.rise`.
_HOP_STEP = 0.05  # m; hops are rounded up to a multiple of it.
# Standstills from which a pass is approached and to which it is left: (distance back
# along the pass, distance away from the wall), m. Those first cost the least time.
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
_RETREATS = (0.3, 0.2, 0.1)  # m from where the gun is, tried in turn.
_RETREATS_BETWEEN = (0.05, 0.10, 0.20)  # m, on the way from one rest to another.
# The places that a transit goes over; see `TransitionPlanner.free_motion`.
_ROUTES = (
    ("fold",),
    ("unfold",),
    ("fold", "unfold"),
    ("back", "forth"),
    ("back", "fold", "unfold"),
    ("fold", "unfold", "forth"),
    ("back", "fold", "unfold", "forth"),
)
_SQUARE = 1e-6  # rad, at most, by which the gun is off where it counts as square.


@dataclass(frozen=True, eq=False)
class TransitionPlanner(FrozenValue):
    """Finds moves that keep joint limits and clearance.

    Attributes:
        gun: Inverse kinematics before the wall.
        limits: Of the joints, as far as the plan may use them.
        space: What must be kept clear of.
        q_home: (5,) rad, folded pose over which detours go.
    """

    gun: WallIk
    limits: ArmLimits
    space: ClearSpace
    q_home: FloatArray
    # Moves that were looked for, or why there are none: a program that has to be linked
    # once more asks for most of them again.
    _known: dict[tuple[str, bytes, bytes], list[Segment] | PainterError] = field(
        default_factory=dict, init=False, repr=False
    )

    def connect(self, start: MovingState, end: MovingState) -> list[Segment]:
        """Joins two moving states: by a blend, a hop, or a detour through rest.

        Args:
            start: Where the gun comes from.
            end: Where it goes on.

        Returns:
            The moves, first to last.

        Raises:
            CollisionError: Every way comes too near to something.
            ReachError: Every way leaves the arm's reach or joint limits.
        """

        def look() -> list[Segment]:
            for hop in self._hops(min(start.x[2], end.x[2])):
                way = self._way(start, end, hop)
                if way is not None:
                    return [way]
            leave = self.to_rest(start)
            return [leave, *self.from_rest(end_q(leave), end)]

        return self._once(("between", start.key, end.key), look)

    def from_rest(self, q: FloatArray, end: MovingState) -> list[Segment]:
        """Goes from rest at `q` (5,), rad, to `end`; raises as `between` does."""

        def look() -> list[Segment]:
            failure: PainterError | None = None
            for approach in _approach_poses(end, -1.0):
                try:
                    arrive = self._blend(approach, end, failure)
                    return [*self.free_motion(q, start_q(arrive)), arrive]
                except (CollisionError, ReachError) as error:
                    failure = failure or error
            assert failure is not None
            raise failure

        return self._once(("from rest", q.tobytes(), end.key), look)

    def to_rest(self, start: MovingState) -> Segment:
        """Goes from `start` to rest nearby; raises as `between` does."""

        def look() -> list[Segment]:
            failure: PainterError | None = None
            for approach in _approach_poses(start, 1.0):
                try:
                    return [self._blend(start, approach, failure)]
                except (CollisionError, ReachError) as error:
                    failure = failure or error
            assert failure is not None
            raise failure

        (move,) = self._once(("to rest", start.key, b""), look)
        return move

    def free_motion(self, q0: FloatArray, q1: FloatArray) -> list[Segment]:
        """Goes from rest to rest: directly, or over poses where there is more room.

        These are the folded pose with the yaw of the start, with that of the end, and
        with both (fold, turn, unfold); and, before and after, poses straight back from
        the wall.

        Args:
            q0: (5,) rad.
            q1: (5,) rad.

        Returns:
            The moves of the quickest clear route, first to last.

        Raises:
            CollisionError: Every route comes too near to something; tells where the
                direct one does.
        """
        direct = rest_to_rest(q0, q1, self.limits)
        best: list[Segment] = [direct] if self.clear(direct) else []
        best = best or self._over_retreats(q0, q1)
        places = {"start": q0, "end": q1}
        for q, fold, back in ((q0, "fold", "back"), (q1, "unfold", "forth")):
            places[fold] = self._folded(float(q[0]))
            drawn = self._retreat(q)
            if drawn is not None:
                places[back] = drawn

        # Routes share legs, and to check one for clearance takes time.
        @functools.cache
        def leg(a: str, b: str) -> Segment:
            return rest_to_rest(places[a], places[b], self.limits)

        @functools.cache
        def clear(a: str, b: str) -> bool:
            return self.clear(leg(a, b))

        ways = [
            list(
                itertools.pairwise(["start", *filter(places.__contains__, via), "end"])
            )
            for via in _ROUTES
        ]
        least = [
            sum(
                least_travel(places[a], places[b], self.limits).duration for a, b in way
            )
            for way in ways
        ]
        for number in np.argsort(least, kind="stable"):
            longest = _duration(best)
            if least[number] >= longest:
                break
            moves = [leg(*pair) for pair in ways[number]]
            if _duration(moves) < longest and all(
                clear(*pair) for pair in ways[number]
            ):
                best = moves
        if not best:
            self.require_clear(direct, what="transit")
            raise AssertionError("the direct route was not clear a moment ago")
        return best

    def clear(self, segment: Segment) -> bool:
        """Returns whether a segment keeps its clearance all the way."""
        return self.space.all_free(segment.q(sample_times(segment)))

    def require_clear(self, segment: Segment, *, what: str) -> None:
        """Raises CollisionError if a segment, called `what`, does not keep clear."""
        time = sample_times(segment)
        self.space.require(segment.q(time), time, what=what)

    def _once(
        self, what: tuple[str, bytes, bytes], look: Callable[[], list[Segment]]
    ) -> list[Segment]:
        """Returns or raises what `look` does, which is asked once."""
        if what not in self._known:
            try:
                self._known[what] = look()
            except (CollisionError, ReachError) as error:
                self._known[what] = error
        known = self._known[what]
        if isinstance(known, PainterError):
            raise known
        return known

    def _over_retreats(self, q0: FloatArray, q1: FloatArray) -> list[Segment]:
        """Returns the quickest clear move of the square gun over a hop, if any."""
        _, p_WGs = self.gun.kinematics.gun_poses(np.stack([q0, q1]))
        p_TGs = np.array([self.gun.place(p_WG) for p_WG in p_WGs])
        if not np.allclose(self.gun.inverse_kinematics(p_TGs), [q0, q1], atol=_SQUARE):
            return []
        start, end = (MovingState.at_rest(p_TG) for p_TG in p_TGs)
        best: list[Segment] = []
        for hop, rise in itertools.product(_RETREATS_BETWEEN, _RISES):
            move = self._tool_move(start, end, hop, rise, _duration(best))
            if move is not None and self.clear(move):
                best = [move]
        return best

    def _way(self, start: MovingState, end: MovingState, hop: float) -> Segment | None:
        """Returns the quickest clear blend: of the nozzle, or without hop of joints.

        A joint blend turns faster and does not run out of reach at a tile's corners; a
        nozzle's blend keeps straight between strokes of one line.
        """
        best: Segment | None = None
        if not hop:
            before, after = self.gun.joint_states(start, end)
            turn = fastest_joint_blend(before, after, self.limits)
            if turn is not None and self.clear(turn):
                best = turn
        for rise in _RISES if hop else _RISES[:1]:
            longest = math.inf if best is None else best.duration
            move = self._tool_move(start, end, hop, rise, longest)
            if move is not None and self.clear(move):
                best = move
        return best

    def _tool_move(
        self,
        start: MovingState,
        end: MovingState,
        hop: float,
        rise: float,
        longest: float = math.inf,
    ) -> ToolMove | None:
        blend = fastest_tool_blend(
            start,
            end,
            gun=self.gun,
            limits=self.limits,
            hop=hop,
            rise=rise,
            longest=longest,
        )
        return None if blend is None else ToolMove(blend, self.gun)

    def _blend(
        self, start: MovingState, end: MovingState, failure: PainterError | None
    ) -> Segment:
        """Joins two states by their joints; raises as `between` does.

        What is wrong with this blend takes time to say; where there is a `failure` to
        be told of already, that is raised once more.
        """
        what = f"move from {_place(start)} to {_place(end)}"
        before, after = self.gun.joint_states(start, end)
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

    def _hops(self, standoff: float) -> list[float]:
        """Returns how far to draw back, m: not at all, then over higher and higher."""
        tops = np.array([box.upper[2] for box in self.space.boxes])
        needed = tops + self.space.clearance - standoff
        steps = np.unique(np.ceil(needed[needed > 0.0] / _HOP_STEP))
        return [0.0, *(steps * _HOP_STEP).tolist()]

    def _retreat(self, q: FloatArray) -> FloatArray | None:
        """Returns the pose with the gun drawn farthest back from the wall, if any."""
        _, p_WGs = self.gun.kinematics.gun_poses(q[None])
        p_TG = self.gun.place(p_WGs[0])
        backs = self.gun.inverse_kinematics(p_TG + np.outer(_RETREATS, [0.0, 0.0, 1.0]))
        good = self.limits.contains(backs)
        good[good] = self.space.free(backs[good])
        return np.array(backs[np.argmax(good)]) if good.any() else None

    def _folded(self, yaw: float) -> FloatArray:
        """Returns the home pose turned to a yaw, the gun keeping its direction."""
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


def _duration(way: Sequence[Segment]) -> float:
    """Returns how long a way takes, s; infinitely long if there is none."""
    return sum(segment.duration for segment in way) if way else math.inf


def _approach_poses(state: MovingState, sign: float) -> list[MovingState]:
    """Returns standstills behind (-1) or beyond (+1) a moving nozzle in T."""
    along = sign * state.v / np.linalg.norm(state.v)
    away = np.array([0.0, 0.0, 1.0])
    return [
        MovingState.at_rest(state.x + back * along + out * away)
        for back, out in _APPROACH_POSES
    ]


def _place(state: MovingState) -> str:
    x, y, z = state.x
    return f"T ({x:.2f}, {y:.2f}, {z:.2f}) m"
