"""Depth images of a static scene, alone, in folders and in RealSense recordings."""

import importlib.util
import json
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from perception.errors import CloudReadError
from perception.io import bags as bag_io
from perception.io.bags import read_bag
from perception.io.depth_images import evenly, median_depth, read_depth_frames

CAMERA = {"width": 4, "height": 3, "fx": 2.0, "fy": 4.0, "cx": 1.0, "cy": 2.0}


def test_median_leaves_out_what_was_not_measured():
    frames = np.array(
        [
            [[700, 0, 0, 10]],
            [[704, 801, 0, 20]],
            [[999, 803, 900, 40]],
            [[701, 0, 0, 9]],
        ],
        dtype=np.uint16,
    )
    # 700, 701, 704, 999; 801 and 803 (half of four); 900 alone (too few); 9 to 40.
    np.testing.assert_array_equal(median_depth(frames), [[702.5, 802.0, 0.0, 15.0]])


def test_folder_of_images_is_fused(tmp_path):
    (tmp_path / "camera.json").write_text(json.dumps(CAMERA))
    paths = []
    for number, depth in enumerate((500, 520, 2000)):
        paths.append(tmp_path / f"depth_{number}.png")
        Image.fromarray(np.full((3, 4), depth, np.uint16)).save(paths[-1])
    points = read_depth_frames(paths, tmp_path / "camera.json")
    assert points.shape == (3, 12)
    np.testing.assert_allclose(points[2], 0.52)


def test_long_sequences_are_thinned_evenly():
    picked = evenly(list(range(1000)))
    assert len(picked) == 60
    assert (picked[0], picked[-1]) == (0, 999)
    assert max(np.diff(picked)) - min(np.diff(picked)) <= 1


def record(path, frames):
    """Records depth pictures with librealsense's own device made of software."""
    import pyrealsense2 as rs

    height, width = frames[0].shape
    device = rs.software_device()
    sensor = device.add_sensor("Stereo Module")
    lens = rs.intrinsics()
    lens.width, lens.height = width, height
    lens.fx, lens.fy, lens.ppx, lens.ppy = 40.0, 50.0, 31.5, 23.5
    lens.model, lens.coeffs = rs.distortion.brown_conrady, [0.0] * 5
    stream = rs.video_stream()
    stream.type, stream.fmt, stream.uid = rs.stream.depth, rs.format.z16, 1
    stream.width, stream.height, stream.fps, stream.bpp = width, height, 30, 2
    stream.intrinsics = lens
    profile = sensor.add_video_stream(stream)
    sensor.add_read_only_option(rs.option.depth_units, 0.0005)
    recorder = rs.recorder(str(path), device)
    recorded = recorder.query_sensors()[0]
    recorded.open(recorded.get_stream_profiles()[0])
    recorded.start(rs.frame_queue(50))
    for number, depth in enumerate(frames):
        frame = rs.software_video_frame()
        frame.pixels, frame.bpp, frame.stride = depth, 2, 2 * width
        frame.timestamp, frame.frame_number = 33.0 * number, number + 1
        frame.domain = rs.timestamp_domain.hardware_clock
        frame.profile, frame.depth_units = profile.as_video_stream_profile(), 0.0005
        sensor.on_video_frame(frame)
        time.sleep(0.03)  # The recorder writes in a thread of its own.
    recorded.stop()
    recorded.close()
    recorder.pause()


@pytest.fixture
def recording(tmp_path):
    """Three pictures 1.6 m away, half a pixel's column nearer; in units of 0.5 mm."""
    pytest.importorskip("pyrealsense2", reason="the `hardware` extra is not installed")
    depth = np.full((48, 64), 3200, np.uint16)
    depth[:, :10] = 0
    frames = [depth, depth + np.uint16(4) * (depth > 0), depth]
    for suffix in (".bag", ".db3"):  # Up to librealsense 2.57, and from 2.58 on.
        path = tmp_path / f"wall{suffix}"
        try:
            record(path, [np.ascontiguousarray(frame, np.uint16) for frame in frames])
        except RuntimeError as error:
            if "extension" not in str(error):
                raise
        else:
            return path
    raise AssertionError("librealsense records neither form")


def test_realsense_recording_gives_its_points(recording):
    points = read_bag(recording)
    assert points.shape == (3, 48 * 54)
    np.testing.assert_allclose(points[2], 1.6, atol=1e-6)
    # The first pixel that was measured: column 10, row 0.
    np.testing.assert_allclose(
        points[:2, 0], [(10 - 31.5) / 40 * 1.6, -23.5 / 50 * 1.6], atol=1e-6
    )


def test_damaged_recording_is_refused(recording):
    data = recording.read_bytes()
    for damaged in (data[: len(data) // 2], b"#ROSBAG V2.0\n" + data[:200]):
        recording.write_bytes(damaged)
        with pytest.raises(
            CloudReadError, match="librealsense cannot read the recording"
        ):
            read_bag(recording)


def test_old_recordings_are_played(tmp_path):
    pytest.importorskip("pyrealsense2", reason="the `hardware` extra is not installed")
    # Recorded by `record` with librealsense 2.57: six pictures, 800 to 805 mm.
    path = Path(__file__).parent / "data" / "software_device.bag"
    points = read_bag(path)
    assert points.shape == (3, 48 * 64)
    np.testing.assert_allclose(points[2], 0.8025, atol=1e-6)


def test_missing_driver_is_named(tmp_path, monkeypatch):
    (tmp_path / "wall.bag").write_bytes(b"#ROSBAG V2.0\n")
    find = importlib.util.find_spec
    monkeypatch.setattr(
        bag_io.importlib.util,
        "find_spec",
        lambda name: None if name == "pyrealsense2" else find(name),
    )
    with pytest.raises(CloudReadError, match=r"pip install 'painter\[hardware\]'"):
        read_bag(tmp_path / "wall.bag")
