"""Blends meet their end states, twice smoothly, with plateaus of acceleration."""

import numpy as np
import pytest

from painter.planning.motion.blend import MovingState, Shares, evaluate, plateaus


@pytest.fixture
def ends():
    rng = np.random.default_rng(3)
    return MovingState(*rng.normal(size=(3, 5))), MovingState(*rng.normal(size=(3, 5)))


def test_ends_are_met_in_position_and_rate(ends):
    start, end = ends
    x, v = evaluate(start, end, np.array([0.4, 1.7]), Shares.at(np.array([0.0, 1.0])))
    for k in range(2):
        np.testing.assert_allclose(x[k], [start.x, end.x], atol=1e-12)
        np.testing.assert_allclose(v[k], [start.v, end.v], atol=1e-12)


def test_acceleration_is_continuous_and_meets_the_ends(ends):
    start, end = ends
    duration, count = 0.8, 8001
    s = np.linspace(0.0, 1.0, count)
    _, v = evaluate(start, end, np.array([duration]), Shares.at(s))
    a = np.gradient(v[0], duration * s, axis=0)
    np.testing.assert_allclose(a[[1, -2]], [start.a, end.a], atol=0.05)
    # The steepest ramp of all takes 0.15 of the duration.
    first, second = plateaus(start, end, np.array([duration]))
    largest = np.abs([first, second, start.a[None], end.a[None]]).max()
    steepest = 2.0 * largest / (0.15 * duration)
    assert np.abs(np.diff(a, axis=0)).max() <= 1.1 * steepest * duration / (count - 1)


def test_acceleration_never_exceeds_plateaus_and_ends(ends):
    start, end = ends
    s = np.linspace(0.0, 1.0, 4001)
    _, v = evaluate(start, end, np.array([1.3]), Shares.at(s))
    first, second = plateaus(start, end, np.array([1.3]))
    bound = np.max(np.abs([first[0], second[0], start.a, end.a]), axis=0)
    a = np.abs(np.gradient(v[0], 1.3 * s, axis=0))
    assert (a <= bound + 1e-6).all()


def test_rate_is_the_derivative_of_position(ends):
    s = np.linspace(0.0, 1.0, 2001)
    x, v = evaluate(*ends, np.array([0.9]), Shares.at(s))
    np.testing.assert_allclose(
        np.gradient(x[0], 0.9 * s, axis=0)[1:-1], v[0, 1:-1], atol=1e-4
    )


def test_reversal_at_speed_swings_out_as_the_closed_form_says():
    # v to -v on one spot: a ramp of 0.15 T, a plateau A, a ramp; by integration
    # A = 2 v / (0.85 T), and the farthest place is at T/2.
    v, T, r = 0.6, 0.5, 0.15
    A = 2.0 * v / ((1.0 - r) * T)
    start = MovingState.steady(np.zeros(1), np.array([v]))
    end = MovingState.steady(np.zeros(1), np.array([-v]))
    first, second = plateaus(start, end, np.array([T]))
    assert first[0, 0] == pytest.approx(-A)
    assert second[0, 0] == pytest.approx(-A)
    ramp_end = v * r * T - A * (r * T) ** 2 / 6.0
    speed = v - A * r * T / 2.0
    rest = (0.5 - r) * T
    farthest = ramp_end + speed * rest - A * rest**2 / 2.0
    x, _ = evaluate(start, end, np.array([T]), Shares.at(np.array([0.5])))
    assert x[0, 0, 0] == pytest.approx(farthest, rel=1e-9)


def test_linear_relations_of_the_ends_hold_all_the_way():
    rng = np.random.default_rng(5)
    states = rng.normal(size=(2, 3, 5))
    states[:, :, 3] = -states[:, :, 1] - states[:, :, 2]  # Pitches add up to zero.
    start, end = (MovingState(*state) for state in states)
    x, v = evaluate(start, end, np.array([0.7]), Shares.at(np.linspace(0.0, 1.0, 50)))
    np.testing.assert_allclose(x[..., 1:4].sum(axis=-1), 0.0, atol=1e-12)
    np.testing.assert_allclose(v[..., 1:4].sum(axis=-1), 0.0, atol=1e-12)


def test_beyond_its_ends_it_goes_straight_on(ends):
    start, end = ends
    x, _ = evaluate(start, end, np.array([2.0]), Shares.at(np.array([-0.1, 1.1])))
    np.testing.assert_allclose(x[0, 0], start.x - 0.2 * start.v, atol=1e-12)
    np.testing.assert_allclose(x[0, 1], end.x + 0.2 * end.v, atol=1e-12)
