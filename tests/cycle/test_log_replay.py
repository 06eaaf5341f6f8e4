"""A log of the bus in the robot's station: an arm that turns about its base."""

import numpy as np
import pytest

from painter.canopen.master.feedback import BusState
from painter.config import Scenario
from painter.cycle.log_replay import ReplayLog
from tests.cycle.scripted_bus import CYCLE, ScriptedBus, feedback

SPEED = 0.4
LAG = 0.05
STOP = 0.75
HOME = np.deg2rad(Scenario().motion.home_deg)


def at(time):
    """The base turns at 0.4 rad/s, 50 ms behind its command, and is stopped."""
    elapsed = time - 100.0
    turn = np.array([1.0, 0.0, 0.0, 0.0, 0.0])
    stopped = elapsed >= STOP
    return feedback(
        time,
        bus_state=BusState.STOPPED if stopped else BusState.ENABLED,
        reason="e-stop: the chain is open" if stopped else "",
        q=HOME + SPEED * (elapsed - LAG) * turn,
        v=SPEED * turn,
        q_commanded=HOME + SPEED * elapsed * turn,
        trigger=float(0.25 <= elapsed < 0.5),
    )


@pytest.fixture(scope="module")
def replay():
    return ReplayLog(Scenario(), ScriptedBus(at), CYCLE)


def test_joints_are_those_of_the_log(replay):
    np.testing.assert_allclose(replay.time, CYCLE * np.arange(201), atol=1e-9)
    turned = SPEED * (replay.time - LAG)
    np.testing.assert_allclose(replay.q[:, 0] - HOME[0], turned, atol=1e-9)
    np.testing.assert_allclose(replay.q[:, 1:] - HOME[1:], 0.0, atol=1e-9)
    np.testing.assert_allclose(replay.v[:, 0], SPEED, atol=1e-9)
    # Open from 0.25 to 0.5 s.
    assert CYCLE * replay.trigger.sum() == pytest.approx(0.25, abs=1.5 * CYCLE)


def test_the_gun_turns_about_the_base_and_lags_by_the_arc(replay):
    p_WG, p_WG_desired = replay.X_WG[:, :3, 3], replay.X_WG_desired[:, :3, 3]
    # The base yaw's axis is W's z: height and radius stay, the azimuth turns.
    np.testing.assert_allclose(np.ptp(p_WG[:, 2]), 0.0, atol=1e-9)
    radius = np.hypot(p_WG[:, 0], p_WG[:, 1])
    np.testing.assert_allclose(radius, radius[0], atol=1e-9)
    azimuth = np.unwrap(np.arctan2(p_WG[:, 1], p_WG[:, 0]))
    assert azimuth[-1] - azimuth[0] == pytest.approx(SPEED * 1.0)
    # Chord of the angle by which the arm lags.
    lag = np.linalg.norm(p_WG - p_WG_desired, axis=1)
    chord = 2.0 * radius[0] * np.sin(0.5 * SPEED * LAG)
    np.testing.assert_allclose(lag, chord, atol=1e-9)


def test_a_stop_is_named_once(replay):
    ((time, cause),) = replay.stops
    assert time == pytest.approx(STOP, abs=CYCLE + 1e-9)
    assert cause == "e-stop: the chain is open"
