"""Pictures over a local socket arrive whole, in time, and not from a dead server."""

import time

import numpy as np
import pytest

from painter.camera.frame_socket import FrameClient, FrameServer
from painter.camera.frames import CameraError


def test_pictures_arrive_whole_and_when_they_are_due(tmp_path):
    path = str(tmp_path / "camera")
    server, dut = FrameServer(path), FrameClient(path, latency=0.2)
    assert dut.wait_frame(0.0) is None
    rng = np.random.default_rng(1)
    depth = rng.integers(0, 4000, (4, 6), dtype=np.uint16)
    color = rng.integers(0, 255, (4, 6, 3), dtype=np.uint8)
    when = time.monotonic()
    server.send(depth, color, when)
    server.send(depth + 1, None, when)
    got_depth, got_color, got_when = dut.wait_frame(1.0)
    assert time.monotonic() - when >= 0.2
    assert got_when == when
    np.testing.assert_array_equal(got_depth, depth)
    np.testing.assert_array_equal(got_color, color)
    got_depth, got_color, _ = dut.wait_frame(1.0)
    np.testing.assert_array_equal(got_depth, depth + 1)
    assert got_color is None
    server.close()
    with pytest.raises(CameraError, match="the peer closed|No such file"):
        dut.wait_frame(1.0)


def test_a_missing_server_is_an_error(tmp_path):
    with pytest.raises(CameraError, match="No such file"):
        FrameClient(str(tmp_path / "none"), latency=0.1).wait_frame(0.1)
