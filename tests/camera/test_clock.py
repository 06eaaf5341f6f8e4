import numpy as np
import pytest

from painter.camera.clock import CameraClock


def test_the_minimum_delay_gives_the_offset():
    # The camera's clock shows 1000 s less, and runs 50 ppm fast; pictures take 8 ms and
    # up to 30 ms more to arrive.
    rng, dut = np.random.default_rng(1), CameraClock(latency=0.008)
    errors = []
    for i in range(600):
        taken = 2000.0 + i / 30.0
        camera = (taken - 1000.0) * (1.0 + 50e-6)
        found = dut.map(camera, taken + 0.008 + rng.exponential(0.010))
        errors.append(found - taken)
    # Over the window of 200 pictures clocks drift by 0.33 ms; the minimum of as many
    # delays is below 1 ms.
    assert np.abs(errors[200:]).max() < 1.4e-3


def test_times_increase_and_are_never_in_the_future():
    rng, dut = np.random.default_rng(2), CameraClock(latency=0.0)
    last = -np.inf
    for i in range(300):
        arrival = 5.0 + i / 30.0 + rng.exponential(0.02)
        time = dut.map(i / 30.0, arrival)
        if time is not None:
            assert last < time <= arrival
            last = time


def test_repeated_and_older_pictures_have_no_time():
    dut = CameraClock(latency=0.0)
    assert dut.map(1.0, 10.0) == pytest.approx(10.0)
    assert dut.map(1.0, 10.03) is None
    assert dut.map(0.97, 10.04) is None
    assert dut.map(1.033, 10.05) == pytest.approx(10.033)


def test_a_delayed_picture_keeps_its_time():
    dut = CameraClock(latency=0.0)
    for i in range(30):
        dut.map(i / 30.0, 100.0 + i / 30.0)
    assert dut.map(1.0, 103.0) == pytest.approx(101.0)


def test_a_restarted_clock_is_estimated_anew():
    dut = CameraClock(latency=0.0)
    dut.map(500.0, 10.0)
    assert dut.map(0.1, 10.2) == pytest.approx(10.2)
    assert dut.map(0.2, 10.31) == pytest.approx(10.3)


def test_a_clock_that_steps_forward_applies_at_once():
    dut = CameraClock(latency=0.0)
    dut.map(5.0, 10.0)
    assert dut.map(3605.1, 10.1) == pytest.approx(10.1)
