"""Joint-space motion: blends within the joints' limits, and chaining into a Motion."""

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.interpolate import CubicSpline

from painter.planning.arm.kinematics import ArmLimits
from painter.planning.motion.blend import KNOTS, MovingState, Shares, evaluate, plateaus
from painter.planning.spray_path import Motion
from perception.ground import BoolArray, FloatArray, FrozenValue

_POSITION_MARGIN = 0.02  # rad, kept off a joint's end by plans.
_SHORTEST_MOVE = 0.05  # s; a move of no length still lasts a few samples.
# Share of the time in which a move speeds up, by which the acceleration rises, and
# falls again: 0.1 s where a stretched arm starts off, so that drives can follow.
_TRAVEL_RAMP = 0.2
_SHORTEST_CRUISE = 1e-6  # s; a shorter one is rounding.
_DURATIONS = np.geomspace(_SHORTEST_MOVE, 8.0, 60)  # s, of blends, tried in turn.
_SAMPLES = Shares.at(np.linspace(0.0, 1.0, 33))  # Where a blend's rates are looked at.
# The peak between two samples may exceed what is seen at them a little.
SEARCH_SHARE = 0.98
_DENSE_STEP = 0.004  # s, of the second look at a move that was found.
_TORQUE_EVERY = 5  # Of these samples, one is looked at for torque.
_SLOWER = 1.05  # By which a move is slowed that fails the second look,
_SLOWER_STEPS = 30  # and how often.
_AT_A_TIME = 6  # Durations that are looked at together.


class Segment(Protocol):
    """A piece of motion; chained pieces meet with equal q, its rate and its second."""

    @property
    def duration(self) -> float:
        """Length in time, s."""

    @property
    def knots(self) -> FloatArray:
        """Times from 0 to `duration` between which it is smooth throughout, s."""

    def q(self, time: FloatArray) -> FloatArray:
        """Returns (n, 5) rad at `time` (n,) s from the segment's own start."""


@dataclass(frozen=True, eq=False)
class JointBlend(FrozenValue):
    """A `Segment` that blends two joint states; see `painter.planning.motion.blend`.

    Attributes:
        start: Joint state at its start, rad.
        end: Joint state at its end, rad.
        duration: s.
    """

    start: MovingState
    end: MovingState
    duration: float

    @property
    def knots(self) -> FloatArray:
        """See `Segment.knots`."""
        return np.asarray(KNOTS * self.duration)

    def q(self, time: FloatArray) -> FloatArray:
        """See `Segment.q`."""
        shares = Shares.at(np.asarray(time) / self.duration)
        q, _ = evaluate(self.start, self.end, np.array([self.duration]), shares)
        return np.asarray(q[0])


@dataclass(frozen=True, eq=False)
class JointTravel(FrozenValue):
    """A `Segment` straight from rest to rest: it speeds up, cruises and slows down.

    While it speeds up the acceleration rises to a plateau and falls again, linearly;
    slowing down is the same backwards. All joints share one law of time.

    Attributes:
        q0: (5,) rad, at its start.
        q1: (5,) rad, at its end.
        speed_up: How long it speeds up, and slows down again, s.
        cruise: How long it goes at constant rates between, s; may be 0.
    """

    q0: FloatArray
    q1: FloatArray
    speed_up: float
    cruise: float

    @property
    def duration(self) -> float:
        """Length in time, s."""
        return 2.0 * self.speed_up + self.cruise

    @property
    def knots(self) -> FloatArray:
        """See `Segment.knots`."""
        ramp = _TRAVEL_RAMP
        begin = self.speed_up * np.array([0.0, ramp, 1.0 - ramp, 1.0])
        end = self.duration - begin[::-1]
        # Without a cruise the first of the end is the last of the beginning.
        return np.concatenate([begin, end[0 if self.cruise else 1 :]])

    def q(self, time: FloatArray) -> FloatArray:
        """See `Segment.q`."""
        t = np.clip(np.asarray(time, dtype=float), 0.0, self.duration)
        near_start = t <= 0.5 * self.duration
        way = self._way(np.where(near_start, t, self.duration - t))
        share = np.where(near_start, way, 1.0 - way)[:, None]
        return np.asarray((1.0 - share) * self.q0 + share * self.q1)

    def _way(self, t: FloatArray) -> FloatArray:
        """Returns the share of the way that is gone at `t`, in the first half, s."""
        rise, ramp = self.speed_up, _TRAVEL_RAMP * self.speed_up
        rate = 1.0 / (rise + self.cruise)
        acceleration = rate / (rise - ramp)
        rising = acceleration * t**3 / (6.0 * ramp)
        after = t - ramp
        steady = acceleration * (ramp**2 / 6.0 + after * (ramp + after) / 2.0)
        rest = np.maximum(rise - t, 0.0)
        falling = rate * (t - 0.5 * rise) + acceleration * rest**3 / (6.0 * ramp)
        return np.where(t < ramp, rising, np.where(rest > ramp, steady, falling))


