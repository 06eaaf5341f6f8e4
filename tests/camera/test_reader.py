"""The reader thread with cameras by script, on a clock that the cameras advance."""

import dataclasses
import itertools
import threading
import time

import numpy as np
import pytest

from painter.camera.config import CameraDriverConfig
from painter.camera.frames import CameraError, CameraFrame
from painter.camera.reader import CameraReader, CameraState, camera_opener
from painter.errors import InputError
from perception.config import StereoConfig
from perception.depth_camera.depth import CameraIntrinsics

CONFIG = CameraDriverConfig(silence=0.3, retries=2, retry_period=0.05)
HANG = 60.0
PERIOD = 1 / 30
SILENT = object()


class Clock:
    """Advances only by what the cameras add."""

    def __init__(self):
        self.time = 100.0

    def now(self):
        return self.time


class Script:
    """A camera that follows a list: a time is a picture, SILENT 0.1 s without one.

    At the end of the list no pictures come and the clock stands still.
    """

    def __init__(self, steps, numbers=None):
        self.steps = iter(steps)
        self.numbers = iter(numbers or itertools.count(1))
        self.is_closed = False
        self.clock = None

    def wait(self, timeout):
        step = next(self.steps, None)
        if isinstance(step, Exception):
            raise step
        if step is SILENT:
            self.clock.time += 0.1
            return None
        if step is None:
            time.sleep(0.01)
            return None
        self.clock.time += PERIOD
        return CameraFrame(np.zeros((2, 2), np.uint16), None, step, next(self.numbers))

    def close(self):
        self.is_closed = True


class Bench:
    """A reader that opens the given cameras one after the other.

    Attributes:
        seen: Health at each opening.
    """

    def __init__(self, *cameras, config=CONFIG):
        self.clock = Clock()
        for camera in cameras:
            camera.clock = self.clock
        self.seen = []
        self._cameras = iter(cameras)
        self._is_ready = threading.Event()
        self.reader = CameraReader(self._open, config, self.clock)
        self._is_ready.set()

    def _open(self):
        self._is_ready.wait()
        self.seen.append(self.reader.read().health)
        return next(self._cameras)

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.reader.close()


def wait_for(dut, condition):
    end = time.monotonic() + HANG
    while not condition(reading := dut.read()):
        assert time.monotonic() < end, reading.health
        time.sleep(0.005)
    return reading


def ticking(count):
    return [i * PERIOD for i in range(count)]


def test_the_newest_picture_and_its_time_are_read():
    camera = Script(ticking(3))
    with Bench(camera) as bench:
        reading = wait_for(bench.reader, lambda r: r.health.pictures == 3)
        assert reading.frame.number == 3
        # Three periods on the clock, and no latency.
        assert reading.taken == pytest.approx(100.0 + 3 * PERIOD)
        assert reading.health.state == CameraState.STREAMING
        assert reading.health.problem == ""
    assert camera.is_closed


def test_repeated_and_skipped_pictures_are_counted():
    # The second arrived twice; three were taken that never arrived.
    camera = Script([0.0, 10.0, 10.0, 10.033], numbers=[1, 2, 2, 6])
    with Bench(camera) as bench:
        health = wait_for(bench.reader, lambda r: r.health.skipped == 3).health
    assert health.repeated == 1
    assert health.pictures == 3


def test_a_picture_that_is_too_old_is_dropped():
    class Slow(Script):
        def wait(self, timeout):
            frame = super().wait(timeout)
            if frame is not None and frame.number == 3:
                self.clock.time += 0.3  # Delayed in transfer.
            return frame

    camera = Slow([0.0, 0.01, 0.02, 0.35])
    config = dataclasses.replace(CONFIG, max_age=0.1)
    with Bench(camera, config=config) as bench:
        health = wait_for(bench.reader, lambda r: r.health.pictures == 3).health
        assert health.late == 1


@pytest.mark.parametrize(
    ("steps", "words"),
    [
        ([*ticking(2), *[SILENT] * 4], "no picture for 0.3 s"),
        (
            [
                *ticking(2),
                CameraError("camera X: it was unplugged.", code="PNT-TEST-001"),
            ],
            "was unplugged",
        ),
    ],
)
def test_a_lost_camera_is_reopened(steps, words):
    cameras = [Script(steps), Script(ticking(2))]
    with Bench(*cameras) as bench:
        health = wait_for(bench.reader, lambda r: r.health.pictures == 4).health
        assert health.state == CameraState.STREAMING
        assert health.problem == ""
        assert health.reconnects == 1
    assert cameras[0].is_closed
    starting, missing = bench.seen
    assert starting.state == CameraState.STARTING
    assert missing.state == CameraState.MISSING
    assert words in missing.problem
    assert "Reopening, try 1 of 2." in missing.problem


def test_tries_are_bounded_and_the_loss_is_reported():
    opened = []

    def fail():
        opened.append(1)
        raise CameraError(
            "camera: no RealSense device is connected.", code="PNT-TEST-001"
        )

    with CameraReader(fail, CONFIG) as dut:
        lost = wait_for(dut, lambda r: r.health.state == CameraState.LOST)
        assert "Given up after 2 tries" in lost.health.problem
        assert "no RealSense device" in lost.health.problem
        time.sleep(0.2)
    assert len(opened) == 3


def test_a_picture_resets_the_tries():
    # Each camera gives a picture and fails: never two failures in a row without one.
    cameras = [
        Script([0.0, CameraError("lost.", code="PNT-TEST-001")]) for _ in range(5)
    ]
    with Bench(*cameras, Script([])) as bench:
        health = wait_for(bench.reader, lambda r: r.health.reconnects == 5).health
        assert health.state != CameraState.LOST


def test_a_rendered_picture_passes_librealsense():
    pytest.importorskip("pyrealsense2")

    class Source:
        def __init__(self):
            self.count = 0

        def wait_frame(self, timeout):
            time.sleep(0.03)
            self.count += 1
            depth = np.full((480, 848), 700 + self.count, np.uint16)
            return depth, None, 1000.0 + time.monotonic()

    camera = CameraIntrinsics.from_stereo(StereoConfig())
    config = dataclasses.replace(CONFIG, silence=HANG)
    opener = camera_opener(config, camera, baseline=0.05, source=Source())
    with CameraReader(opener, config) as dut:
        reading = wait_for(dut, lambda r: r.health.pictures >= 5)
        assert (reading.frame.depth_mm == 700 + reading.frame.number).all()
        assert 0.0 <= time.monotonic() - reading.taken < HANG


def test_without_librealsense_the_extra_is_named(monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    camera = CameraIntrinsics.from_stereo(StereoConfig())
    with pytest.raises(InputError, match=r"painter\[hardware\]"):
        camera_opener(CONFIG, camera, baseline=0.05)
