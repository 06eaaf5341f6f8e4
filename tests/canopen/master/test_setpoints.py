import numpy as np
import pytest

from painter.canopen.config.units import JointLimits
from painter.canopen.master.setpoints import (
    Sample,
    Setpoint,
    SetpointBuffer,
    SetpointGuard,
    StopRamp,
)

LIMITS = [JointLimits(-1.0, 1.0, 2.0, 4.0, 8.0, 0.1)] * 5


def point(t, q, v=0.0, trigger=0.0):
    return Setpoint(t, np.full(5, float(q)), np.full(5, float(v)), trigger)


def test_a_cubic_is_met_exactly_between_setpoints():
    # q = t^3 - t: Hermite's cubic through values and slopes is the cubic itself.
    dut = SetpointBuffer()
    dut.push([point(t, t**3 - t, 3 * t**2 - 1) for t in (0.0, 0.5, 1.25)])
    for t in (0.0, 0.2, 0.49, 0.5, 0.9, 1.2):
        sample = dut.sample(t)
        np.testing.assert_allclose(sample.q, t**3 - t, atol=1e-12)
        np.testing.assert_allclose(sample.v, 3 * t**2 - 1, atol=1e-12)
        assert sample.lag == 0.0


def test_nothing_is_commanded_before_the_first_setpoint():
    dut = SetpointBuffer()
    assert dut.sample(0.0) is None
    dut.push([point(1.0, 0.0)])
    assert dut.sample(0.5) is None


def test_after_the_last_setpoint_a_sample_has_its_age():
    dut = SetpointBuffer()
    dut.push([point(1.0, 0.3, 0.1)])
    assert dut.sample(1.25).lag == pytest.approx(0.25)
    assert dut.sample(1.25).is_active


def test_new_setpoints_replace_the_planned_ones():
    dut = SetpointBuffer()
    dut.push([point(0.0, 0.0), point(1.0, 1.0), point(2.0, 2.0)])
    dut.push([point(1.5, 9.0)])
    assert len(dut) == 3
    np.testing.assert_allclose(dut.sample(1.5).q, 9.0)


def test_the_trigger_holds_until_the_next_setpoint():
    dut = SetpointBuffer()
    dut.push([point(0.0, 0.0, trigger=0.5), point(1.0, 0.0, trigger=0.0)])
    assert dut.sample(0.999).trigger == 0.5
    assert dut.sample(1.0).trigger == 0.0


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ([point(1.0, 0.0), point(1.0, 0.0)], "must increase"),
        ([point(1.0, np.nan)], "must be 5 finite"),
        ([point(np.inf, 0.0)], "must be 5 finite"),
        ([point(1.0, 0.0, trigger=1.5)], "trigger must be 0 to 1"),
        ([Setpoint(1.0, np.zeros(4), np.zeros(5))], "must be 5 finite"),
    ],
)
def test_unusable_setpoints_are_rejected(points, message):
    with pytest.raises(ValueError, match=message):
        SetpointBuffer().push(points)


def test_all_joints_stop_at_the_same_time():
    v = np.array([1.0, -2.0, 0.5, 0.0, 1.0])
    dut = StopRamp(10.0, np.zeros(5), v, LIMITS)
    assert dut.duration == pytest.approx(2.0 / 8.0)
    np.testing.assert_allclose(dut.sample(10.0).v, v)
    np.testing.assert_allclose(dut.sample(10.125).v, v / 2)
    # Even deceleration: v T / 2.
    np.testing.assert_allclose(dut.sample(99.0).q, v * 0.125)
    np.testing.assert_allclose(dut.sample(99.0).v, 0.0)


def test_a_stop_stays_in_the_joints_ranges():
    dut = StopRamp(0.0, np.full(5, 0.9), np.full(5, 2.0), LIMITS)
    assert dut.sample(1.0).q.max() == 1.0


def test_the_guard_allows_the_greatest_speed_and_no_more():
    dut = SetpointGuard(LIMITS, timeout=0.05)
    ok = Sample(np.full(5, 0.01), np.full(5, 2.0), 0.0, 0.0)
    assert dut.violation(ok, np.zeros(5), 0.005) is None
    fast = Sample(np.full(5, 0.0115), np.full(5, 2.0), 0.0, 0.0)
    assert "2.300 rad/s" in dut.violation(fast, np.zeros(5), 0.005)
