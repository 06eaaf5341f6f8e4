"""Boxes cover what stands out of the wall; clearances are kept from them."""

import numpy as np
import pytest

from painter.errors import CollisionError
from painter.planning.clearance.obstacles import (
    ClearSpace,
    ObstacleBox,
    segmentation_boxes,
    wall_box,
)
from painter.planning.config import TileConfig
from painter.planning.tile import nominal_tile_pose


def test_box_on_the_wall_becomes_that_box(make_wall):
    wall, box = segmentation_boxes(make_wall((slice(30, 45), slice(20, 40), 0.12)))
    np.testing.assert_allclose(box.lower, [0.2, 0.3, 0.0])
    np.testing.assert_allclose(box.upper, [0.4, 0.45, 0.12], atol=1e-6)
    assert wall.name == "wall"
    assert wall.upper[2] == 0.0


def test_recesses_unevenness_and_the_unseen_are_no_obstacles(make_wall):
    segmentation = make_wall(
        (slice(0, 20), slice(0, 20), -0.1),
        (slice(50, 60), slice(0, 20), 0.008),
        (slice(90, 99), slice(0, 20), np.nan),
    )
    assert len(segmentation_boxes(segmentation)) == 1


def test_frame_is_covered_without_filling_what_it_encloses(make_wall):
    wall = make_wall((slice(50, 150), slice(50, 150), 0.05))
    depth = np.array(wall.depth)
    depth[55:145, 55:145] = -0.1
    boxes = segmentation_boxes(wall.replace(depth=depth))[1:]
    covered = np.zeros((200, 200), dtype=bool)
    for box in boxes:
        (c0, r0), (c1, r1) = (
            np.round(corner[:2] / 0.01).astype(int) for corner in (box.lower, box.upper)
        )
        covered[r0:r1, c0:c1] = True
    assert covered[depth > 0.01].all()
    assert not covered[80:120, 80:120].any()


@pytest.mark.parametrize(("gap", "free"), [(0.045, True), (0.035, False)])
def test_clearance_from_a_box_is_the_one_asked_for(robot, gap, free):
    # The nozzle is the foremost point of the arm: 0.3 m before the wall.
    box = ObstacleBox("box", np.array([0.9, 0.9, 0.0]), np.array([1.1, 1.1, 0.3 - gap]))
    transitions = robot.transitions(box)
    q = transitions.ik.inverse_kinematics(np.array([[1.0, 1.0, 0.3]]))
    assert transitions.space.free(q).tolist() == [free]


def test_boxes_of_one_wall_do_not_stay_for_the_next(robot):
    q = robot.transitions().ik.inverse_kinematics(np.array([[1.0, 1.0, 0.3]]))
    box = ObstacleBox("box", np.array([0.9, 0.9, 0.0]), np.array([1.1, 1.1, 0.35]))
    assert not robot.transitions(box).space.all_free(q)
    assert robot.transitions().space.all_free(q)


def test_collision_names_motion_time_and_bodies(robot):
    space = ClearSpace(
        robot.checker,
        X_WT=nominal_tile_pose(TileConfig()),
        boxes=[wall_box(2.0, 2.0, keepout=0.4)],
        clearance=0.04,
        floor_clearance=0.01,
    )
    q = robot.transitions().ik.inverse_kinematics(
        np.array([[1.0, 1.0, 0.6], [1.0, 1.0, 0.3]])
    )
    with pytest.raises(CollisionError, match=r"test: gun and surroundings.* 2\.50 s"):
        space.require(q, np.array([1.0, 2.5]), what="test")


@pytest.mark.parametrize("where", [0, 7, 8, 17, 24])
def test_one_blocked_place_among_many_is_found_wherever_it_is(robot, where):
    """The gun passes a post before it at one of 41 places alone."""
    y = np.linspace(0.6, 1.4, 41)
    post = ObstacleBox(
        "post",
        np.array([0.99, y[where] - 0.005, 0.0]),
        np.array([1.01, y[where] + 0.005, 0.27]),
    )
    transitions = robot.transitions(post)
    heights = np.full(41, 0.5)
    heights[where] = 0.3
    q = transitions.ik.inverse_kinematics(np.column_stack([np.ones(41), y, heights]))
    time = np.linspace(0.0, 4.0, 41)
    others = np.arange(41) != where
    assert transitions.space.all_free(q[others])
    assert not transitions.space.all_free(q)
    transitions.space.require(q[others], time[others], what="test")
    with pytest.raises(CollisionError, match=f"at {time[where]:.2f} s"):
        transitions.space.require(q, time, what="test")
