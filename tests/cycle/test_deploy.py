"""Until when a stopped gun was on its course, on hand-made logs."""

import numpy as np
import pytest

from painter.cycle.bus_record import Recorder
from painter.cycle.deploy import OFF_COURSE, on_course_until
from tests.cycle.hand_made_log import cycle_log
from tests.cycle.scripted_bus import CYCLE, ScriptedBus, feedback


def log_with_error(error):
    """A log sampled every 0.1 s, whose gun is off by `error` (n,), m, along W y."""
    count = len(error)
    desired = np.tile(np.eye(4), (count, 1, 1))
    measured = desired.copy()
    measured[:, 1, 3] = error
    return cycle_log(
        time=0.1 * np.arange(count),
        q=np.zeros((count, 5)),
        v=np.zeros((count, 5)),
        trigger=np.zeros(count),
        X_WG=measured,
        X_WG_desired=desired,
    )


SMALL, LARGE = 0.9 * OFF_COURSE, 1.1 * OFF_COURSE


@pytest.mark.parametrize(
    ("error", "stop", "until"),
    [
        # On its course to the end: the stop itself.
        ([SMALL] * 6, 0.42, 0.42),
        # Astray and back before the stop is known.
        ([SMALL, LARGE, LARGE, SMALL, SMALL, SMALL], 0.42, 0.42),
        # Astray from 0.3 s on: the last sample before.
        ([SMALL, SMALL, SMALL, LARGE, LARGE, LARGE], 0.42, 0.2),
        # Astray only after the stop: braking is no fault of the course.
        ([SMALL] * 5 + [LARGE], 0.42, 0.42),
        ([LARGE] * 6, 0.42, 0.0),
    ],
)
def test_a_gun_is_on_its_course_until_it_leaves_it_for_good(error, stop, until):
    assert on_course_until(log_with_error(error), stop) == pytest.approx(until)


def test_the_recorder_takes_each_sample_once():
    bus = ScriptedBus(lambda time: feedback(time, q=np.full(5, time)))
    dut = Recorder(bus)
    for wait in (0.02, 0.0, 0.01):
        bus.wait_until(bus.now() + wait)
        dut.take()
    samples = dut.samples()
    # The sample at 100 s was there before; six cycles of 5 ms follow.
    expected = 100.0 + CYCLE * np.arange(1, 7)
    np.testing.assert_allclose(samples.time, expected)
    np.testing.assert_allclose(samples.q, np.tile(expected, (5, 1)).T)
    assert dut.last == pytest.approx(100.03)


def test_a_recorder_without_samples_gives_empty_ones():
    dut = Recorder(ScriptedBus(feedback))
    dut.take()
    assert dut.samples().time.size == 0
    assert dut.samples().q.shape == (0, 5)
