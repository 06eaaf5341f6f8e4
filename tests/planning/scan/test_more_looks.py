"""More looks show what the scan left in shadow; without shadows there are none."""

import numpy as np
import pytest

from painter.planning.config import MotionConfig, ScanConfig, TileConfig
from painter.planning.scan.free_motion import FreeMotionPlanner
from painter.planning.scan.more_looks import more_look_poses, more_looks
from painter.planning.tile import nominal_tile_pose
from perception.fine_steps.shadows import Relief

SCAN = ScanConfig()
TOP = 0.15  # m, height of the boxes.
# Where the zig-zag ends: before the lower right quarter.
END_T = np.array([[1.4, 0.4, 0.5]])


def make_relief(*boxes):
    """A 2 x 2 m tile with boxes (x0, x1, y0, y1), m, and shadows (...) beside them."""
    height, hidden = np.zeros((200, 200)), np.zeros((200, 200), dtype=bool)
    for box, shadow in boxes:
        for grid, place, value in ((height, box, TOP), (hidden, shadow, True)):
            x0, x1, y0, y1 = (round(100 * edge) for edge in place)
            grid[y0:y1, x0:x1] = value
    return Relief(height=height, hidden=hidden, cell=0.01)


LEFT = ((0.2, 0.4, 0.9, 1.1), (0.12, 0.2, 0.9, 1.1))
RIGHT = ((1.6, 1.8, 0.9, 1.1), (1.8, 1.88, 0.9, 1.1))
UNDER = ((0.9, 1.1, 0.2, 0.4), (0.9, 1.1, 0.14, 0.2))
OVER = ((0.9, 1.1, 1.7, 1.8), (0.9, 1.1, 1.8, 1.86))


@pytest.mark.parametrize("beside", [LEFT, RIGHT, UNDER, OVER])
def test_one_look_shows_all_wall_beside_a_box_to_both_imagers(robot, beside):
    poses = robot.camera_poses()
    (q0,) = poses.transitions.ik.inverse_kinematics(END_T)
    q = more_look_poses(q0, make_relief(beside), SCAN, poses)
    assert len(q) == 1
    R_WC, p_WC = robot.kinematics.camera_poses(q)
    X_TW = nominal_tile_pose(TileConfig()).inverse()
    x0, x1, y0, y1 = beside[1]
    corners = np.array([[x, y, 0.0] for x in (x0, x1) for y in (y0, y1)])
    inward = 0.005 * np.sign(np.mean(corners, axis=0) - corners)
    centres = corners + inward
    box = beside[0]
    for imager in (0.0, 0.05):  # Along C's x.
        p_TC = X_TW @ (p_WC[0] + R_WC[0] @ [imager, 0.0, 0.0])
        for p_TQ in centres:
            ray = R_WC[0].T @ (X_TW.inverse().rotation() @ (p_TQ - p_TC))
            assert abs(ray[0] / ray[2]) < np.tan(np.deg2rad(43.5))
            assert abs(ray[1] / ray[2]) < 480 / 848 * np.tan(np.deg2rad(43.5))
            # The sight line passes beside the box as long as it is lower than the box.
            low = p_TQ + np.linspace(0.0, TOP / p_TC[2], 50)[:, None] * (p_TC - p_TQ)
            # The last cell beside an edge may be missed by rounding.
            inside = (low[:, 0] > box[0] + 0.006) & (low[:, 0] < box[1] - 0.006)
            inside &= (low[:, 1] > box[2] + 0.006) & (low[:, 1] < box[3] - 0.006)
            assert not inside.any()


def test_two_shadows_that_no_place_shows_together_take_two_looks(robot):
    poses = robot.camera_poses()
    (q0,) = poses.transitions.ik.inverse_kinematics(END_T)
    relief = make_relief(LEFT, RIGHT)
    assert len(more_look_poses(q0, relief, SCAN, poses)) == 2
    path = more_looks(q0, relief, SCAN, poses)
    still = [piece for piece in path if np.ptp(piece.q(piece.knots), axis=0).max() == 0]
    assert [piece.duration for piece in still] == [SCAN.more_look_time] * 2
    # From the lower right, the right one comes first.
    first, last = (robot.kinematics.camera_poses(p.q(np.zeros(1)))[1][0] for p in still)
    assert first[1] < last[1]  # W y is to the left.
    one = ScanConfig(more_looks=1)
    assert len(more_look_poses(q0, relief, one, poses)) == 1


def test_there_are_no_looks_for_nothing(robot):
    poses = robot.camera_poses()
    (q0,) = poses.transitions.ik.inverse_kinematics(END_T)
    assert more_looks(q0, make_relief(), SCAN, poses) == []
    tiny = (LEFT[0], (0.18, 0.2, 1.0, 1.02))  # 4 cm²
    assert more_looks(q0, make_relief(tiny), SCAN, poses) == []
    none = ScanConfig(more_looks=0)
    assert more_looks(q0, make_relief(LEFT), none, poses) == []


def test_the_arm_keeps_clear_of_what_the_scan_has_found(robot):
    tile = TileConfig()
    (q0,) = robot.transitions().ik.inverse_kinematics(END_T)
    X_WT = nominal_tile_pose(tile)
    dut = FreeMotionPlanner(
        **vars(robot),
        tile=tile,
        scan=SCAN,
        motion=MotionConfig(),
        camera=robot.camera(),
    )
    motion = dut.more_looks(q0, make_relief(LEFT, UNDER), X_WT)
    _, p_WGs = robot.kinematics.gun_poses(motion.q)
    assert p_WGs[:, 0].max() <= 1.05 - TOP - MotionConfig().clearance
    np.testing.assert_allclose(motion.q[0], q0)
    assert abs(motion.v[-1]).max() < 1e-9
    # The gun stands half a metre off the wall: there is no room for a thing as high.
    high = make_relief(LEFT)
    high = Relief(height=4.0 * high.height, hidden=high.hidden, cell=high.cell)
    assert dut.more_looks(q0, high, X_WT) is None
    assert dut.more_looks(q0, make_relief(), X_WT) is None
