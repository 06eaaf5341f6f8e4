import dataclasses

import numpy as np
import pytest
from pydrake.math import RigidTransform

from perception.config import StereoConfig
from perception.mapping.config import MapperConfig
from perception.mapping.sessions.mapper import Mapper, NoMapError, Outcome
from perception.mapping.sessions.report import session_report

STEREO = StereoConfig(width=424, height=240)


def mapped(scan, intrinsics, with_arm=True):
    dut = Mapper(intrinsics, MapperConfig())
    for frame, _ in scan:
        dut.add(frame if with_arm else frame.replace(X_WC=None))
    return dut, dut.finish()


def aligned_rms(poses, scan):
    """Root mean square distance after the best rigid motion (Horn, 1987)."""
    truth = {frame.time: X.translation() for frame, X in scan}
    p = np.array([X.translation() for _, X in poses])
    q = np.array([truth[time] for time, _ in poses])
    p, q = p - p.mean(axis=0), q - q.mean(axis=0)
    U, _, Vt = np.linalg.svd(p.T @ q)
    sign = np.diag([1.0, 1.0, np.sign(np.linalg.det(U @ Vt))])
    return np.sqrt(np.mean(np.sum((p @ U @ sign @ Vt - q) ** 2, axis=1)))


@pytest.fixture(scope="module")
def blank(blank_scan, intrinsics):
    return mapped(blank_scan, intrinsics)


def test_a_blank_wall_is_mapped_with_the_arms_poses(blank, blank_scan, intrinsics):
    dut, result = blank
    assert len(result.poses) == len(blank_scan)
    assert dut.outcomes[Outcome.LOST] == 0
    height = (result.fused.X_WV.inverse() @ result.fused.p_WQs)[2]
    # Thinner than one picture's pixels: Z² sigma_d / (f B), 90 % within 3.29 of it.
    pixel = 0.7**2 * STEREO.subpixel / (intrinsics.fx * STEREO.baseline)
    assert np.diff(np.percentile(height, [5, 95])) < 0.7 * 3.29 * pixel


def test_on_a_blank_wall_only_distance_and_tilt_are_corrected(blank, blank_scan):
    dut, result = blank
    report = session_report(dut, result)
    share = report["observed_share"]
    assert min(share["normal"], share["about_x"], share["about_y"]) == 1.0
    assert max(share["x"], share["y"], share["about_normal"]) == 0.0
    assert report["correction_rms"]["x_m"] < 2e-4
    assert report["correction_rms"]["y_m"] < 2e-4
    # The camera's tilt to the wall: the injected mount error is gone.
    truth = {frame.time: X for frame, X in blank_scan}
    graph = result.solution.graph
    for keyframe, X_WC in zip(graph.keyframes, graph.poses, strict=True):
        seen = X_WC.rotation().inverse() @ graph.planes[0, :3]
        true = truth[keyframe.time].rotation().inverse() @ np.array([0.0, 0.0, 1.0])
        assert np.degrees(np.arccos(min(1.0, seen @ true))) < 0.15


def test_a_blank_wall_without_poses_is_refused(blank_scan, intrinsics):
    with pytest.raises(NoMapError, match="too little texture"):
        mapped(blank_scan, intrinsics, with_arm=False)


def test_a_textured_wall_needs_no_poses(textured_scan, intrinsics):
    _, result = mapped(textured_scan, intrinsics, with_arm=False)
    assert len(result.poses) == len(textured_scan)
    assert aligned_rms(result.poses, textured_scan) < 0.003


def test_the_arms_poses_are_not_made_worse(textured_scan, intrinsics):
    _, result = mapped(textured_scan, intrinsics)
    arm = [(frame.time, frame.X_WC) for frame, _ in textured_scan]
    # The views are a quarter of the D435's: as good as the arm, give or take 0.2 mm.
    limit = aligned_rms(arm, textured_scan) + 2e-4
    assert aligned_rms(result.poses, textured_scan) < limit


def test_unusable_frames_are_counted(blank_scan, intrinsics):
    dut = Mapper(intrinsics, MapperConfig())
    frame, later = blank_scan[0][0], blank_scan[1][0]
    assert dut.add(frame) is Outcome.KEYFRAME
    assert dut.add(frame) is Outcome.OUT_OF_ORDER
    empty = np.zeros_like(later.depth_mm)
    assert dut.add(later.replace(depth_mm=empty)) is Outcome.NO_DEPTH
    small = later.replace(depth_mm=later.depth_mm[:10].copy())
    assert dut.add(small) is Outcome.WRONG_SIZE
    assert dut.add(later) in (Outcome.KEYFRAME, Outcome.TRACKED)
    assert sum(dut.outcomes.values()) == 5


def test_dropped_late_and_repeated_frames_spoil_nothing(blank, blank_scan, intrinsics):
    dut = Mapper(intrinsics, MapperConfig())
    frames = [frame for frame, _ in blank_scan]
    kept = frames[:6] + frames[10:]
    for index, frame in enumerate(kept):
        dut.add(frame)
        dut.add(frame)
        if index > 3:
            dut.add(kept[index - 3])
    result = dut.finish()
    assert len(result.poses) == len(kept)
    assert dut.outcomes[Outcome.OUT_OF_ORDER] == len(kept) + len(kept) - 4
    *normal, _ = result.solution.graph.planes[0]
    np.testing.assert_allclose(normal, [0.0, 0.0, 1.0], atol=0.004)


def test_a_camera_of_another_focal_length_is_refused(textured_scan, intrinsics):
    wrong = dataclasses.replace(
        intrinsics, fx=1.1 * intrinsics.fx, fy=1.1 * intrinsics.fy
    )
    # Seen through a longer lens the wall is smaller and moves less.
    with pytest.raises(NoMapError, match=r"move 0\.9\d* times .* focal length"):
        mapped(textured_scan, wrong)


def test_no_frame_is_no_map(intrinsics):
    with pytest.raises(NoMapError, match="sequence is empty"):
        Mapper(intrinsics, MapperConfig()).finish()


def test_settings_out_of_bounds_are_refused(intrinsics):
    with pytest.raises(ValueError, match=r"mapping\.cell must be > 0"):
        Mapper(intrinsics, MapperConfig(cell=0.0))


def test_the_main_plane_looks_at_the_camera(blank):
    dut, _ = blank
    X_WV = dut.graph.main_frame()
    # T is W here: z out of the wall, and the wall at z = 0.
    np.testing.assert_allclose(X_WV.rotation().matrix()[:, 2], [0, 0, 1], atol=0.01)
    off = X_WV.inverse() @ RigidTransform().translation()
    assert abs(off[2]) < 0.01
