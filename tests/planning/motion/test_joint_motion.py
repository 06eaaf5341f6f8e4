"""Joint moves keep their limits to the letter; chained motions are twice smooth."""

import numpy as np
import pytest

from painter.planning.arm.kinematics import ArmLimits
from painter.planning.motion.blend import MovingState
from painter.planning.motion.joint_motion import (
    chain,
    fastest_joint_blend,
    planning_limits,
    rest_to_rest,
    shortest,
    start_times,
)

LIMITS = ArmLimits(
    q_min=np.full(5, -3.0),
    q_max=np.full(5, 3.0),
    v_max=np.array([2.0, 2.0, 2.5, 3.5, 3.5]),
    a_max=np.array([5.0, 5.0, 8.0, 15.0, 15.0]),
    effort_max=np.full(5, 100.0),
)
Q0 = np.array([0.1, -1.2, 2.0, -0.8, 0.0])


def rates(segment):
    """Rate and second derivative of a segment's joints, by differences."""
    time = np.linspace(0.0, segment.duration, 4001)
    v = np.gradient(segment.q(time), time, axis=0)
    return v[2:-2], np.gradient(v, time, axis=0)[2:-2]


@pytest.mark.parametrize("travel", [0.05, 0.6, 2.5])
def test_rest_to_rest_uses_one_limit_and_keeps_all(travel):
    q1 = Q0 + travel * np.array([1.0, 0.5, -0.3, 0.2, -1.0])
    move = rest_to_rest(Q0, q1, LIMITS)
    v, a = rates(move)
    shares = [
        np.abs(v).max(axis=0) / LIMITS.v_max,
        np.abs(a).max(axis=0) / LIMITS.a_max,
    ]
    assert 0.96 < np.max(shares) <= 0.985  # 2 % are held back for the sampling.
    np.testing.assert_allclose(move.q(np.array([0.0, move.duration])), [Q0, q1])


def test_a_long_way_is_gone_at_the_fastest_rate():
    """Speeding up takes V / 0.8 A, a fifth of it for ramps; the rest is L / V."""
    move = rest_to_rest(Q0, Q0 + np.array([2.5, 0.0, 0.0, 0.0, 0.0]), LIMITS)
    fastest, hardest = 0.98 * 2.0, 0.98 * 5.0
    expected = 2.5 / fastest + fastest / (0.8 * hardest)
    assert move.duration == pytest.approx(expected, rel=1e-9)
    half_way = move.q(np.array([0.5 * move.duration]))
    np.testing.assert_allclose(half_way[0, 0], Q0[0] + 1.25)


def test_rest_to_rest_of_no_length_still_takes_time():
    assert rest_to_rest(Q0, Q0, LIMITS).duration > 0.0


def test_fastest_blend_is_the_shortest_within_the_limits():
    # One joint from v to -v on the spot: T = 2 v / (0.85 A), by integration.
    v = np.array([1.0, 0.0, 0.0, 0.0, 0.0])
    blend = fastest_joint_blend(
        MovingState.steady(Q0, v), MovingState.steady(Q0, -v), LIMITS
    )
    assert blend.duration == pytest.approx(2.0 / (0.85 * 0.98 * 5.0), rel=0.02)
    _, a = rates(blend)
    assert np.abs(a[:, 0]).max() <= LIMITS.a_max[0]


def test_no_blend_where_a_joint_would_pass_its_end():
    v = np.array([1.5, 0.0, 0.0, 0.0, 0.0])
    q = np.array([2.95, -1.2, 2.0, -0.8, 0.0])
    start, end = MovingState.steady(q, v), MovingState.steady(q, -v)
    assert fastest_joint_blend(start, end, LIMITS) is None


def test_shortest_refines_between_grid_points():
    found = shortest(lambda t: t >= 1.05, np.array([0.5, 1.0, 1.7, 2.0]))
    assert 1.05 <= found <= 1.15
    assert shortest(lambda t: t > 9.0, np.array([1.0, 2.0])) is None


