"""The scan sees all of the tile, whatever camera is bolted on in which way."""

import dataclasses
import math

import numpy as np
import pytest

from painter.config import load_scenario
from painter.errors import CollisionError, InputError, ReachError
from painter.planning.config import ScanConfig, TileConfig
from painter.planning.motion.gun_path import Pass, ToolMove
from painter.planning.motion.reach import require_reach, tile_points, wrist_distances
from painter.planning.scan.scan_path import check_scan, scan_rows, scan_segments
from perception.config import StereoConfig
from tests.cameras import CAMERAS, D405, D405_NEAR

TILE, SCAN = TileConfig(), ScanConfig()
# At 0.7 m with 87 deg over 848 of 848 x 480 square pixels, by trigonometry.
HALF_WIDTH = 0.7 * np.tan(np.deg2rad(43.5))
HALF_HEIGHT = 480 / 848 * HALF_WIDTH


def camera_ends(robot, transitions, row):
    """Camera in T at both ends of a row, (2, 3) m."""
    q = transitions.ik.inverse_kinematics(np.stack([row.start.x, row.end.x]))
    R_WCs, p_WCs = robot.kinematics.camera_poses(q)
    np.testing.assert_allclose(
        R_WCs[:, :, 2], [-transitions.ik.X_WT.rotation().col(2)] * 2, atol=1e-9
    )
    return (transitions.ik.X_WT.inverse() @ p_WCs.T).T


def test_rows_cover_tile_and_margin_with_the_overlap(robot):
    poses = robot.camera_poses()
    rows = scan_rows(TILE, SCAN, poses)
    ends = np.array([camera_ends(robot, poses.transitions, row) for row in rows])
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


@pytest.mark.parametrize(
    "overrides", [*CAMERAS.values(), D405_NEAR], ids=[*CAMERAS, "D405"]
)
def test_every_cell_lies_in_a_picture_that_both_imagers_see(
    robot_of_each_mount, overrides
):
    """Pictures are taken along the rows alone, and miss both ends by half a stride."""
    robot, job = robot_of_each_mount, load_scenario("blank", overrides)
    poses = robot.camera_poses(stereo=job.wall_camera.stereo)
    X_WT = poses.transitions.ik.X_WT
    x, y = np.meshgrid(np.arange(0.005, 2.0, 0.01), np.arange(0.005, 2.0, 0.01))
    p_WQs = X_WT @ np.stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    stereo = job.wall_camera.stereo
    half_x = math.tan(math.radians(stereo.hfov_deg) / 2.0)
    half_y = half_x * stereo.height / stereo.width
    for segment in scan_segments(poses.transitions.q_home, TILE, job.scan, poses):
        if not (isinstance(segment, ToolMove) and isinstance(segment.path, Pass)):
            continue
        period = 1.0 / job.wall_camera.rate
        time = np.arange(0.5 * period, segment.duration, period)
        R_WCs, p_WCs = robot.kinematics.camera_poses(segment.q(time))
        for R_WC, p_WC in zip(R_WCs, p_WCs, strict=True):
            p_CQs = R_WC.T @ (p_WQs - p_WC[:, None])
            assert (p_CQs[2] > stereo.min_range).all()
            assert (p_CQs[2] <= stereo.max_range).all()
            seen = np.abs(p_CQs[1]) <= half_y * p_CQs[2]
            for imager in (0.0, stereo.baseline):
                seen &= np.abs(p_CQs[0] - imager) <= half_x * p_CQs[2]
            p_WQs = p_WQs[:, ~seen]  # Those that no picture holds yet.
    assert p_WQs.size == 0


def test_a_camera_in_portrait_takes_fewer_rows_than_a_level_one(robot_of_each_mount):
    """Level pictures are 0.75 m high: 2.1 m take 1 + (2.1 - 0.75) / (0.7 x 0.75)."""
    robot = robot_of_each_mount
    rows = scan_rows(TILE, SCAN, robot.camera_poses())
    level = abs(robot.kinematics.X_LC.rotation().matrix()[1, 0]) > 0.5
    assert len(rows) == 4 if level else len(rows) < 4


def test_the_camera_comes_no_nearer_than_its_nearest_depth(robot):
    """From 0.78 m the arm cannot fold back, so it goes nearer if the camera can."""
    scan = ScanConfig(distance=0.78)
    rows = scan_rows(TILE, scan, robot.camera_poses())
    transitions = robot.transitions()
    (height,) = {
        round(float(z), 6)
        for row in rows
        for z in camera_ends(robot, transitions, row)[:, 2]
    }
    assert height < 0.78
    blind = StereoConfig(min_range=height + 0.001)
    with pytest.raises(CollisionError, match="scan row .* too near"):
        scan_rows(TILE, scan, robot.camera_poses(stereo=blind))


def test_scan_is_quick(robot):
    poses = robot.camera_poses()
    segments = scan_segments(poses.transitions.q_home, TILE, SCAN, poses)
    assert sum(segment.duration for segment in segments) < 25.0


def test_a_scan_longer_than_the_cycle_may_take_is_refused(robot):
    """With 24 of 480 lines a picture is 3.8 cm high: 2.1 m take 80 rows of 0.8 m."""
    flat = robot.camera(StereoConfig(height=24))
    cure = r"for 80 rows .* cycle\.time_limit of 100 s: raise scan\.distance"
    with pytest.raises(InputError, match=cure):
        check_scan(TILE, SCAN, flat, time_limit=100.0)
    check_scan(TILE, SCAN, flat, time_limit=600.0)
    poses = robot.camera_poses()
    with pytest.raises(InputError, match=r"for 4 rows .* cycle\.time_limit of 10 s"):
        scan_segments(poses.transitions.q_home, TILE, SCAN, poses, time_limit=10.0)


def test_pictures_too_far_apart_along_a_row_are_refused(robot):
    """One picture in 4 s: they lie 1 m apart, and 0.7 (1.33 - 0.05) m are allowed."""
    slow = dataclasses.replace(robot.camera(), rate=0.25)
    longest = 0.7 * (2.0 * HALF_WIDTH - 0.05)
    match = rf"leaves 1\.000 m .* more than the {longest:.3f} m .* lower scan\.speed"
    with pytest.raises(InputError, match=match):
        check_scan(TILE, SCAN, slow, time_limit=600.0)
    check_scan(TILE, ScanConfig(speed=0.2), slow, time_limit=600.0)


@pytest.mark.parametrize(
    ("overrides", "field"),
    [
        (D405, r"scan\.look_distance must be .* <= 0\.5 m.* got 0\.6"),
        ([*D405, "scan.look_distance=0.5"], r"scan\.distance must .* got 0\.7"),
        (["wall_camera.stereo.min_range=0.65"], r"scan\.look_distance .* 0\.65 m"),
        (["map.max_range=0.65"], r"scan\.distance must .* <= 0\.65 m"),
    ],
)
def test_a_distance_out_of_the_cameras_range_is_refused(overrides, field):
    with pytest.raises(InputError, match=field):
        load_scenario("blank", overrides)


def test_scan_of_a_wall_too_far_away_says_by_how_much(robot):
    far = TileConfig(width=4.0)
    with pytest.raises(ReachError, match=r"scan row .* needs \d\.\d\d m"):
        scan_rows(far, SCAN, robot.camera_poses())


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
