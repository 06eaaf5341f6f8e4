"""The gun follows walls that are not flat; their true shapes are closed forms."""

import dataclasses

import numpy as np
import pytest

from painter.errors import MotionLimitError, ReachError
from painter.planning.config import MotionConfig
from painter.planning.motion.surface_frame import SurfaceFrame, above_wall
from painter.planning.motion.verify import verify_strokes
from painter.planning.spray_path import Stroke

HOME = np.deg2rad(MotionConfig().home_deg)
RADIUS = 4.0
SLOPE = np.tan(np.deg2rad(10.0))


def bulged(x, y):
    """A cylinder of 4 m radius, its axis level, nearest to the robot at y = 1 m."""
    return np.sqrt(RADIUS**2 - (y - 1.0) ** 2) - np.sqrt(RADIUS**2 - 1.0)


def tilted_half(x, y):
    """Two planes that meet upright at x = 1 m, the right one falling back by 10 deg."""
    return -SLOPE * np.maximum(x - 1.0, 0.0) + 0.0 * y


def folded_across(x, y):
    """Two planes that meet level at y = 1 m at 40 deg."""
    return -np.tan(np.deg2rad(40.0)) * np.maximum(y - 1.0, 0.0) + 0.0 * x


def ridge(x, y):
    """A level ridge at y = 1 m, 0.15 m high and 0.5 m wide."""
    return 0.15 * np.maximum(1.0 - np.abs(y - 1.0) / 0.25, 0.0) + 0.0 * x


def distance_and_normal(shape, p_TGs):
    """Distance (n,) of points to a true wall and its normal (n, 3) at their feet."""
    x, y, z = p_TGs.T
    if shape is bulged:
        out = np.stack(
            [0.0 * x, y - 1.0, z + np.sqrt(RADIUS**2 - 1.0)],
            axis=-1,
        )
        radius = np.linalg.norm(out, axis=1)
        return radius - RADIUS, out / radius[:, None]
    flat = np.broadcast_to([0.0, 0.0, 1.0], p_TGs.shape)
    back = np.array([SLOPE, 0.0, 1.0]) / np.hypot(SLOPE, 1.0)
    over_back = (p_TGs - [1.0, 0.0, 0.0]) @ back
    # On the convex edge's left a point's foot is on the plane that it stands before.
    right = x - over_back * back[0] > 1.0
    distance = np.where(x < 1.0, z, over_back)
    edge = ~right & (x > 1.0)
    distance[edge] = np.hypot(x - 1.0, z)[edge]
    return distance, np.where((x > 1.0)[:, None], back, flat)


@pytest.fixture
def make_shape(make_wall):
    """Makes segmentations of a wall of the expected tile with a true shape."""

    def make(shape, ripple=0.0):
        centres = (np.arange(200) + 0.5) * 0.01
        xs, ys = np.meshgrid(centres, centres)
        height = shape(xs, ys) + ripple * np.sin(2.0 * np.pi * ys / 0.04)
        slope_y, slope_x = np.gradient(height, 0.01)
        normals = np.stack([-slope_x, -slope_y, np.ones_like(height)], axis=-1)
        normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
        return dataclasses.replace(
            make_wall(),
            depth=height.astype(np.float32),
            surface=height.astype(np.float32),
            normals=normals.astype(np.float32),
        )

    return make


def strokes_over(*columns):
    return [
        Stroke(
            start_T=np.array([x, 0.3]),
            end_T=np.array([x, 1.7]),
            speed=0.6,
            kind="body",
            column=number,
        )
        for number, x in enumerate(columns)
    ]


def sprayed(robot, program):
    """Nozzle (n, 3), axis (n, 3) in T and the wanted foot (n, 2) while paint flows."""
    places, axes, feet = [], [], []
    X_TW = program.X_WT.inverse()
    for stroke, (on, off) in zip(program.strokes, program.motion.spray_on, strict=True):
        time = np.linspace(on, off, 300) + 0.02  # The valve's delay.
        q = program.motion.trajectory.vector_values(time).T
        R_WGs, p_WGs = robot.kinematics.gun_poses(q)
        places.append((X_TW @ p_WGs.T).T)
        axes.append((X_TW.rotation().matrix() @ R_WGs[:, :, 2].T).T)
        feet.append(np.linspace(stroke.start_T, stroke.end_T, 300))
    return tuple(np.concatenate(items) for items in (places, axes, feet))


@pytest.mark.parametrize("shape", [bulged, tilted_half])
def test_gun_keeps_its_distance_and_is_square_to_the_true_wall(
    robot, make_shape, shape
):
    wall = make_shape(shape)
    strokes = strokes_over(0.3, 0.6, 0.95, 1.02, 1.3, 1.7)
    program = robot.planner().program(strokes, wall, HOME)
    assert not program.skipped
    assert len(program.strokes) == len(strokes)
    # A stroke may be slowed; its film, flow over speed, is the one that was asked for.
    for stroke in program.strokes:
        assert 0.3 <= stroke.speed <= 0.6
        assert stroke.flow / stroke.speed == pytest.approx(1.0 / 0.6)
    places, axes, feet = sprayed(robot, program)
    distance, normals = distance_and_normal(shape, places)
    assert np.abs(distance - 0.30).max() < 0.003
    off_deg = np.rad2deg(np.arccos(np.clip(-np.sum(axes * normals, axis=1), -1, 1)))
    # Over the edge itself the gun is between the two normals.
    away = np.abs(feet[:, 0] - 1.0) > 0.06 if shape is tilted_half else slice(None)
    assert off_deg[away].max() < 1.0
    assert off_deg.max() < 10.0
    # The spray axis meets the true wall where the stroke wants it.
    hit = places + 0.30 * axes
    assert np.abs(hit[:, :2] - feet).max() < 0.005


