"""How near to the wall the arm can spray: shoulder, wrist and the length between."""

import numpy as np

from painter.planning.config import TileConfig
from painter.planning.motion.gun_path import WallIk
from painter.planning.motion.reach import nearest_standoffs, wrist_distances
from painter.planning.tile import nominal_tile_pose

X = np.linspace(0.0, 2.0, 41)
RUN_OUT = 0.10  # m beyond a stroke's end.


def test_strokes_start_farther_off_where_the_arm_would_have_to_stretch(robot):
    ik = WallIk(robot.kinematics, nominal_tile_pose(TileConfig()))
    dut = nearest_standoffs(
        X, X, ik=ik, limits=robot.limits, near=0.06, far=0.315, stopping=0.10
    )
    assert dut.shape == (41, 41)
    # In the middle the arm is bent; in the corners it cannot come near.
    assert dut[15:26].max() == 0.06
    assert min(dut[0, 0], dut[0, -1], dut[-1, 0], dut[-1, -1]) >= 0.15
    longest = robot.kinematics.upper_arm + robot.kinematics.forearm
    xs, ys = np.meshgrid(X, X)
    beyond = ys + np.where(ys < 1.0, -RUN_OUT, RUN_OUT)

    def needed(standoff):
        places = np.stack([xs, beyond, np.broadcast_to(standoff, xs.shape)], axis=-1)
        return wrist_distances(places.reshape(-1, 3), ik).reshape(xs.shape)

    # One step of the stand-offs that are tried, 15 mm, is what it may be off.
    reached = dut < 0.315
    assert (needed(dut)[reached] <= longest).all()
    assert (needed(dut - 0.016)[dut > 0.08] > longest).all()
