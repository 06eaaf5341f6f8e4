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
_SHORTEST_MOVE = 0.05  # s; a move of zero length still lasts a few samples.
# Share of the acceleration phase that each ramp of the acceleration takes: 0.1 s for an
# outstretched arm, so that drives can follow.
_TRAVEL_RAMP = 0.2
_SHORTEST_CRUISE = 1e-6  # s; a shorter one is rounding.
_DURATIONS = np.geomspace(_SHORTEST_MOVE, 8.0, 60)  # s, of blends, tried in turn.
_SAMPLES = Shares.at(np.linspace(0.0, 1.0, 33))  # Where a blend's rates are sampled.
# The peak between two samples may exceed theirs a little.
SEARCH_SHARE = 0.98
_DENSE_STEP = 0.004  # s, between the samples that verify a move.
_TORQUE_EVERY = 5  # Of these samples, one is checked for torque.
_SLOWER = 1.05  # Factor by which a move is slowed that fails verification,
_SLOWER_STEPS = 30  # and how often.
_AT_A_TIME = 6  # Durations evaluated together.


class Segment(Protocol):
    """A piece of motion; chained pieces meet in position, velocity, acceleration."""

    @property
    def duration(self) -> float:
        """Length in time, s."""

    @property
    def knots(self) -> FloatArray:
        """Times from 0 to `duration`, s; the motion is smooth between them."""

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
    """A `Segment` straight from rest to rest: it accelerates, cruises and decelerates.

    The acceleration ramps up linearly to a plateau and down again; the deceleration
    mirrors it. All joints share one time law.

    Attributes:
        q0: (5,) rad, at its start.
        q1: (5,) rad, at its end.
        speed_up: Duration of the acceleration, and of the deceleration, s.
        cruise: Duration at constant rates between, s; may be 0.
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
        # Without a cruise the two share a knot.
        return np.concatenate([begin, end[0 if self.cruise else 1 :]])

    def q(self, time: FloatArray) -> FloatArray:
        """See `Segment.q`."""
        t = np.clip(np.asarray(time, dtype=float), 0.0, self.duration)
        near_start = t <= 0.5 * self.duration
        gone = self._share_gone(np.where(near_start, t, self.duration - t))
        share = np.where(near_start, gone, 1.0 - gone)[:, None]
        return np.asarray((1.0 - share) * self.q0 + share * self.q1)

    def _share_gone(self, t: FloatArray) -> FloatArray:
        """Returns the share of the travel covered at `t`, in the first half, s."""
        speed_up, ramp = self.speed_up, _TRAVEL_RAMP * self.speed_up
        rate = 1.0 / (speed_up + self.cruise)
        acceleration = rate / (speed_up - ramp)
        rising = acceleration * t**3 / (6.0 * ramp)
        after = t - ramp
        steady = acceleration * (ramp**2 / 6.0 + after * (ramp + after) / 2.0)
        rest = np.maximum(speed_up - t, 0.0)
        falling = rate * (t - 0.5 * speed_up) + acceleration * rest**3 / (6.0 * ramp)
        return np.where(t < ramp, rising, np.where(rest > ramp, steady, falling))


@dataclass(frozen=True, eq=False)
class Dwell(FrozenValue):
    """A `Segment` at rest.

    Attributes:
        q0: (5,) rad, the pose held.
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
    # Going slower saves nothing of what gravity alone takes.
    for _ in range(_SLOWER_STEPS):
        if within_limits(move.q, move.duration, limits):
            break
        move = JointTravel(q0, q1, _SLOWER * move.speed_up, _SLOWER * move.cruise)
    return move


def move_times(starts: FloatArray, ends: FloatArray, limits: ArmLimits) -> FloatArray:
    """Returns how long moves from starts (n, 5) to ends (m, 5), rad, take, (n, m) s.

    Rates and accelerations alone count, which is enough to compare.
    """
    return np.array(
        [[least_travel(a, b, limits).duration for b in ends] for a in starts]
    )


