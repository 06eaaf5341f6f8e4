"""Blends: the time law of a move between two moving states.

A blend's acceleration has two plateaus, one in either half of its duration, reached by
linear ramps. Its position is twice continuously differentiable and needs little more
time and room than the minimum for a bound on acceleration. (A quintic polynomial
between the same ends swings out 40 % farther.) The plateaus are linear in the end
states. So any linear relation between joints that holds at both ends, such as
q2 + q3 + q4 = 0 for a gun square to a plumb wall, holds all along.
"""

from dataclasses import dataclass

import numpy as np

from perception.ground import FloatArray, FrozenValue

# Share of the duration taken by each ramp of the acceleration.
_RAMP = 0.15
# Shares of the duration between which the acceleration is linear.
KNOTS = np.array([0.0, _RAMP, 0.5 - _RAMP / 2, 0.5 + _RAMP / 2, 1.0 - _RAMP, 1.0])


@dataclass(frozen=True, eq=False)
class MovingState(FrozenValue):
    """A state of joints (n = 5; rad) or of a point (n = 3; m).

    Attributes:
        x: (n,) position.
        v: (n,) velocity, 1/s.
        a: (n,) acceleration, 1/s².
    """

    x: FloatArray
    v: FloatArray
    a: FloatArray

    @classmethod
    def at_rest(cls, x: FloatArray) -> "MovingState":
        """Makes a state at rest at `x`."""
        return cls(np.array(x, dtype=float), np.zeros(len(x)), np.zeros(len(x)))

    @classmethod
    def steady(cls, x: FloatArray, v: FloatArray) -> "MovingState":
        """Makes a state of constant velocity."""
        return cls(np.array(x, dtype=float), np.array(v, dtype=float), np.zeros(len(x)))

    @property
    def key(self) -> bytes:
        """Identifies the state."""
        return np.concatenate([self.x, self.v, self.a]).tobytes()


def plateaus(
    start: MovingState, end: MovingState, durations: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Returns the two accelerations of blends of several durations, each (k, n).

    Integrating the piecewise linear acceleration once and twice gives two equations,
    linear in the plateaus; this solves them.

    Args:
        start: State at the start.
        end: State at the end.
        durations: (k,) s.
    """
    T = durations[:, None]
    weight = (1.0 - _RAMP) / 2.0
    total = (end.v - start.v) / T - _RAMP / 2.0 * (start.a + end.a)
    total = total / weight
    moment = (end.x - start.x - start.v * T) / T**2
    moment = moment - _RAMP / 2.0 * (
        (1.0 - _RAMP / 3.0) * start.a + _RAMP / 3.0 * end.a
    )
    first = (moment - weight * (1.0 + _RAMP) / 4.0 * total) / weight**2
    return first, total - first


@dataclass(frozen=True, eq=False)
class Shares(FrozenValue):
    """Shares of a blend's duration at which blends are sampled.

    Position and rate are linear in the accelerations at the start, on both plateaus and
    at the end; the weights depend on the share alone.

    Attributes:
        s: (m,) shares; before 0 and after 1 a blend continues at the velocity of that
            end.
        position: (m, 4) weights of the accelerations in the position, at 1 s duration.
        rate: (m, 4) the same in the rate.
    """

    s: FloatArray
    position: FloatArray
    rate: FloatArray

    @classmethod
    def at(cls, s: FloatArray) -> "Shares":
        """Makes them for shares (m,)."""
        inside = np.minimum(np.maximum(s, 0.0), 1.0)
        piece = np.searchsorted(KNOTS[1:-1], inside, side="right")
        u = (inside - KNOTS[piece])[:, None]
        a, jerk, v = _ACCELERATIONS[piece], _JERKS[piece], _RATES[piece]
        rate = v + u * (a + u * jerk / 2.0)
        position = _POSITIONS[piece] + u * (v + u * (a / 2.0 + u * jerk / 6.0))
        return cls(np.asarray(s), position + (s - inside)[:, None] * rate, rate)


def evaluate(
    start: MovingState, end: MovingState, durations: FloatArray, shares: Shares
) -> tuple[FloatArray, FloatArray]:
    """Returns positions and rates of blends, each (k, m, n).

    Args:
        start: State at the start.
        end: State at the end.
        durations: (k,) s.
        shares: m shares of the durations.
    """
    first, second = plateaus(start, end, durations)
    a = np.empty((len(durations), 4, len(start.x)))
    a[:, 0], a[:, 1], a[:, 2], a[:, 3] = start.a, first, second, end.a
    T = durations[:, None, None]
    rate = start.v + T * (shares.rate @ a)
    position = start.x + T * (shares.s[:, None] * start.v + T * (shares.position @ a))
    return position, rate


def _integrals() -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Returns accelerations, their slopes, rates and positions at the knots.

    Each (6, 4), of a blend of duration 1 s from rest, for unit accelerations at the
    start, on the two plateaus and at the end; the slopes are one a piece.
    """
    a = np.eye(4)[[0, 1, 1, 2, 2, 3]]
    h = np.diff(KNOTS)[:, None]
    jerk = np.diff(a, axis=0) / h
    v, x = np.zeros_like(a), np.zeros_like(a)
    for i, u in enumerate(h):
        v[i + 1] = v[i] + u * (a[i] + u * jerk[i] / 2.0)
        x[i + 1] = x[i] + u * (v[i] + u * (a[i] / 2.0 + u * jerk[i] / 6.0))
    return a, jerk, v, x


_ACCELERATIONS, _JERKS, _RATES, _POSITIONS = _integrals()
