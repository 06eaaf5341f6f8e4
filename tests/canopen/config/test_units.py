import itertools
import math

import numpy as np
import pytest

from painter.canopen.config.units import (
    COUPLING,
    AccelerationUnit,
    AxisUnits,
    JointLimits,
    VelocityUnit,
    axes_from_joints,
    drive_limits,
    joints_from_axes,
)

JOINTS = [
    JointLimits(-2.9, 2.9, 2.0, 5.0, 10.0, 0.05),
    JointLimits(-2.9, 1.5, 2.0, 5.0, 10.0, 0.05),
    JointLimits(-0.3, 3.02, 2.5, 8.0, 16.0, 0.05),
    JointLimits(-2.75, 1.6, 3.5, 15.0, 30.0, 0.10),
    JointLimits(-1.7, 1.7, 3.0, 12.0, 24.0, 0.08),
]
ONE = [AxisUnits(counts_per_turn=2 * math.pi * 1e6, gear=1.0)] * 5


def test_wrist_axes_are_pitch_plus_and_minus_yaw():
    for pitch, yaw in itertools.product((-1.0, 0.0, 0.3), (-0.7, 0.0, 1.1)):
        axes = axes_from_joints(np.array([0.1, 0.2, 0.3, pitch, yaw]))
        np.testing.assert_allclose(axes, [0.1, 0.2, 0.3, pitch + yaw, pitch - yaw])
        back = joints_from_axes(axes)
        np.testing.assert_allclose(back, [0.1, 0.2, 0.3, pitch, yaw], atol=1e-15)


def test_a_motor_turn_is_its_counts():
    dut = AxisUnits(counts_per_turn=4096, gear=100, sign=-1, zero=0.5)
    assert dut.counts(0.5) == 0
    assert dut.counts(0.5 + 2 * math.pi) == -409600
    assert dut.angle(-409600) == pytest.approx(0.5 + 2 * math.pi)
    assert dut.speed(-409600) == pytest.approx(2 * math.pi)


def test_rpm_are_motor_turns_a_minute():
    dut = AxisUnits(
        counts_per_turn=4096,
        gear=60,
        velocity=VelocityUnit.RPM,
        acceleration=AccelerationUnit.RPM_PER_S,
    )
    # One turn of the axis a second is 60 motor turns a second: 3600 a minute.
    assert dut.speed_scale() * 2 * math.pi == pytest.approx(3600)
    assert dut.acceleration_scale() * 2 * math.pi == pytest.approx(3600)
    assert dut.speed(3600) == pytest.approx(2 * math.pi)


def test_limits_of_a_single_joint_pass_through_gear_and_sign():
    units = [AxisUnits(counts_per_turn=1000, gear=100, sign=s) for s in (1, -1, 1)]
    limits = drive_limits(JOINTS, [*units, *ONE[3:]])
    per_rad = 1000 * 100 / (2 * math.pi)
    assert limits[1].position == (round(-1.5 * per_rad), round(2.9 * per_rad))
    assert limits[0].profile_velocity == math.ceil(2.0 * per_rad)
    assert limits[0].motor_speed == math.ceil(2.0 * 100 * 60 / (2 * math.pi))
    assert limits[0].quick_stop == math.floor(10.0 * per_rad)
    assert limits[0].following_error == math.floor(0.05 * per_rad)


def test_wrist_boxes_hold_every_permitted_state():
    limits = drive_limits(JOINTS, ONE)
    corners = itertools.product(*((j.q_min, j.q_max) for j in JOINTS))
    axes = np.array([axes_from_joints(np.array(q)) for q in corners]) * 1e6
    for i, limit in enumerate(limits):
        # Tight: the corners reach the box, and none leaves it.
        assert limit.position[0] == pytest.approx(axes[:, i].min(), abs=1)
        assert limit.position[1] == pytest.approx(axes[:, i].max(), abs=1)
    assert limits[3].profile_velocity == pytest.approx(6.5e6, abs=1)
    assert limits[4].acceleration == pytest.approx(27e6, abs=1)


def test_two_axes_at_their_error_bound_keep_each_joint_in_its_own():
    limits = drive_limits(JOINTS, ONE)
    window = np.array([limit.following_error for limit in limits]) / 1e6
    bounds = np.array([joint.following_error for joint in JOINTS])
    for signs in itertools.product((-1, 1), repeat=5):
        assert np.all(np.abs(joints_from_axes(window * signs)) <= bounds + 1e-6)
    assert window[3] == pytest.approx(0.08, abs=1e-6)


def test_coupling_cannot_be_changed():
    with pytest.raises(ValueError, match="read-only"):
        COUPLING[0, 0] = 2.0