@pytest.mark.parametrize("longest", [0.4, 1.03, 1.2, 1.69, 1.7, 1.9, 5.0])
def test_a_bound_on_what_is_of_use_changes_nothing_below_it(longest):
    """Verification fails just below 1.6, so that slower ones are tried as well."""
    grid = np.array([0.5, 1.0, 1.7, 2.0])
    search = (lambda t: t >= 1.05, grid, lambda t: t > 1.61)
    unbound = shortest(*search)
    asked = []

    def verified(t):
        asked.append(t)
        return t > 1.61

    found = shortest(search[0], grid, verified, longest=longest)
    assert found == (unbound if unbound < longest else None)
    assert all(t < longest for t in asked)


def test_planning_limits_scale_rates_and_hold_back_from_the_ends():
    planned = planning_limits(LIMITS, 0.5)
    np.testing.assert_allclose(planned.v_max, 0.5 * LIMITS.v_max)
    np.testing.assert_allclose(planned.a_max, 0.5 * LIMITS.a_max)
    assert planning_limits(LIMITS.replace(nozzle_speed=2.0), 0.5).nozzle_speed == 1.0
    np.testing.assert_allclose(planned.q_max, LIMITS.q_max - 0.02)


def test_the_nozzle_keeps_its_speed_where_the_joints_would_allow_more():
    """A yaw by 1.5 rad carries the nozzle round a circle of 1.2 m.

    Speeding up and slowing down for as long each as a move that just reaches its speed
    needs, it takes one way over its speed and that time.
    """
    radius, speed = 1.2, 0.9

    def nozzle(q):
        return radius * np.column_stack(
            [np.cos(q[:, 0]), np.sin(q[:, 0]), 0.0 * q[:, 0]]
        )

    q1 = Q0 + [1.5, 0.0, 0.0, 0.0, 0.0]
    free = rest_to_rest(Q0, q1, LIMITS)
    dut = rest_to_rest(Q0, q1, LIMITS.replace(nozzle=nozzle, nozzle_speed=speed))
    time = np.linspace(0.0, dut.duration, 4001)
    fastest = np.abs(np.gradient(nozzle(dut.q(time)), time, axis=0))
    assert np.linalg.norm(fastest, axis=1).max() <= speed * (1.0 + 1e-6)
    assert dut.duration > free.duration
    # Slowed as a whole, in steps of 5 %: the cruise is that near to the bound.
    peak = radius * 1.5 / (dut.speed_up + dut.cruise)
    assert speed / 1.05 <= peak <= speed
    blend = fastest_joint_blend(
        MovingState.at_rest(Q0),
        MovingState.at_rest(q1),
        LIMITS.replace(nozzle=nozzle, nozzle_speed=speed),
    )
    time = np.linspace(0.0, blend.duration, 4001)
    v = np.gradient(nozzle(blend.q(time)), time, axis=0)
    assert 0.9 * speed < np.linalg.norm(v, axis=1).max() <= speed * 1.001


def test_chain_is_smooth_and_passes_through_its_segments():
    q1 = Q0 + [0.5, 0.3, -0.4, 0.1, 0.2]
    moves = [rest_to_rest(Q0, q1, LIMITS), rest_to_rest(q1, Q0, LIMITS)]
    motion = chain(moves, period=0.01)
    starts = start_times(moves)
    assert motion.duration == pytest.approx(starts[-1])
    assert np.diff(motion.time).max() <= 0.01 + 1e-12
    assert not motion.v[[0, -1]].any()
    assert motion.spray_on.shape == (0, 2)
    # Between its samples, too, the spline is the segments to within 10 µrad.
    time = np.linspace(0.0, starts[1], 777)
    q = motion.trajectory.vector_values(time).T
    np.testing.assert_allclose(q, moves[0].q(time), atol=1e-5)
    # Twice smooth: no step of the second derivative beyond what jerk explains.
    second = motion.trajectory.MakeDerivative(2)
    knots = motion.time[1:-1]
    before, after = (second.vector_values(knots + d) for d in (-1e-9, 1e-9))
    np.testing.assert_allclose(before, after, atol=1e-4)
