"""The closed forms against hand-made poses, themselves and finite differences."""

import math

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix

from painter.planning.arm.kinematics import (
    ArmKinematics,
    ArmLimits,
)

# z ahead, x right, y down, in a frame whose x is ahead and z up.
R_AHEAD = RotationMatrix([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
ARM = ArmKinematics(
    shoulder_height=1.2,
    upper_arm=0.7,
    forearm=0.8,
    X_LG=RigidTransform(R_AHEAD, [0.3, 0.0, 0.0]),
    X_LC=RigidTransform(R_AHEAD, [0.2, 0.0, 0.1]),
)
BRANCHES = [(1, 1), (-1, 1), (1, -1), (-1, -1)]


def random_positions(count: int) -> np.ndarray:
    """Positions whose wrist yaw is within +-pi/2, as the inverse gives it."""
    rng = np.random.default_rng(3)
    q = rng.uniform(-math.pi, math.pi, (count, 5))
    q[:, 4] /= 2.0
    return q


def test_zero_pose_is_stretched_along_x():
    R_WG, p_WG = ARM.gun_poses(np.zeros((1, 5)))
    np.testing.assert_allclose(p_WG, [[1.8, 0.0, 1.2]], atol=1e-15)
    np.testing.assert_allclose(R_WG[0], R_AHEAD.matrix(), atol=1e-15)
    assert ARM.reach == pytest.approx(1.8, abs=1e-15)


@pytest.mark.parametrize(
    ("joint", "p_WG"),
    [
        (0, [0.0, 1.8, 1.2]),
        (1, [0.0, 0.0, -0.6]),
        (2, [0.7, 0.0, 0.1]),
        (3, [1.5, 0.0, 0.9]),
        (4, [1.5, 0.3, 1.2]),
    ],
)
def test_a_quarter_turn_of_each_joint_has_the_stated_sign(joint, p_WG):
    q = np.zeros((1, 5))
    q[0, joint] = math.pi / 2
    np.testing.assert_allclose(ARM.gun_poses(q)[1], [p_WG], atol=1e-15)


def test_gun_is_square_on_a_plumb_wall_when_pitches_cancel_and_yaws_cancel():
    q = np.array([[0.4, -0.9, 1.5, -0.6, -0.4]])
    np.testing.assert_allclose(ARM.forward(q)[0][0], np.eye(3), atol=1e-15)


@pytest.mark.parametrize(("elbow", "shoulder"), BRANCHES)
@pytest.mark.parametrize("tool", ["gun", "camera"])
def test_inverse_brings_the_tool_back_on_every_branch(tool, elbow, shoulder):
    poses = ARM.gun_poses if tool == "gun" else ARM.camera_poses
    solve = ARM.solve if tool == "gun" else ARM.solve_camera
    R_WF, p_WF = poses(random_positions(500))
    q = solve(p_WF, R_WF[:, :, 2], elbow=elbow, shoulder=shoulder)
    reached = np.isfinite(q).all(axis=1)
    assert reached.mean() > 0.5
    R_back, p_back = poses(q[reached])
    np.testing.assert_allclose(p_back, p_WF[reached], atol=1e-9)
    np.testing.assert_allclose(R_back[:, :, 2], R_WF[reached, :, 2], atol=1e-9)
    assert np.all(elbow * q[reached, 2] >= 0.0)


@pytest.mark.parametrize("tool", ["gun", "camera"])
def test_every_position_is_on_one_of_the_branches(tool):
    poses = ARM.gun_poses if tool == "gun" else ARM.camera_poses
    solve = ARM.solve if tool == "gun" else ARM.solve_camera
    q = random_positions(200)
    R_WF, p_WF = poses(q)
    found = [
        solve(p_WF, R_WF[:, :, 2], elbow=elbow, shoulder=shoulder)
        for elbow, shoulder in BRANCHES
    ]
    errors = np.stack([np.abs(np.exp(1j * x) - np.exp(1j * q)) for x in found])
    # The elbow angle is least sure where the arm is stretched: there its cosine,
    # known to 1e-16, gives the angle to 1e-8.
    assert np.nanmin(np.nanmax(errors, axis=2, initial=0.0), axis=0).max() < 1e-7


def test_elbow_up_lifts_the_elbow_above_the_line_from_shoulder_to_wrist():
    p_WG = np.array([[0.9, 0.2, 1.2]])
    for elbow in (1, -1):
        q = ARM.solve(p_WG, np.array([1.0, 0.0, 0.0]), elbow=elbow)
        elbow_height = -ARM.upper_arm * math.sin(q[0, 1])
        assert elbow * elbow_height > 0.1


def test_out_of_reach_is_nan_and_the_rest_is_solved():
    p_WG = np.array([[1.0, 0.0, 1.2], [1.81, 0.0, 1.2], [0.3, 0.0, 1.2]])
    q = ARM.solve(p_WG, np.array([1.0, 0.0, 0.0]))
    # The third asks the wrist onto the shoulder axis, nearer than |0.8 - 0.7| m.
    np.testing.assert_array_equal(np.isnan(q).all(axis=1), [False, True, True])
    np.testing.assert_array_equal(np.isnan(q).any(axis=1), [False, True, True])


@pytest.mark.parametrize("value", [math.nan, math.inf])
@pytest.mark.parametrize("what", [0, 1])
@pytest.mark.parametrize("axis", range(3))
def test_what_is_not_finite_is_nan_throughout(value, what, axis):
    asked = np.array([[1.2, 0.3, 1.0], [1.0, 0.0, 0.0]])
    asked[what, axis] = value
    with np.errstate(invalid="ignore"):
        assert np.isnan(ARM.solve(asked[:1], asked[1])).all()


def test_nozzle_and_spray_axis_are_those_of_the_gun_pose():
    q = random_positions(200)
    # A mount above L x as well, as the camera's is.
    for arm in (ARM, ARM.replace(X_LG=ARM.X_LC)):
        R_WG, p_WG = arm.gun_poses(q)
        np.testing.assert_allclose(arm.nozzle(q), p_WG, atol=1e-14)
        np.testing.assert_allclose(arm.spray_axis(q), R_WG[:, :, 2], atol=1e-14)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"forearm": 0.0}, "forearm must be > 0 m"),
        (
            {"X_LG": RigidTransform(R_AHEAD, [0.3, 0.01, 0.0])},
            "X_LG must have its z axis along L x",
        ),
        (
            {"X_LC": RigidTransform([0.2, 0.0, 0.1])},
            "X_LC must have its z axis along L x",
        ),
    ],
)
def test_arms_of_another_form_are_refused(change, message):
    with pytest.raises(ValueError, match=message):
        ARM.replace(**change)