@dataclass(frozen=True, eq=False)
class Stand(FrozenValue):
    """A `Segment` that stands still.

    Attributes:
        q0: (5,) rad, where.
        duration: s.
    """

    q0: FloatArray
    duration: float

    @property
    def knots(self) -> FloatArray:
        """See `Segment.knots`."""
        return np.array([0.0, self.duration])

    def q(self, time: FloatArray) -> FloatArray:
        """See `Segment.q`."""
        return np.tile(self.q0, (np.size(time), 1))


def planning_limits(limits: ArmLimits, share: float) -> ArmLimits:
    """Returns what a plan may use of the joints' limits.

    Args:
        limits: Of the joints.
        share: Of velocities, accelerations, torques and the nozzle's speed; positions
            keep 0.02 rad off their ends.
    """
    return limits.replace(
        q_min=limits.q_min + _POSITION_MARGIN,
        q_max=limits.q_max - _POSITION_MARGIN,
        v_max=share * limits.v_max,
        a_max=share * limits.a_max,
        effort_max=share * limits.effort_max,
        nozzle_speed=share * limits.nozzle_speed,
    )


def rest_to_rest(q0: FloatArray, q1: FloatArray, limits: ArmLimits) -> JointTravel:
    """Makes the fastest straight move from rest to rest.

    Args:
        q0: (5,) rad.
        q1: (5,) rad.
        limits: Of the joints, as far as the plan may use them.
    """
    move = least_travel(q0, q1, limits)
    # What gravity alone takes cannot be saved by going slower.
    for _ in range(_SLOWER_STEPS):
        if within_limits(move.q, move.duration, limits):
            break
        move = JointTravel(q0, q1, _SLOWER * move.speed_up, _SLOWER * move.cruise)
    return move


def least_travel(q0: FloatArray, q1: FloatArray, limits: ArmLimits) -> JointTravel:
    """Makes the move that rates and accelerations of the joints alone allow.

    Torques and the nozzle's speed may want a slower one; see `rest_to_rest`.
    """
    travel = np.abs(q1 - q0)
    # Of the whole way, by the joint that allows least: 1/s and 1/s².
    with np.errstate(divide="ignore"):
        rate = SEARCH_SHARE * float(np.min(limits.v_max / travel))
        acceleration = SEARCH_SHARE * float(np.min(limits.a_max / travel))
    rate = min(
        rate, math.sqrt((1.0 - _TRAVEL_RAMP) * acceleration), 2.0 / _SHORTEST_MOVE
    )
    speed_up = max(rate / ((1.0 - _TRAVEL_RAMP) * acceleration), 0.5 * _SHORTEST_MOVE)
    cruise = 1.0 / rate - speed_up
    return JointTravel(q0, q1, speed_up, cruise if cruise > _SHORTEST_CRUISE else 0.0)


def fastest_joint_blend(
    start: MovingState, end: MovingState, limits: ArmLimits
) -> JointBlend | None:
    """Finds the joint blend of shortest duration that keeps the limits.

    Args:
        start: Joint state at the start.
        end: Joint state at the end.
        limits: Of the joints, as far as the plan may use them.

    Returns:
        The blend, or None if no duration up to 8 s keeps them.
    """

    def possible(durations: FloatArray) -> BoolArray:
        first, second = plateaus(start, end, durations)
        peak = np.maximum(np.abs(first), np.abs(second))
        return np.asarray((peak <= SEARCH_SHARE * limits.a_max).all(axis=1))

    def allowed(durations: FloatArray) -> BoolArray:
        keeps = possible(durations)
        if keeps.any():
            q, v = evaluate(start, end, durations[keeps], _SAMPLES)
            slow = (np.abs(v) <= SEARCH_SHARE * limits.v_max).all(axis=(1, 2))
            keeps[keeps] = slow & limits.contains(q).all(axis=1)
        return keeps

    def certain(duration: float) -> bool:
        return within_limits(JointBlend(start, end, duration).q, duration, limits)

    duration = shortest(allowed, _DURATIONS, certain, possible=possible)
    return None if duration is None else JointBlend(start, end, duration)


