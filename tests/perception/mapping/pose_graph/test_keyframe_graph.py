import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix

from perception.depth_camera.depth import CameraIntrinsics
from perception.mapping.config import PoseGraphConfig
from perception.mapping.keyframes.keyframe import Keyframe, PlaneSight
from perception.mapping.keyframes.view import View
from perception.mapping.pose_graph.constraints import ConstraintKind, PoseConstraint
from perception.mapping.pose_graph.keyframe_graph import KeyframeGraph

CAMERA = CameraIntrinsics(fx=130.0, fy=130.0, cx=119.5, cy=71.5, width=240, height=144)
CONFIG = PoseGraphConfig()
LOOKING = RotationMatrix(np.diag([1.0, -1.0, -1.0]))
NORMAL = np.array([0.0, 0.0, 1.0])
# A flat view 0.7 m away: 9 x 5 points over the picture.
SAMPLE = np.array(
    [
        [(u - CAMERA.cx) / CAMERA.fx * 0.7, (v - CAMERA.cy) / CAMERA.fy * 0.7, 0.7]
        for u in np.linspace(1.0, 238.0, 9)
        for v in np.linspace(1.0, 142.0, 5)
    ],
    dtype=np.float32,
).T


def sight_of(X_WC, offset=0.0, normal_W=NORMAL):
    """The plane n . p = d as a perfect camera sees it, straight ahead."""
    normal = X_WC.rotation().inverse() @ normal_W
    away = offset - normal_W @ X_WC.translation()
    axes = np.linalg.svd(normal[None])[2][1:].T
    return PlaneSight(away * normal, normal, axes, 0.0003, np.full(2, 3e-4), 1.0)


def keyframe_of(k, X_WN, *planes):
    view = View(np.zeros((1, 1), np.float32))
    return Keyframe(k, float(k), X_WN, planes, SAMPLE, view)


def pose_at(x, z=0.7):
    return RigidTransform(LOOKING, [x, 0.0, z])


def empty():
    return KeyframeGraph.empty(CAMERA, CONFIG)


def wall_scan(shifts):
    """Arm poses that are wrong by `shifts` (n, 3), and sights of the wall z = 0."""
    dut, truth = empty(), []
    for k, shift in enumerate(shifts):
        X_WC = pose_at(0.2 * k)
        X_WN = RigidTransform(LOOKING, X_WC.translation() + shift)
        dut = dut.extended(keyframe_of(k, X_WN, sight_of(X_WC)), X_WN)
        truth.append(X_WC)
    return dut, truth


def test_one_wall_is_one_landmark_and_others_are_new_ones():
    X_WC = pose_at(0.0)
    tilted = np.array([0.0, np.sin(0.1), np.cos(0.1)])  # 5.7 deg, the limit is 5.
    dut = empty().extended(keyframe_of(0, X_WC, sight_of(X_WC)), X_WC)
    for k, sight in enumerate(
        [sight_of(X_WC, 0.02), sight_of(X_WC, 0.04), sight_of(X_WC, 0.0, tilted)], 1
    ):
        dut = dut.extended(keyframe_of(k, X_WC, sight), X_WC)
    assert [sighting.plane for sighting in dut.sightings] == [0, 0, 1, 2]
    assert dut.sighted.tolist() == [2, 1, 1]
    np.testing.assert_allclose(dut.planes[:, 3], [0.0, 0.04, 0.0], atol=1e-12)
    np.testing.assert_allclose(dut.planes[2, :3], tilted, atol=1e-12)


def test_given_constraints_are_kept_by_the_newer_keyframe():
    poses = [pose_at(0.2 * k) for k in range(3)]
    dut = empty()
    for k, X_WC in enumerate(poses):
        new = [
            PoseConstraint(
                i, k, ConstraintKind.APPEARANCE, poses[i].inverse() @ X_WC, np.eye(6), 9
            )
            for i in range(k)
        ]
        dut = dut.extended(keyframe_of(k, None), X_WC, new)
    assert [(c.i, c.j) for c in dut.constraints] == [(0, 1), (0, 2), (1, 2)]
    assert not dut.has_arm


