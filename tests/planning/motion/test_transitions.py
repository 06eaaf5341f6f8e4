"""Moves between strokes go over an obstacle or round it."""

import itertools

import numpy as np
import pytest

from painter.errors import CollisionError
from painter.planning.clearance.obstacles import ObstacleBox
from painter.planning.motion.blend import MovingState
from painter.planning.motion.gun_path import ToolMove, fastest_tool_blend
from painter.planning.motion.joint_motion import (
    fastest_joint_blend,
    least_travel,
    rest_to_rest,
)
from painter.planning.motion.transitions import end_q, start_q

UP = np.array([0.0, 0.6, 0.0])
# Taller than the stand-off: the gun cannot pass under its own clearance.
TALL = ObstacleBox("tall", np.array([0.9, 0.9, 0.0]), np.array([1.1, 1.0, 0.32]))


def nozzle(transitions, segment):
    """Places of the nozzle in T along a segment, (n, 3) m."""
    q = segment.q(np.linspace(0.0, segment.duration, 400))
    _, p_WGs = transitions.ik.kinematics.gun_poses(q)
    return (transitions.ik.X_WT.inverse() @ p_WGs.T).T


def test_retract_clears_a_tall_box_between_two_strokes(robot):
    transitions = robot.transitions(TALL)
    start = MovingState.steady(np.array([1.0, 0.65, 0.3]), UP)
    end = MovingState.steady(np.array([1.0, 1.25, 0.3]), UP)
    (move,) = transitions.connect(start, end)
    assert isinstance(move, ToolMove)
    places = nozzle(transitions, move)
    over = (places[:, 1] > 0.9) & (places[:, 1] < 1.0)
    assert over.any()
    assert places[over, 2].min() > 0.32 + 0.04  # Its top and the clearance.
    np.testing.assert_allclose(places[[0, -1]], [start.x, end.x], atol=1e-9)


def test_nothing_in_the_way_needs_no_retract(robot):
    transitions = robot.transitions()
    start = MovingState.steady(np.array([1.0, 0.65, 0.3]), UP)
    end = MovingState.steady(np.array([1.0, 1.25, 0.3]), UP)
    (move,) = transitions.connect(start, end)
    assert move.duration < 1.0  # 0.6 m at 0.6 m/s, or faster.
    assert nozzle(transitions, move)[:, 2].min() > 0.25


# Corners at the top; at the bottom, where the floor is near, one line further in.
@pytest.mark.parametrize(
    ("x", "y", "sign"),
    [
        (0.07, 2.02, 1),
        (1.0, 2.02, 1),
        (1.93, 2.02, 1),
        (0.33, 0.0, -1),
        (1.0, 0.0, -1),
    ],
)
def test_turns_beyond_the_tile_meet_both_strokes(robot, x, y, sign):
    transitions = robot.transitions()
    start = MovingState.steady(np.array([x, y, 0.3]), sign * UP)
    step = 0.13 if x < 1.5 else -0.13
    end = MovingState.steady(np.array([x + step, y, 0.3]), -sign * UP)
    moves = transitions.connect(start, end)
    assert len(moves) == 1
    (turn,) = moves
    np.testing.assert_allclose(start_q(turn), transitions.ik.joint_states(start)[0].x)
    np.testing.assert_allclose(end_q(turn), transitions.ik.joint_states(end)[0].x)
    # The gun is square all along the turn: pitches and yaws add up to zero.
    q = turn.q(np.linspace(0.0, turn.duration, 100))
    np.testing.assert_allclose(q[:, 1:4].sum(axis=1), 0.0, atol=1e-6)
    np.testing.assert_allclose(q[:, 0] + q[:, 4], 0.0, atol=1e-6)


@pytest.mark.parametrize("box", [None, TALL])
def test_the_quickest_clear_move_is_taken(robot, box):
    """Finds every candidate by itself and compares durations."""
    transitions = robot.transitions(*([] if box is None else [box]))
    retracts = [0.0] if box is None else [0.0, 0.10]
    ways = ((0.87, -1.0), (1.0, 1.0), (1.07, 1.0), (1.16, -1.0))
    for x, way in ways if box is None else ((1.0, 1.0), (1.05, 1.0)):
        start = MovingState.steady(np.array([1.0, 0.65, 0.3]), UP)
        end = MovingState.steady(np.array([x, 1.25, 0.3]), way * UP)
        by_retract = []
        for retract in retracts:
            blends = [
                fastest_tool_blend(
                    start,
                    end,
                    ik=transitions.ik,
                    limits=transitions.limits,
                    retract=retract,
                    ramp_share=ramp_share,
                )
                for ramp_share in ((0.5, 0.35, 0.25, 0.15) if retract else (0.5,))
            ]
            moves = [blend for blend in blends if blend]
            if not retract:
                states = transitions.ik.joint_states(start, end)
                moves.append(fastest_joint_blend(*states, transitions.limits))
            by_retract.append(
                [move.duration for move in moves if transitions.clear(move)]
            )
        durations = next(durations for durations in by_retract if durations)
        for _ in range(2):  # Asked again it is the same.
            (move,) = transitions.connect(start, end)
            assert move.duration == min(durations)


