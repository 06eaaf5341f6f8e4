"""The least stand-offs beside what stands out, against the collision checker."""

import numpy as np

from painter.planning.clearance.obstacles import ObstacleBox
from painter.planning.clearance.tool_shape import standoffs_beside, tool_boxes
from painter.planning.config import MotionConfig, TileConfig
from painter.planning.motion.gun_path import WallIk
from painter.planning.tile import nominal_tile_pose

BOX = ObstacleBox("box", np.array([0.9, 0.9, 0.0]), np.array([1.1, 1.0, 0.15]))
STEP = 0.01
AXIS = np.arange(0.6 + STEP / 2, 1.4, STEP)
CLEARANCE = MotionConfig().clearance
BEYOND, AWAY = 0.10, 0.03


def least_standoffs(robot, *run_out):
    return standoffs_beside(
        AXIS,
        AXIS,
        obstacles=[BOX],
        tool=tool_boxes(robot.checker),
        clearance=CLEARANCE,
        run_out=run_out,
    )


def free(robot, x, y, standoff):
    ik = WallIk(robot.kinematics, nominal_tile_pose(TileConfig()))
    places = np.stack(np.broadcast_arrays(*np.atleast_1d(x, y, standoff)), axis=-1)
    return robot.transitions(BOX).space.free(ik.inverse_kinematics(places))


def test_gun_and_camera_keep_clear_from_there_on_and_not_from_nearer(robot):
    dut = np.maximum(least_standoffs(robot), CLEARANCE + 0.02)
    rng = np.random.default_rng(1)
    rows, columns = rng.integers(0, AXIS.size, (2, 300))
    # Anywhere in a cell.
    x, y = AXIS[[columns, rows]] + rng.uniform(-STEP / 2, STEP / 2, (2, 300))
    assert free(robot, x, y, dut[rows, columns]).all()
    # Over the middle of the box the nozzle is the lowest; to its lower right it is the
    # camera, which lies above and mostly to the right of the gun, 71 mm behind it.
    for spot, reason in (((1.0, 0.95), 0.0), ((0.98, 0.81), 0.071)):
        least = dut[tuple(np.searchsorted(AXIS, spot[::-1]))]
        assert abs(least - (0.15 + CLEARANCE - reason)) < 1e-6
        assert not free(robot, *spot, least - 0.005).any()


def test_there_is_room_to_stop_wherever_a_stroke_ends(robot):
    at_rest, dut = least_standoffs(robot), least_standoffs(robot, (BEYOND, AWAY))
    cells = round(BEYOND / STEP)
    for shifted in (at_rest[2 * cells :], at_rest[: -2 * cells]):
        assert (dut[cells:-cells] >= shifted - AWAY - 1e-9).all()
    assert (dut >= at_rest).all()


def test_far_from_everything_nothing_is_asked(robot):
    assert least_standoffs(robot)[:, 0].max() == -np.inf
