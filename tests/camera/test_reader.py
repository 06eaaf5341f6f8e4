"""The reading thread with a camera that comes and goes."""

import dataclasses
import itertools
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
PATIENCE = 20.0


class Script:
    """A camera that does what a list says: a time gives a picture, None nothing."""

    def __init__(self, steps, numbers=None):
        self.steps = iter(steps)
        self.numbers = iter(numbers or itertools.count(1))
        self.is_closed = False

    def wait(self, timeout):
        step = next(self.steps, None)
        if isinstance(step, Exception):
            raise step
        if step is None:
            time.sleep(0.01)
            return None
        return CameraFrame(np.zeros((2, 2), np.uint16), None, step, next(self.numbers))

    def close(self):
        self.is_closed = True


def wait_for(dut, condition):
    end = time.monotonic() + PATIENCE
    while not condition(dut.read()):
        assert time.monotonic() < end, dut.read().health
        time.sleep(0.005)
    return dut.read()


def ticking(count, start=0.0):
    return [start + i / 30 for i in range(count)]


def test_the_newest_picture_and_its_time_are_read():
    camera = Script(ticking(3))
    before = time.monotonic()
    with CameraReader(lambda: camera, CONFIG) as dut:
        reading = wait_for(dut, lambda r: r.health.pictures == 3)
        assert reading.frame.number == 3
        assert before - 0.1 <= reading.taken <= time.monotonic()
        assert reading.health.state == CameraState.STREAMING
        assert reading.health.problem == ""
    assert camera.is_closed


def test_repeated_and_skipped_pictures_are_counted():
    # The second came twice; three were taken that never came.
    camera = Script([0.0, 10.0, 10.0, 10.033], numbers=[1, 2, 2, 6])
    with CameraReader(lambda: camera, CONFIG) as dut:
        health = wait_for(dut, lambda r: r.health.skipped == 3).health
    assert health.repeated == 1
    assert health.pictures == 3


def test_a_picture_that_is_too_old_is_dropped():
    class Slow(Script):
        def wait(self, timeout):
            frame = super().wait(timeout)
            if frame is not None and frame.number == 3:
                time.sleep(0.3)  # Held up on its way.
            return frame

    camera = Slow([0.0, 0.01, 0.02, 0.35])
    config = dataclasses.replace(CONFIG, max_age=0.1)
    with CameraReader(lambda: camera, config) as dut:
        health = wait_for(dut, lambda r: r.health.pictures == 3).health
        assert health.late == 1


@pytest.mark.parametrize(
    ("steps", "words"),
    [
        (ticking(2), "no picture for 0.3 s"),
        (
            [
                *ticking(2),
                CameraError("camera X: it was unplugged.", code="PNT-TEST-001"),
            ],
            "was unplugged",
        ),
    ],
)
def test_a_camera_that_goes_is_opened_again(steps, words):
    cameras = [Script(steps), Script([*ticking(2), *[None] * 10_000])]
    opened = iter(cameras)
    config = dataclasses.replace(CONFIG, silence=0.3)
    with CameraReader(lambda: next(opened), config) as dut:
        missing = wait_for(dut, lambda r: r.health.state == CameraState.MISSING)
        assert words in missing.health.problem
        assert "Try 1 of 2" in missing.health.problem
        assert cameras[0].is_closed
        back = wait_for(dut, lambda r: r.health.pictures == 4)
        assert back.health.problem == ""
        assert back.health.reconnects == 1


def test_tries_are_bounded_and_the_end_is_said():
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


def test_pictures_make_the_tries_count_anew():
    # Each camera gives a picture and goes: never two failures in a row without one.
    def camera():
        return Script([0.0, CameraError("gone.", code="PNT-TEST-001")])

    with CameraReader(camera, CONFIG) as dut:
        wait_for(dut, lambda r: r.health.reconnects > 2 * CONFIG.retries)


def test_a_rendered_picture_comes_through_librealsense():
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
    opener = camera_opener(CONFIG, camera, baseline=0.05, source=Source())
    with CameraReader(opener, CONFIG) as dut:
        reading = wait_for(dut, lambda r: r.health.pictures >= 5)
        assert (reading.frame.depth_mm == 700 + reading.frame.number).all()
        assert 0.0 <= time.monotonic() - reading.taken < PATIENCE


def test_without_librealsense_the_extra_is_named(monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    camera = CameraIntrinsics.from_stereo(StereoConfig())
    with pytest.raises(InputError, match=r"painter\[hardware\]"):
        camera_opener(CONFIG, camera, baseline=0.05)