def least_travel(q0: FloatArray, q1: FloatArray, limits: ArmLimits) -> JointTravel:
    """Makes the fastest move within the joints' rates and accelerations alone.

    Torques and the nozzle's speed may require a slower one; see `rest_to_rest`.
    """
    travel = np.abs(q1 - q0)
    # Share of the travel, by the joint that allows least: 1/s and 1/s².
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
    """Finds the joint blend of shortest duration that is within the limits.

    Args:
        start: Joint state at the start.
        end: Joint state at the end.
        limits: Of the joints, as far as the plan may use them.

    Returns:
        The blend, or None if no duration up to 8 s is within them.
    """

    def quick_check(durations: FloatArray) -> BoolArray:
        first, second = plateaus(start, end, durations)
        peak = np.maximum(np.abs(first), np.abs(second))
        return np.asarray((peak <= SEARCH_SHARE * limits.a_max).all(axis=1))

    def feasible(durations: FloatArray) -> BoolArray:
        within = quick_check(durations)
        if within.any():
            q, v = evaluate(start, end, durations[within], _SAMPLES)
            slow = (np.abs(v) <= SEARCH_SHARE * limits.v_max).all(axis=(1, 2))
            within[within] = slow & limits.contains(q).all(axis=1)
        return within

    def verified(duration: float) -> bool:
        return within_limits(JointBlend(start, end, duration).q, duration, limits)

    duration = shortest(feasible, _DURATIONS, verified, quick_check=quick_check)
    return None if duration is None else JointBlend(start, end, duration)


def within_limits(
    position: Callable[[FloatArray], FloatArray], duration: float, limits: ArmLimits
) -> bool:
    """Tells whether a move, sampled as densely as executed, is within its limits.

    These are rates and torques of the joints and the speed of the nozzle. A search over
    many durations takes few samples of each, between which a peak may hide; this
    verifies what it finds.

    Args:
        position: Joint angles (n, 5), rad, at times (n,), s.
        duration: Of the move, s.
        limits: Of the joints, as far as the plan may use them.
    """
    count = max(9, int(np.ceil(duration / _DENSE_STEP)) + 1)
    time, step = np.linspace(0.0, duration, count, retstep=True)
    q = position(time)
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
    feasible: Callable[[FloatArray], BoolArray],
    durations: FloatArray,
    verified: Callable[[float], bool] = lambda duration: True,
    *,
    longest: float = math.inf,
    quick_check: Callable[[FloatArray], BoolArray] | None = None,
) -> float | None:
    """Finds the shortest feasible duration.

    Feasible durations need not form an interval (a slower turn swings out farther), so
    a grid is tried, then the gap between the last one that fails and the first one that
    does not, then longer ones until one is verified.

    Args:
        feasible: Tells which of durations (k,), s, are feasible, (k,) bool.
        durations: (n,) s, ascending grid.
        verified: A slower, denser check of one feasible duration.
        longest: Only shorter ones are of use, s.
        quick_check: A quicker test of the whole grid: what it rejects is not feasible.
    """
    # The first one that is too long may still bound a gap with shorter ones.
    durations = durations[: np.searchsorted(durations, longest) + 1]
    promising = durations if quick_check is None else durations[quick_check(durations)]
    found = next(_in_turn(feasible, promising), None)
    if found is None:
        return None
    first = int(np.searchsorted(durations, found))
    before = durations[max(first - 1, 0)]
    between = np.linspace(before, found, 8)[1:-1]
    longer = found * _SLOWER ** np.arange(1, _SLOWER_STEPS)
    slower = np.unique(np.append(durations[first:], longer[longer < durations[-1]]))
    tries = itertools.chain.from_iterable(
        _in_turn(feasible, some[some < longest]) for some in (between, slower)
    )
    return next((duration for duration in tries if verified(duration)), None)


def _in_turn(
    feasible: Callable[[FloatArray], BoolArray], durations: FloatArray
) -> Iterator[float]:
    """Yields the feasible durations, evaluating a few at a time."""
    for first in range(0, len(durations), _AT_A_TIME):
        some = durations[first : first + _AT_A_TIME]
        yield from some[feasible(some)].tolist()


def chain(
    segments: Sequence[Segment],
    *,
    period: float,
    spray_on: FloatArray | None = None,
    flow: FloatArray | None = None,
) -> Motion:
    """Samples segments one after the other and joins the samples by a spline.

    The velocities are those of the clamped cubic spline through the samples, so the
    motion's cubic Hermite curve *is* that spline: continuous to the second derivative,
    at rest at both ends. Every knot is a sample: a spline across a bend of the
    acceleration would overshoot it.

    Args:
        segments: At least one; the first starts and the last ends at rest.
        period: Largest spacing of the samples, s.
        spray_on: (m, 2) s, see `Motion.spray_on`; None = the gun stays closed.
        flow: (m,) see `Motion.flow`.

    Returns:
        The motion.
    """
    starts = start_times(segments)
    times, positions = [np.zeros(1)], [segments[0].q(np.zeros(1))]
    for segment, start in zip(segments, starts, strict=False):
        local = _sample_times(segment.knots, period)
        times.append(start + local)
        positions.append(segment.q(local))
    time, q = np.concatenate(times), np.concatenate(positions)
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
    """Returns when each segment of a chain starts, then when the chain ends, s."""
    durations = np.array([segment.duration for segment in segments])
    return np.concatenate([[0.0], np.cumsum(durations)])
