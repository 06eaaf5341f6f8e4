import time

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from painter.camera.frames import CameraFrame
from painter.camera.reader import CameraHealth, CameraState, Reading
from painter.systems.hardware.realsense_camera import RealsenseCamera

SHAPE = {"width": 8, "height": 4, "color_width": 8, "color_height": 4}


class RobotConnection:
    """A simulator around the system, with a reading that tests set."""

    def __init__(self):
        self.reading = Reading()
        self.dut = RealsenseCamera(read=lambda: self.reading, period=0.02, **SHAPE)
        self.simulator = Simulator(self.dut)
        self.context = self.simulator.get_mutable_context()

    def picture(self, number, age, depth=700, color=None):
        frame = CameraFrame(np.full((4, 8), depth, np.uint16), color, 0.0, number)
        health = CameraHealth(state=CameraState.STREAMING, pictures=number)
        self.reading = Reading(frame, time.monotonic() - age, health)

    def advance(self, seconds):
        self.simulator.AdvanceTo(self.context.get_time() + seconds)

    def port(self, name):
        return self.dut.GetOutputPort(name).Eval(self.context)


@pytest.fixture
def connection():
    return RobotConnection()


def test_before_the_first_picture_there_is_none(connection):
    connection.advance(0.05)
    assert connection.port("image_time")[0] == -1.0
    assert not connection.port("depth_image").data.any()
    assert connection.port("status").state == "starting"
    assert connection.port("status").fault is None


def test_the_picture_has_the_time_at_which_it_was_taken(connection):
    connection.advance(1.0)
    connection.picture(1, age=0.05)
    connection.advance(0.03)  # The look due at 1.0 s was left for now.
    # Its age is measured by this computer's clock, which runs during the test.
    assert connection.port("image_time")[0] == pytest.approx(1.0 - 0.05, abs=0.01)
    assert (connection.port("depth_image").data == 700).all()


def test_the_same_picture_stays_and_a_newer_one_replaces_it(connection):
    connection.advance(1.0)
    connection.picture(1, age=0.05)
    connection.advance(0.1)
    first = connection.port("image_time")[0]
    connection.advance(0.1)
    assert connection.port("image_time")[0] == first
    connection.picture(2, age=0.01, depth=800)
    connection.advance(0.1)
    assert connection.port("image_time")[0] > first
    assert (connection.port("depth_image").data == 800).all()


def test_pictures_from_before_the_run_are_left_out(connection):
    connection.picture(1, age=30.0)
    connection.advance(0.1)
    assert connection.port("image_time")[0] == -1.0
    assert not connection.port("depth_image").data.any()


def test_colour_is_shown_where_it_fits(connection):
    color = np.full((4, 8, 3), (1, 2, 3), np.uint8)
    connection.advance(1.0)
    connection.picture(1, age=0.0, color=color)
    connection.advance(0.1)
    assert (connection.port("color_image").data == (1, 2, 3, 255)).all()
    connection.picture(2, age=0.0, color=np.ones((2, 2, 3), np.uint8))
    connection.advance(0.1)
    assert (connection.port("color_image").data == (0, 0, 0, 255)).all()


def test_a_missing_camera_is_in_the_status(connection):
    connection.advance(0.1)
    problem = "camera: no picture for 1 s. Reopening, try 1 of 5."
    connection.reading = Reading(
        health=CameraHealth(CameraState.MISSING, problem, repeated=2, late=3)
    )
    connection.advance(0.1)
    status = connection.port("status")
    assert status.state == "missing"
    assert status.fault == problem
    assert status.dropped == 5


def test_a_period_must_be_positive():
    with pytest.raises(ValueError, match="period must be > 0"):
        RealsenseCamera(read=Reading, period=0.0, **SHAPE)
