"""The first look keeps its distance and sees two diagonal quarters."""

import numpy as np
import pytest

from painter.errors import ReachError
from painter.planning.config import ScanConfig, TileConfig
from painter.planning.scan.first_look import look_poses, look_segments

TILE, SCAN = TileConfig(), ScanConfig()


def camera_centres(robot, poses, q):
    """Camera in T, (n, 3) m."""
    _, p_WCs = robot.kinematics.camera_poses(q)
    return (poses.transitions.ik.X_WT.inverse() @ p_WCs.T).T


def test_looks_keep_their_distance_and_are_near_the_point_asked_for(robot):
    poses = robot.camera_poses()
    p_TCs = camera_centres(robot, poses, look_poses(np.array([1.0, 1.0]), SCAN, poses))
    np.testing.assert_allclose(p_TCs[:, 2], SCAN.look_distance)
    assert np.abs(p_TCs[:, :2] - 1.0).max() <= 0.1 + 1e-9


def test_a_look_from_out_of_reach_names_distance_and_cure(robot):
    with pytest.raises(ReachError, match=r"1\.50 m before .* scan\.look_distance"):
        look_poses(
            np.array([1.0, 1.0]), ScanConfig(look_distance=1.5), robot.camera_poses()
        )


def test_first_look_is_quick_and_sees_two_diagonal_quarters(robot_of_each_mount):
    robot = robot_of_each_mount
    poses = robot.camera_poses()
    segments = look_segments(poses.transitions.q_home, TILE, SCAN, poses)
    # Less than a third of the scan's time, or it might as well scan twice.
    assert sum(segment.duration for segment in segments) + SCAN.look_time <= 5.0
    stops = np.array(
        [segment.q(np.array([segment.duration]))[0] for segment in segments]
    )
    p_TCs = camera_centres(robot, poses, stops)
    # Near the quarters' middles: two looks close to one another may both miss the wall.
    low_right = np.abs(p_TCs[:, :2] - [1.5, 0.5]).max(axis=1) <= 0.15
    assert low_right.any()
    assert np.abs(p_TCs[-1, :2] - [0.5, 1.5]).max() <= 0.15
