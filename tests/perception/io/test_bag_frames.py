from pathlib import Path

import numpy as np
import pytest

from perception.errors import CloudReadError
from perception.io.bag_frames import unpack_bag
from perception.io.frames import open_recording

# Recorded with librealsense's software device: six pictures, 800 to 805 mm, 1/30 s
# apart, of a camera of 60 px focal length; no colour.
BAG = Path(__file__).parent / "data" / "software_device.bag"


@pytest.fixture(autouse=True)
def driver():
    pytest.importorskip("pyrealsense2", reason="the `hardware` extra is not installed")


def test_a_recording_becomes_frames(tmp_path):
    unpack_bag(BAG, tmp_path)
    recording = open_recording(tmp_path)
    camera = recording.intrinsics
    assert (camera.width, camera.height, camera.fx, camera.fy) == (64, 48, 60.0, 60.0)
    frames = list(recording.frames())
    assert [int(np.median(frame.depth_mm)) for frame in frames] == list(range(800, 806))
    assert np.all(np.diff([frame.time for frame in frames]) > 0.0)
    assert all(frame.color.shape == (48, 64, 3) for frame in frames)


def test_damaged_recordings_are_refused(tmp_path):
    bad, out = tmp_path / "bad.bag", tmp_path / "out"
    out.mkdir()
    bad.write_bytes(BAG.read_bytes()[:300])
    with pytest.raises(CloudReadError, match="librealsense cannot read the recording"):
        unpack_bag(bad, out)
    with pytest.raises(CloudReadError, match="no such file|not found|missing"):
        unpack_bag(tmp_path / "none.bag", out)