def within_limits(
    place: Callable[[FloatArray], FloatArray], duration: float, limits: ArmLimits
) -> bool:
    """Tells whether a move keeps its limits, looked at as densely as executed.

    These are rates and torques of the joints and the speed of the nozzle.

    A search over many durations looks at few samples of each, between which a peak may
    hide; what it finds is looked at once more.

    Args:
        place: Joint angles (n, 5), rad, at times (n,), s.
        duration: Of the move, s.
        limits: Of the joints, as far as the plan may use them.
    """
    count = max(9, int(np.ceil(duration / _DENSE_STEP)) + 1)
    time, step = np.linspace(0.0, duration, count, retstep=True)
    q = place(time)
    v = (q[2:] - q[:-2]) / (2.0 * step)
    a = (q[2:] - 2.0 * q[1:-1] + q[:-2]) / step**2
    with np.errstate(invalid="ignore"):
        if not ((np.abs(v) <= limits.v_max) & (np.abs(a) <= limits.a_max)).all():
            return False
    if limits.nozzle is not None:
        p_WGs = limits.nozzle(q)
        speed = np.linalg.norm(p_WGs[2:] - p_WGs[:-2], axis=1) / (2.0 * step)
        if speed.max() > limits.nozzle_speed:
            return False
    if limits.torques is None:
        return True
    few = slice(None, None, _TORQUE_EVERY)
    torques = limits.torques(q[1:-1][few], v[few], a[few])
    return bool((np.abs(torques) <= limits.effort_max).all())


def shortest(
    allowed: Callable[[FloatArray], BoolArray],
    durations: FloatArray,
    certain: Callable[[float], bool] = lambda duration: True,
    *,
    longest: float = math.inf,
    possible: Callable[[FloatArray], BoolArray] | None = None,
) -> float | None:
    """Finds the shortest duration that is allowed.

    Allowed durations need not be an interval (a slower turn swings out farther), so
    a grid is tried, then the gap between the last one that fails and the first one
    that does not, then longer ones until one passes the second look.

    Args:
        allowed: Tells of durations (k,), s, which are allowed, (k,) bool.
        durations: (n,) s, ascending grid.
        certain: A slower and closer look at one duration that is allowed.
        longest: Only shorter ones are of use, s.
        possible: A quicker look, at the whole grid: what it rules out is not allowed.
    """
    # The first one that is of no use may still bound a gap in which others are.
    durations = durations[: np.searchsorted(durations, longest) + 1]
    able = durations if possible is None else durations[possible(durations)]
    found = next(_in_turn(allowed, able), None)
    if found is None:
        return None
    first = int(np.searchsorted(durations, found))
    before = durations[max(first - 1, 0)]
    between = np.linspace(before, found, 8)[1:-1]
    longer = found * _SLOWER ** np.arange(1, _SLOWER_STEPS)
    slower = np.unique(np.append(durations[first:], longer[longer < durations[-1]]))
    tries = itertools.chain.from_iterable(
        _in_turn(allowed, some[some < longest]) for some in (between, slower)
    )
    return next((duration for duration in tries if certain(duration)), None)


def _in_turn(
    allowed: Callable[[FloatArray], BoolArray], durations: FloatArray
) -> Iterator[float]:
    """Yields those durations that are allowed, looking at some at a time."""
    for first in range(0, len(durations), _AT_A_TIME):
        some = durations[first : first + _AT_A_TIME]
        yield from some[allowed(some)].tolist()


def chain(
    segments: Sequence[Segment],
    *,
    period: float,
    spray_on: FloatArray | None = None,
    flow: FloatArray | None = None,
) -> Motion:
    """Samples segments one after the other and joins the samples twice smoothly.

    The velocities are those of the clamped cubic spline through the samples, so that
    the motion's cubic Hermite curve *is* that spline: continuous to the second
    derivative, at rest at both ends. There is a sample at every knot: a spline across
    a bend of the acceleration would swing beyond it.

    Args:
        segments: At least one; the first starts and the last ends at rest.
        period: Largest spacing of the samples, s.
        spray_on: (m, 2) s, see `Motion.spray_on`; None = the gun stays closed.
        flow: (m,) see `Motion.flow`.

    Returns:
        The motion.
    """
    starts = start_times(segments)
    times, places = [np.zeros(1)], [segments[0].q(np.zeros(1))]
    for segment, start in zip(segments, starts, strict=False):
        local = _sample_times(segment.knots, period)
        times.append(start + local)
        places.append(segment.q(local))
    time, q = np.concatenate(times), np.concatenate(places)
    v = CubicSpline(time, q, bc_type="clamped")(time, 1)
    v[[0, -1]] = 0.0
    spray = np.zeros((0, 2)) if spray_on is None else spray_on
    return Motion(time=time, q=q, v=v, spray_on=spray, flow=flow)


def _sample_times(knots: FloatArray, period: float) -> FloatArray:
    """Returns times after the first knot, knots among them, `period` or less apart."""
    pieces = [
        np.linspace(a, b, max(1, int(np.ceil((b - a) / period - 1e-9))) + 1)[1:]
        for a, b in itertools.pairwise(knots)
    ]
    return np.concatenate(pieces)


def start_times(segments: Sequence[Segment]) -> FloatArray:
    """Returns when each segment of a chain starts, and at last when it ends, s."""
    durations = np.array([segment.duration for segment in segments])
    return np.concatenate([[0.0], np.cumsum(durations)])
