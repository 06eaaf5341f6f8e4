"""Passes hold their speed, the gun stays square, and retracts leave and return."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw

from painter.planning.motion.blend import MovingState
from painter.planning.motion.gun_path import (
    Pass,
    WallIk,
    fastest_tool_blend,
)
from painter.planning.motion.joint_motion import planning_limits

UP = np.array([0.0, 0.6, 0.0])


@pytest.fixture
def ik(robot):
    return robot.transitions().ik


def test_pass_runs_from_point_to_point_at_its_speed():
    dut = Pass.between(np.array([0.5, 0.2, 0.3]), np.array([0.5, 1.7, 0.3]), 0.6)
    assert dut.duration == pytest.approx(2.5)
    time = np.linspace(0.0, dut.duration, 11)
    np.testing.assert_allclose(dut.p_TG(time)[:, 1], 0.2 + 0.6 * time)
    np.testing.assert_allclose(dut.end.x, [0.5, 1.7, 0.3])


def test_pass_of_no_length_is_refused():
    with pytest.raises(ValueError, match="length > 0"):
        Pass.between(np.ones(3), np.ones(3), 0.6)


def test_gun_is_square_to_a_wall_that_is_not_plumb(robot, ik):
    tilt = RigidTransform(RollPitchYaw(0.01, -0.02, 0.03), [0.02, 0.01, 0.0])
    X_WT = tilt @ ik.X_WT
    p_TGs = np.array([[0.3, 0.4, 0.3], [1.0, 1.0, 0.3], [1.7, 1.8, 0.5]])
    R_WGs, p_WGs = robot.kinematics.gun_poses(
        WallIk(robot.kinematics, X_WT).inverse_kinematics(p_TGs)
    )
    np.testing.assert_allclose(p_WGs, (X_WT @ p_TGs.T).T, atol=1e-9)
    np.testing.assert_allclose(
        R_WGs[:, :, 2], np.tile(-X_WT.rotation().col(2), (3, 1)), atol=1e-9
    )


def test_joint_state_is_the_motion_of_the_joints_on_a_pass(robot, ik):
    (state,) = ik.joint_states(MovingState.steady(np.array([0.4, 0.9, 0.3]), UP))
    # Drake turns joint rates back into the velocity of the gun: T y is W z.
    plant = robot.checker.plant()
    context = plant.CreateDefaultContext()
    plant.SetPositionsAndVelocities(context, np.concatenate([state.x, state.v]))
    V_WG = plant.GetFrameByName("gun_nozzle").CalcSpatialVelocityInWorld(context)
    np.testing.assert_allclose(V_WG.get_coeffs(), [0, 0, 0, 0, 0, 0.6], atol=1e-6)


def test_fastest_blend_keeps_the_limits(robot, ik):
    limits = planning_limits(robot.limits, 0.9)
    start = MovingState.steady(np.array([0.6, 1.5, 0.3]), UP)
    end = MovingState.steady(np.array([0.73, 1.5, 0.3]), -UP)
    move = fastest_tool_blend(start, end, ik=ik, limits=limits)
    time = np.linspace(0.0, move.duration, 2001)
    v = np.gradient(move.q(time), time, axis=0)
    a = np.gradient(v, time, axis=0)[2:-2]
    assert (np.abs(v) <= limits.v_max).all()
    assert (np.abs(a) <= limits.a_max).all()
    assert move.duration < 1.0  # 2 v = 1.2 m/s at 3 m/s² or so.


def test_short_gap_is_crossed_at_least_as_fast_as_the_strokes(robot, ik):
    start = MovingState.steady(np.array([0.6, 0.8, 0.3]), UP)
    end = MovingState.steady(np.array([0.6, 0.86, 0.3]), UP)
    limits = planning_limits(robot.limits, 0.9)
    blend = fastest_tool_blend(start, end, ik=ik, limits=limits).path
    assert blend.duration <= 0.1 + 1e-9
    p_TG = blend.p_TG(np.linspace(0.0, blend.duration, 50))
    np.testing.assert_allclose(p_TG[:, [0, 2]], [[0.6, 0.3]] * 50, atol=1e-12)


def test_retract_leaves_and_meets_the_passes_smoothly(robot, ik):
    start = MovingState.steady(np.array([0.6, 0.6, 0.3]), UP)
    end = MovingState.steady(np.array([0.6, 1.2, 0.3]), UP)
    blend = fastest_tool_blend(
        start,
        end,
        ik=ik,
        limits=planning_limits(robot.limits, 0.9),
        retract=0.2,
        ramp_share=0.35,
    ).path
    time = np.linspace(0.0, blend.duration, 4001)
    z = blend.p_TG(time)[:, 2]
    middle = np.abs(time / blend.duration - 0.5) < 0.1
    np.testing.assert_allclose(z[middle], 0.5, atol=1e-12)
    np.testing.assert_allclose(z[[0, -1]], 0.3, atol=1e-12)
    speed = np.gradient(z, time)
    assert np.abs(speed[[1, -2]]).max() < 1e-3
    assert np.abs(np.gradient(speed, time)[[2, -3]]).max() < 0.2


@pytest.mark.parametrize(
    ("x", "y", "gap", "retract", "ramp_share"),
    [(1.68, 0.31, 0.38, 0.05, 0.15), (1.70, 1.43, 0.17, 0.05, 0.15)],
)
def test_peaks_between_the_samples_of_the_search_are_seen(
    robot, x, y, gap, retract, ramp_share
):
    limits = planning_limits(robot.limits, 0.9)
    transitions = robot.transitions()
    start, end = (MovingState.steady([x, y + d, 0.3], UP) for d in (0.0, gap))
    move = fastest_tool_blend(
        start,
        end,
        ik=transitions.ik,
        limits=limits,
        retract=retract,
        ramp_share=ramp_share,
    )
    time, step = np.linspace(0.0, move.duration, 2001, retstep=True)
    q = move.q(time)
    peak = np.abs(np.diff(q, 2, axis=0)).max(axis=0) / step**2
    assert (peak <= 1.005 * limits.a_max).all()  # 1.09 without the dense check.
