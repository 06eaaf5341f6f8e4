"""Blends: the time law by which the arm gets from one moving state to another.

A blend's acceleration has two plateaus, one in either half of its duration, reached by
linear ramps; so its position is twice smooth and, between given end states, needs
little more time and room than the least possible for a bound on acceleration. (A
quintic polynomial between the same ends swings out 40 % farther.) The plateaus follow
from the end states by a linear formula. Therefore any linear relation that holds
between joints at both ends, such as q2 + q3 + q4 = 0 for a gun square to a plumb wall,
holds all the way.
"""

from dataclasses import dataclass

import numpy as np

from perception.values import FloatArray, FrozenValue

# Share of the duration taken by each ramp of the acceleration.
_RAMP = 0.15
# Shares of the duration between which the acceleration is linear.
KNOTS = np.array([0.0, _RAMP, 0.5 - _RAMP / 2, 0.5 + _RAMP / 2, 1.0 - _RAMP, 1.0])


@dataclass(frozen=True, eq=False)
class MovingState(FrozenValue):
    """A state of joints (n = 5; rad) or of a point (n = 3; m).

    Attributes:
        x: (n,) position.
        v: (n,) its rate, 1/s.
        a: (n,) the rate of that, 1/s².
    """

    x: FloatArray
    v: FloatArray
    a: FloatArray

    @classmethod
    def at_rest(cls, x: FloatArray) -> "MovingState":
        """Makes a standstill at `x`."""
        return cls(np.array(x, dtype=float), np.zeros(len(x)), np.zeros(len(x)))

    @classmethod
    def steady(cls, x: FloatArray, v: FloatArray) -> "MovingState":
        """Makes a state of constant velocity."""
        return cls(np.array(x, dtype=float), np.array(v, dtype=float), np.zeros(len(x)))


def plateaus(
    start: MovingState, end: MovingState, durations: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Returns the two accelerations of blends of several durations, each (k, n).

    Integrating the piecewise linear acceleration once and twice gives two equations,
    linear in the plateaus; here they are solved.

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


def evaluate(
    start: MovingState, end: MovingState, durations: FloatArray, s: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Returns positions and rates of blends, each (k, m, n).

    Args:
        start: State at the start.
        end: State at the end.
        durations: (k,) s.
        s: (m,) shares of the durations; before 0 and after 1 the blend goes on at the
            velocity of that end.
    """
    first, second = plateaus(start, end, durations)
    ends = np.broadcast_to(start.a, first.shape), np.broadcast_to(end.a, first.shape)
    a = np.stack([ends[0], first, first, second, second, ends[1]], axis=1)
    T = durations[:, None, None]
    h = np.diff(KNOTS)[None, :, None] * T
    jerk = np.diff(a, axis=1) / h
    v = np.empty_like(a)
    x = np.empty_like(a)
    v[:, 0], x[:, 0] = start.v, start.x
    for i in range(len(KNOTS) - 1):
        u = h[:, i]
        v[:, i + 1] = v[:, i] + u * (a[:, i] + u * jerk[:, i] / 2.0)
        x[:, i + 1] = x[:, i] + u * (
            v[:, i] + u * (a[:, i] / 2.0 + u * jerk[:, i] / 6.0)
        )
    inside = np.clip(s, 0.0, 1.0)
    piece = np.clip(np.searchsorted(KNOTS, inside, side="right") - 1, 0, 4)
    u = (inside - KNOTS[piece])[None, :, None] * T
    a_i, j_i, v_i = a[:, piece], jerk[:, piece], v[:, piece]
    rate = v_i + u * (a_i + u * j_i / 2.0)
    place = x[:, piece] + u * (v_i + u * (a_i / 2.0 + u * j_i / 6.0))
    place = place + (s - inside)[None, :, None] * T * rate
    return place, rate
