"""Figures of tracking, against motions whose errors are set by hand."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix

from painter.planning.spray_path import Stroke
from painter.run.figures.tracking_figures import (
    speed_within,
    tracking_figures,
    wall_points,
)
from painter.run.folder.values import Executed

X_WT = np.eye(4)
# Gun square on the wall: G z against T z.
R_TG = RotationMatrix(np.diag([1.0, -1.0, -1.0]))


def make_executed(points, trigger, *, period=0.01, tilt=0.0, offset=(0.0, 0.0, 0.0)):
    """A gun 0.3 m before the wall at `points` (n, 2), off its command by a pose."""
    n = len(points)
    wanted = np.array([RigidTransform(R_TG, [*p, 0.3]).GetAsMatrix4() for p in points])
    turn = R_TG @ RotationMatrix.MakeXRotation(tilt)
    actual = np.array(
        [
            RigidTransform(turn, [*p, 0.3] + np.array(offset)).GetAsMatrix4()
            for p in points
        ]
    )
    return Executed(
        time=period * np.arange(n),
        q=np.zeros((n, 5)),
        v=np.zeros((n, 5)),
        trigger=np.asarray(trigger, dtype=float),
        X_WG=actual,
        X_WG_desired=wanted,
    )


def vertical(speeds, period=0.01):
    y = np.concatenate([[0.0], np.cumsum(np.asarray(speeds) * period)])
    return np.stack([np.zeros(y.size), y], axis=1)


def stroke(x=0.0, speed=0.5):
    return Stroke(np.array([x, 0.0]), np.array([x, 1.0]), speed, "body", 0)


def test_tip_and_angle_errors_are_those_put_in():
    points = vertical(np.full(100, 0.5))
    executed = make_executed(
        points, np.ones(101), tilt=np.deg2rad(0.7), offset=(0.0, 0.003, 0.004)
    )
    figures = tracking_figures(executed, [stroke()], X_WT)
    assert figures["tip_error_rms_m"] == pytest.approx(0.005)
    assert figures["tip_error_max_m"] == pytest.approx(0.005)
    assert figures["gun_angle_error_max_deg"] == pytest.approx(0.7)


def test_errors_with_the_gun_closed_do_not_count():
    points = vertical(np.full(10, 0.5))
    executed = make_executed(points, np.zeros(11), offset=(1.0, 0.0, 0.0))
    assert set(tracking_figures(executed, [stroke()], X_WT).values()) == {None}


def test_spray_axis_is_followed_to_the_wall():
    executed = make_executed(vertical([0.5]), [1, 1], tilt=np.deg2rad(45.0))
    # G z = -T z turned by 45 deg about G x = T x: up the wall by the stand-off.
    np.testing.assert_allclose(wall_points(executed, X_WT)[0], [0.0, 0.3], atol=1e-12)


def test_speed_share_is_of_length_not_of_time():
    # 1 s at the wanted speed, 0.5 m; then 1 s at twice that, 1 m.
    points = vertical([0.5] * 100 + [1.0] * 100)
    executed = make_executed(points, np.ones(201))
    share = speed_within(executed, [stroke()], X_WT, 0.02)
    # Windows of 0.02 s overlap the change of speed: 1 % of the length or less.
    assert share == pytest.approx(0.5 / 1.5, abs=0.01)


@pytest.mark.parametrize(("speed", "share"), [(0.5075, 1.0), (0.515, 0.0)])
def test_two_percent_is_the_bound(speed, share):
    executed = make_executed(vertical(np.full(50, speed)), np.ones(51))
    assert speed_within(executed, [stroke()], X_WT, 0.02) == share


def test_each_stroke_has_its_own_speed():
    slow, fast = vertical(np.full(50, 0.2)), vertical(np.full(50, 0.8))
    points = np.concatenate([slow, fast + [1.0, 0.0]])
    trigger = np.ones(102)
    trigger[50:52] = 0.0
    executed = make_executed(points, trigger)
    strokes = [stroke(0.0, 0.2), stroke(1.0, 0.8)]
    assert speed_within(executed, strokes, X_WT, 0.02) == 1.0
    assert speed_within(executed, strokes[:1], X_WT, 0.02) == pytest.approx(
        0.2, abs=0.01
    )


def test_encoder_steps_at_a_fast_log_do_not_spoil_the_speed():
    # 1 kHz log, 2e-5 m steps: one sample to the next is 4 % off at 0.5 m/s.
    points = np.round(vertical(np.full(1000, 0.5), 0.001) / 2e-5) * 2e-5
    executed = make_executed(points, np.ones(1001), period=0.001)
    assert speed_within(executed, [stroke()], X_WT, 0.02) == 1.0