def test_free_motion_goes_round_what_blocks_the_straight_way(robot):
    wall = ObstacleBox("rib", np.array([0.95, 0.0, 0.0]), np.array([1.05, 2.0, 0.40]))
    transitions = robot.transitions(wall)
    q0, q1 = transitions.ik.inverse_kinematics(
        np.array([[0.5, 1.0, 0.3], [1.5, 1.0, 0.3]])
    )
    legs = transitions.free_motion(q0, q1)
    assert len(legs) > 1
    np.testing.assert_allclose(start_q(legs[0]), q0)
    np.testing.assert_allclose(end_q(legs[-1]), q1)
    assert all(transitions.clear(leg) for leg in legs)


@pytest.mark.parametrize("height", [0.0, 0.12, 0.3, 0.40])
@pytest.mark.parametrize("y", [-0.1, 0.4, 1.0, 1.9])
def test_free_motion_is_the_quickest_of_all_clear_ways(robot, height, y):
    wall = ObstacleBox("rib", np.array([0.95, 0.0, 0.0]), np.array([1.05, 2.0, height]))
    transitions = robot.transitions(wall)
    q0, q1 = transitions.ik.inverse_kinematics(
        np.array([[0.5, y, 0.18], [1.5, y, 0.3]])
    )
    fold, unfold = (transitions.folded(float(q[0])) for q in (q0, q1))
    back, forth = (transitions.retreat(q) for q in (q0, q1))
    ways = [
        [
            rest_to_rest(a, b, transitions.limits)
            for a, b in itertools.pairwise([q0, *via, q1])
        ]
        for via in (
            [],
            [fold],
            [unfold],
            [fold, unfold],
            [back, forth],
            [back, fold, unfold],
            [fold, unfold, forth],
            [back, fold, unfold, forth],
        )
        if all(place is not None for place in via)
    ]
    assert len(ways) == 8
    durations = [
        sum(leg.duration for leg in way)
        for way in ways
        if all(transitions.clear(leg) for leg in way)
    ]
    found = transitions.free_motion(q0, q1)
    assert all(transitions.clear(leg) for leg in found)
    duration = sum(leg.duration for leg in found)
    if isinstance(found[0], ToolMove):
        # A retract, where the direct move is not clear, if that is quicker.
        assert not transitions.clear(ways[0][0])
        assert duration < min(durations)
    else:
        assert duration == min(durations)


@pytest.mark.parametrize("travel", [0.01, 0.5, 2.0])
def test_nothing_makes_a_way_quicker_than_rates_and_accelerations(robot, travel):
    transitions = robot.transitions()
    for q1 in transitions.q_home + travel * np.random.default_rng(0).normal(
        size=(20, 5)
    ):
        least = least_travel(transitions.q_home, q1, transitions.limits)
        real = rest_to_rest(transitions.q_home, q1, transitions.limits)
        assert least.duration <= real.duration


def test_gun_is_drawn_back_a_little_where_the_joints_straight_way_grazes(robot):
    """Low before the wall the arm swings through a chord's arc, a few mm into it."""
    transitions = robot.transitions()
    ends = np.array([[0.15, -0.10, 0.18], [1.13, -0.10, 0.15]])
    q0, q1 = transitions.ik.inverse_kinematics(ends)
    assert not transitions.clear(rest_to_rest(q0, q1, transitions.limits))
    (move,) = transitions.free_motion(q0, q1)
    assert transitions.clear(move)
    places = nozzle(transitions, move)
    np.testing.assert_allclose(places[[0, -1]], ends, atol=1e-6)
    assert 0.2 < places[:, 2].max() < 0.4
    assert move.duration < 2.5  # Folding and unfolding takes twice as long.


def test_no_way_out_of_a_collision(robot):
    transitions = robot.transitions(TALL)
    (inside,) = transitions.ik.inverse_kinematics(np.array([[1.0, 0.95, 0.3]]))
    with pytest.raises(CollisionError, match="free motion: .* at 0.00 s"):
        transitions.free_motion(inside, transitions.q_home)