def test_motion_before_a_bulged_wall_is_twice_smooth(robot, make_shape):
    program = robot.planner().program(strokes_over(0.5, 0.8), make_shape(bulged), HOME)
    time = program.motion.time
    step = 1e-6
    a = program.motion.trajectory.MakeDerivative(2)
    before, after = (
        a.vector_values(np.clip(time[1:-1] + d, 0.0, time[-1])) for d in (-step, step)
    )
    assert np.abs(after - before).max() < 0.01  # rad/s²


def test_ripple_does_not_shake_the_gun():
    centres = (np.arange(200) + 0.5) * 0.01
    _, ys = np.meshgrid(centres, centres)
    ripple = 0.002 * np.sin(2.0 * np.pi * ys / 0.04)  # 17 deg steep.
    dut = SurfaceFrame.smoothed(ripple, 0.01)
    y = np.linspace(0.2, 1.8, 400)
    normals = dut.normals(np.ones(400), y)
    assert np.rad2deg(np.arccos(normals[:, 2])).max() < 0.1
    assert np.abs(dut.heights(np.ones(400), y)).max() < 1e-4


@pytest.mark.parametrize("shape", [bulged, tilted_half])
def test_places_and_points_are_each_others_inverse(make_shape, shape):
    dut = SurfaceFrame.of_wall(make_shape(shape))
    rng = np.random.default_rng(3)
    places = rng.uniform([-0.3, -0.3, 0.1], [2.3, 2.3, 0.6], (200, 3))
    points, normals = dut.points(places)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-12)
    np.testing.assert_allclose(dut.places(points), places, atol=1e-6)


def test_surface_goes_on_beyond_the_tile(make_shape):
    dut = SurfaceFrame.of_wall(make_shape(tilted_half))
    x = np.array([1.9, 2.0, 2.2, 2.8])  # The last is beyond the spline's end.
    np.testing.assert_allclose(
        dut.heights(x, np.full(4, 0.5)), -SLOPE * (x - 1.0), atol=1e-4
    )


def test_a_surface_is_made_once_for_a_wall(make_shape):
    wall, other = make_shape(tilted_half), make_shape(bulged)
    first = SurfaceFrame.of_wall(wall)
    assert SurfaceFrame.of_wall(wall) is first
    assert SurfaceFrame.of_wall(other) is not first


def test_flat_wall_gives_the_same_program(robot, make_wall, make_shape):
    almost = make_shape(lambda x, y: 0.004 * (x - 1.0) + 0.0 * y)
    assert SurfaceFrame.of_wall(make_wall()) is None
    assert SurfaceFrame.of_wall(almost) is None
    strokes = strokes_over(0.4, 0.6)
    flat = robot.planner().program(strokes, make_wall(), HOME)
    same = robot.planner().program(
        strokes, dataclasses.replace(almost, depth=make_wall().depth), HOME
    )
    np.testing.assert_array_equal(flat.motion.q, same.motion.q)
    np.testing.assert_array_equal(flat.motion.time, same.motion.time)


def test_what_the_joints_cannot_follow_is_left_out_and_said(robot, make_shape):
    program = robot.planner().program(strokes_over(0.5, 1.0), make_shape(ridge), HOME)
    assert program.skipped
    assert any("bends too sharply" in item.reason for item in program.skipped)
    spans = [np.sort([s.start_T[1], s.end_T[1]]) for s in program.strokes]
    assert all(high < 1.0 or low > 1.0 for low, high in spans)  # None over the ridge.


def test_normals_beyond_reach_are_refused(robot, make_shape):
    with pytest.raises(ReachError, match="strokes: .* is out of reach"):
        robot.planner().program(strokes_over(0.5, 1.0), make_shape(folded_across), HOME)


@pytest.mark.parametrize(
    ("height", "what"), [(0.0, "gun angle"), (0.01, "stand-off error")]
)
def test_strokes_as_on_a_plane_are_refused_before_a_tilted_wall(
    robot, make_wall, height, what
):
    program = robot.planner().program(strokes_over(0.5), make_wall(), HOME)
    x = (np.arange(200) + 0.5) * 0.01
    tilted = np.tile(0.1 * (x - 0.5) + height, (200, 1))
    with pytest.raises(MotionLimitError, match=f"stroke 1: {what}"):
        verify_strokes(
            program,
            kinematics=robot.kinematics,
            valve_delay=0.02,
            surface=SurfaceFrame.smoothed(tilted, 0.01),
        )


def test_film_is_planned_against_the_wall_itself(make_shape):
    away = slice(5, -5)
    over = above_wall(make_shape(bulged))
    assert np.abs(over[away, away]).max() < 0.001