@pytest.mark.parametrize(
    ("X_KC", "new"),
    [
        (RigidTransform([0.19, 0.0, 0.0]), False),
        (RigidTransform([0.21, 0.0, 0.0]), True),
        (RigidTransform(RollPitchYaw(0.0, 0.0, np.deg2rad(5.0)), [0, 0, 0]), False),
        (RigidTransform(RollPitchYaw(0.0, 0.0, np.deg2rad(7.0)), [0, 0, 0]), True),
    ],
)
def test_a_picture_is_new_beyond_the_distance_or_the_angle(X_KC, new):
    X_WC = pose_at(0.0)
    # Points in the middle of the picture stay in view: only the motion counts.
    middle = SAMPLE * np.array([[0.5], [0.5], [1.0]])
    dut = empty().extended(keyframe_of(0, X_WC).replace(sample=middle), X_WC)
    assert dut.is_new(X_KC) is new


def test_a_picture_is_new_if_the_last_keyframe_does_not_cover_it():
    # Nearer by a half: moving 0.19 m shifts the picture by 0.19 / 0.35 * 130 = 71 px of
    # 240, three of nine columns; a quarter is the limit.
    X_WC = pose_at(0.0, 0.35)
    keyframe = keyframe_of(0, X_WC).replace(sample=SAMPLE / 2)
    dut = empty().extended(keyframe, X_WC)
    assert dut.is_new(RigidTransform([0.19, 0.0, 0.0]))
    assert not dut.is_new(RigidTransform([0.05, 0.0, 0.0]))


def test_a_prediction_carries_the_last_correction_on():
    X_WC, X_WN = pose_at(0.01, 0.72), pose_at(0.0)
    dut = empty().extended(keyframe_of(0, X_WN), X_WC)
    found = dut.predicted(pose_at(0.3))
    assert found.IsNearlyEqualTo(pose_at(0.31, 0.72), 1e-12)
    assert empty().predicted(X_WN).IsExactlyEqualTo(X_WN)


def test_a_wall_corrects_distance_and_leaves_the_arm_along_the_wall():
    rng = np.random.default_rng(1)
    shifts = 0.001 * rng.standard_normal((12, 3))
    dut, truth = wall_scan(shifts)
    solution = dut.solved()
    *normal, offset = solution.graph.planes[0]
    for X_WC, X_true, shift in zip(solution.graph.poses, truth, shifts, strict=True):
        away = normal @ X_WC.translation() - offset
        # The sights' own 0.3 mm weigh against the arm's 1 mm and tilt.
        assert away == pytest.approx(0.7, abs=2e-4)
        along = X_WC.translation()[:2] - X_true.translation()[:2]
        np.testing.assert_allclose(along, shift[:2], atol=2e-5)
    # Steps are in the camera's axes, whose z points into the wall.
    np.testing.assert_allclose(solution.corrections[:, 3:5], 0.0, atol=2e-5)
    into = -solution.corrections[:, 5]
    np.testing.assert_allclose(np.diff(into), -np.diff(shifts[:, 2]), atol=3e-4)


def test_settled_keyframes_do_not_move():
    dut, _ = wall_scan(0.001 * np.random.default_rng(2).standard_normal((6, 3)))
    after = dut.settled([4, 5])
    for k in range(4):
        np.testing.assert_allclose(
            after.poses[k].GetAsMatrix34(), dut.poses[k].GetAsMatrix34(), atol=1e-12
        )
    assert not after.poses[5].IsNearlyEqualTo(dut.poses[5], 1e-5)
    np.testing.assert_array_equal(after.planes, dut.planes)


def test_the_main_frame_lies_in_the_most_seen_plane():
    dut, _ = wall_scan(np.zeros((3, 3)))
    X_WC = pose_at(0.6)
    side = sight_of(X_WC, -1.0, np.array([1.0, 0.0, 0.0]))
    dut = dut.extended(keyframe_of(3, X_WC, side), X_WC)
    X_WV = dut.main_frame()
    np.testing.assert_allclose(X_WV.rotation().matrix()[:, 2], NORMAL, atol=1e-12)
    # The camera's y points down: V's y points up in W.
    np.testing.assert_allclose(X_WV.rotation().matrix()[:, 1], [0, 1, 0], atol=1e-12)
    # Under the mean of the cameras, x = (0 + 0.2 + 0.4 + 0.6) / 4.
    np.testing.assert_allclose(X_WV.translation(), [0.3, 0.0, 0.0], atol=1e-12)


def test_settings_out_of_bounds_are_refused():
    with pytest.raises(ValueError, match="arm_sigma"):
        KeyframeGraph.empty(CAMERA, PoseGraphConfig(arm_sigma=0.0))
