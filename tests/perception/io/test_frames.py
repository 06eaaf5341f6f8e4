import json

import cv2
import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw

from perception.depth_camera.depth import CameraIntrinsics
from perception.errors import CloudReadError
from perception.io.frames import (
    Frame,
    open_recording,
    read_poses,
    write_poses,
    write_recording,
)

CAMERA = CameraIntrinsics(fx=50.0, fy=51.0, cx=31.5, cy=23.5, width=64, height=48)


def make_frame(time, X_WC=None):
    rng = np.random.default_rng(int(10 * time))
    depth_mm = rng.integers(0, 3000, (48, 64)).astype(np.uint16)
    return Frame(time, depth_mm, rng.integers(0, 256, (48, 64, 3), np.uint8), X_WC)


def pose(k):
    return RigidTransform(RollPitchYaw(0.1 * k, 0.2, -0.3), [k, 0.5, -1.0])


def test_a_recording_comes_back_as_it_was(tmp_path):
    frames = [make_frame(0.2 * k, pose(k)) for k in range(4)]
    assert write_recording(tmp_path, CAMERA, [(f, pose(9)) for f in frames]) == 4
    recording = open_recording(tmp_path)
    assert recording.intrinsics == CAMERA
    for before, after in zip(frames, recording.frames(), strict=True):
        np.testing.assert_array_equal(after.depth_mm, before.depth_mm)
        np.testing.assert_array_equal(after.color, before.color)
        assert after.X_WC.IsNearlyEqualTo(before.X_WC, 1e-8)
    assert read_poses(tmp_path / "groundtruth.txt")[0][1].IsNearlyEqualTo(pose(9), 1e-8)
    assert all(
        e.X_WC is None for e in open_recording(tmp_path, use_poses=False).entries
    )


def test_a_pose_is_that_of_the_pictures_time(tmp_path):
    write_recording(tmp_path, CAMERA, [(make_frame(0.25), pose(0))])
    # A quarter of the way from one to the other, both in place and in angle.
    ends = [
        RigidTransform(RollPitchYaw(0.0, 0.0, yaw), [x, 0.0, 0.0])
        for yaw, x in ((0.0, 1.0), (0.2, 1.04))
    ]
    write_poses(tmp_path / "arm.txt", zip((0.23, 0.31), ends, strict=True))
    (entry,) = open_recording(tmp_path).entries
    expected = RigidTransform(RollPitchYaw(0.0, 0.0, 0.05), [1.01, 0.0, 0.0])
    assert entry.X_WC.IsNearlyEqualTo(expected, 1e-8)
    # Too far apart to know what was between, and too far off to be the same.
    write_poses(tmp_path / "arm.txt", zip((0.2, 0.31), ends, strict=True))
    assert open_recording(tmp_path).entries[0].X_WC is None


def test_numbered_files_are_read_with_their_poses(tmp_path):
    camera = {"width": 64, "height": 48, "fx": 50, "fy": 51, "cx": 31.5, "cy": 23.5}
    (tmp_path / "intrinsics.json").write_text(json.dumps(camera))
    frame = make_frame(0.3)
    cv2.imwrite(str(tmp_path / "frame-000700.depth.png"), frame.depth_mm)
    cv2.imwrite(str(tmp_path / "frame-000700.color.jpg"), frame.color)
    np.savetxt(tmp_path / "frame-000700.pose.txt", pose(2).GetAsMatrix4())
    (entry,) = open_recording(tmp_path).entries
    assert entry.time == 700.0
    assert entry.X_WC.IsNearlyEqualTo(pose(2), 1e-6)
    (read,) = open_recording(tmp_path).frames()
    np.testing.assert_array_equal(read.depth_mm, frame.depth_mm)


def test_poses_that_are_none_are_refused_by_line(tmp_path):
    path = tmp_path / "poses.txt"
    write_poses(path, [(1.0, pose(1))])
    assert read_poses(path)[0][1].IsNearlyEqualTo(pose(1), 1e-8)
    path.write_text(path.read_text() + "2.0 1 2 3 0 0 0 0\n")
    with pytest.raises(CloudReadError, match="line 3 is not a pose"):
        read_poses(path)


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("camera.json", None, "no camera.json"),
        ("camera.json", '{"width": 64}', "height must be > 0 px"),
        (
            "camera.json",
            '{"width": 64, "height": 48, "fx": 50, "fy": 50, "cx": 319.5, "cy": 24}',
            "cx must be > 0 and < width 64, got 319.5",
        ),
        ("depth.txt", "0.0\n", "a time and a file name"),
        ("rgb.txt", "", "no frames"),
    ],
)
def test_unusable_folders_are_refused(tmp_path, name, text, message):
    write_recording(tmp_path, CAMERA, [(make_frame(0.0), pose(0))])
    if text is None:
        (tmp_path / name).unlink()
    else:
        (tmp_path / name).write_text(text)
    with pytest.raises(CloudReadError, match=message):
        open_recording(tmp_path)


def test_a_damaged_picture_is_named(tmp_path):
    write_recording(tmp_path, CAMERA, [(make_frame(0.0), pose(0))])
    (tmp_path / "depth/0.000000.png").write_bytes(b"no picture")
    with pytest.raises(CloudReadError, match=r"0\.000000\.png"):
        list(open_recording(tmp_path).frames())
