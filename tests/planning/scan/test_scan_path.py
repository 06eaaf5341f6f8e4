"""The scan sees all of the tile; rows keep distance, speed and overlap."""

import numpy as np
import pytest

from painter.errors import ReachError
from painter.planning.config import ScanConfig, TileConfig
from painter.planning.motion.reach import require_reach, tile_points, wrist_distances
from painter.planning.scan.scan_path import (
    look_poses,
    look_segments,
    scan_rows,
    scan_segments,
)

TILE, SCAN = TileConfig(), ScanConfig()
# At 0.7 m with 87 x 58 deg, by trigonometry.
HALF_WIDTH = 0.7 * np.tan(np.deg2rad(43.5))
HALF_HEIGHT = 0.7 * np.tan(np.deg2rad(29.0))


def camera_ends(robot, transitions, row):
    """Camera in T at both ends of a row, (2, 3) m."""
    q = transitions.ik.inverse_kinematics(np.stack([row.start.x, row.end.x]))
    R_WCs, p_WCs = robot.kinematics.camera_poses(q)
    np.testing.assert_allclose(
        R_WCs[:, :, 2], [-transitions.ik.X_WT.rotation().col(2)] * 2, atol=1e-9
    )
    return (transitions.ik.X_WT.inverse() @ p_WCs.T).T


def test_rows_cover_tile_and_margin_with_the_overlap(robot):
    transitions = robot.transitions()
    rows = scan_rows(TILE, SCAN, transitions)
    ends = np.array([camera_ends(robot, transitions, row) for row in rows])
    np.testing.assert_allclose(ends[..., 2], 0.7, atol=1e-9)
    # A strip of one baseline, 5 cm, on the left of a picture has no depth.
    assert (ends[..., 0].min(axis=1) - HALF_WIDTH + 0.05 <= -0.05 + 1e-9).all()
    assert (ends[..., 0].max(axis=1) + HALF_WIDTH >= 2.05 - 1e-9).all()
    heights = ends[:, 0, 1]
    assert heights[0] + HALF_HEIGHT >= 2.05 - 1e-9  # Top row first.
    assert heights[-1] - HALF_HEIGHT <= -0.05 + 1e-9
    assert (-np.diff(heights) <= 0.7 * 2.0 * HALF_HEIGHT + 1e-9).all()
    assert ends[-1, 1, 0] < ends[-1, 0, 0]  # The last row ends on the left.
    assert all(np.linalg.norm(row.v_TG) == pytest.approx(0.25) for row in rows)


def test_scan_is_quick(robot):
    transitions = robot.transitions()
    segments = scan_segments(transitions.q_home, TILE, SCAN, transitions)
    assert sum(segment.duration for segment in segments) < 25.0


def test_looks_keep_their_distance_and_are_near_the_place_asked_for(robot):
    transitions = robot.transitions()
    q = look_poses(np.array([1.0, 1.0]), SCAN, transitions)
    _, p_WCs = robot.kinematics.camera_poses(q)
    p_TCs = (transitions.ik.X_WT.inverse() @ p_WCs.T).T
    np.testing.assert_allclose(p_TCs[:, 2], SCAN.look_distance)
    assert np.abs(p_TCs[:, :2] - 1.0).max() <= 0.3 + 1e-9


def test_first_sight_is_quick_and_sees_two_quarters_across(robot):
    transitions = robot.transitions()
    segments = look_segments(transitions.q_home, TILE, SCAN, transitions)
    # Less than a third of the scan's time, or it might as well scan twice.
    assert sum(segment.duration for segment in segments) + SCAN.look_time <= 5.0
    stops = np.array(
        [segment.q(np.array([segment.duration]))[0] for segment in segments]
    )
    _, p_WCs = robot.kinematics.camera_poses(stops)
    p_TCs = (transitions.ik.X_WT.inverse() @ p_WCs.T).T
    # Near the quarters' middles: two looks close to one another may both miss the wall.
    low_right = np.abs(p_TCs[:, :2] - [1.5, 0.5]).max(axis=1) <= 0.15
    assert low_right.any()
    assert np.abs(p_TCs[-1, :2] - [0.5, 1.5]).max() <= 0.15


def test_scan_of_a_wall_too_far_away_says_by_how_much(robot):
    far = TileConfig(width=4.0)
    transitions = robot.transitions()
    with pytest.raises(ReachError, match=r"scan row .* needs \d\.\d\d m"):
        scan_rows(far, SCAN, transitions)


def test_reach_of_a_tile_too_high_names_the_worst_corner(robot):
    transitions = robot.transitions()
    points = tile_points(2.0, 3.0, 0.3)
    with pytest.raises(ReachError, match=r"tall: \d+ % .* T \([02]\.00, 3\.00\) m"):
        require_reach(points, ik=transitions.ik, limits=robot.limits, what="tall")


def test_wrist_distance_is_that_of_forward_kinematics(robot):
    transitions = robot.transitions()
    p_TGs = np.array([[0.2, 0.3, 0.3], [1.6, 1.9, 0.5]])
    _, p_WLs = robot.kinematics.forward(transitions.ik.inverse_kinematics(p_TGs))
    shoulder = np.array([0.0, 0.0, robot.kinematics.shoulder_height])
    np.testing.assert_allclose(
        wrist_distances(p_TGs, transitions.ik),
        np.linalg.norm(p_WLs - shoulder, axis=1),
    )