def test_a_branch_is_plus_or_minus_one():
    with pytest.raises(ValueError, match="elbow must be"):
        ARM.solve(np.zeros((1, 3)), np.array([1.0, 0.0, 0.0]), elbow=0)


def test_travel_is_that_of_the_point_of_the_axes_that_moves_farthest():
    rng = np.random.default_rng(8)
    start = random_positions(200)
    q = np.stack([start, start + rng.normal(0.0, 0.05, start.shape)], axis=1)
    travel = np.array([ARM.travel(pair)[0] for pair in q])
    # Points all along the forearm and the tool, and camera and elbow.
    p_WLs = ARM.forward(q.reshape(-1, 5))[1].reshape(-1, 2, 3)
    p_WGs = ARM.gun_poses(q.reshape(-1, 5))[1].reshape(-1, 2, 3)
    p_WCs = ARM.camera_poses(q.reshape(-1, 5))[1].reshape(-1, 2, 3)
    along = ARM.upper_arm * np.cos(q[..., 1])
    p_WEs = np.stack(
        [
            np.cos(q[..., 0]) * along,
            np.sin(q[..., 0]) * along,
            ARM.shoulder_height - ARM.upper_arm * np.sin(q[..., 1]),
        ],
        axis=-1,
    )
    farthest = np.zeros(200)
    for a, b in ((p_WEs, p_WLs), (p_WLs, p_WGs), (p_WLs, p_WCs)):
        for share in np.linspace(0.0, 1.0, 11):
            moved = np.diff((1.0 - share) * a + share * b, axis=1)[:, 0]
            farthest = np.maximum(farthest, np.linalg.norm(moved, axis=1))
    np.testing.assert_allclose(travel, farthest, atol=1e-12)
    # One joint alone, stretched out: a chord.
    turned = np.array([np.zeros(5), [0.01, 0.0, 0.0, 0.0, 0.0]])
    assert ARM.travel(turned) == pytest.approx([2.0 * 1.8 * np.sin(0.005)])


def test_shoulder_and_elbow_that_tilt_against_one_another_leave_the_forearm_level():
    q = np.array([np.zeros(5), [0.0, 0.02, -0.02, 0.0, 0.0]])
    assert ARM.travel(q) == pytest.approx([2.0 * 0.7 * np.sin(0.01)])


def test_limits_hold_at_the_bounds_and_never_for_nan():
    one = np.ones(5)
    limits = ArmLimits(q_min=-one, q_max=one, v_max=one, a_max=one, effort_max=one)
    q = np.array([one, -one, 1.001 * one, np.nan * one])
    np.testing.assert_array_equal(limits.contains(q), [True, True, False, False])
