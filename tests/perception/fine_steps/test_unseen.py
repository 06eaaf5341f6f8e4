"""Reasons of holes, drawn by hand."""

import numpy as np

from perception.fine_steps.unseen import Reason, close_gaps, explain

CELL = 0.01


def explained(reason, residual, hole, **settings):
    residual = np.where(hole, np.nan, residual)
    return explain(reason, residual, hole, cell=CELL, **settings)


def test_a_hole_beside_something_raised_is_its_shadow_and_farther_off_unseen():
    reason = np.zeros((60, 60), dtype=np.int64)
    residual = np.zeros(reason.shape)
    reason[20:30, 20:30], residual[20:30, 20:30] = Reason.RAISED, 0.04
    hole = np.zeros(reason.shape, dtype=bool)
    hole[20:30, 15:20] = True  # 5 cm wide beside something 4 cm high
    hole[50:55, 50:55] = True
    result = explained(reason, residual, hole)
    assert (result[20:30, 15:20] == Reason.SHADOW).all()
    assert (result[50:55, 50:55] == Reason.UNSEEN).all()


def test_a_pane_beside_a_box_is_told_from_its_shadow_by_where_the_pictures_were_taken():
    reason = np.zeros((100, 100), dtype=np.int64)
    residual = np.zeros(reason.shape)
    reason[40:60, 40:60], residual[40:60, 40:60] = Reason.RAISED, 0.1
    hole = np.zeros(reason.shape, dtype=bool)
    hole[40:60, 20:38] = True  # 20 x 18 cm to the left of it

    def seen_from_x(x):
        return explained(
            reason, residual, hole, p_TCs=np.tile([[x], [0.5], [0.7]], 10)
        )[40:60, 20:38]

    # From x = 0.58 the box, its edge at x = 0.4, hides 0.1 * 0.18 / 0.6 = 3 cm of wall.
    near = seen_from_x(0.58)
    assert (near[:, -1] == Reason.SHADOW).all()
    assert (near[:, 3:-2] == Reason.GLASS).all()
    # From the left it hides nothing; from afar on the right as much as its height may.
    assert (seen_from_x(0.2) == Reason.GLASS).all()
    assert (seen_from_x(1.2)[:, 3:] == Reason.SHADOW).all()


def test_holes_in_a_frame_and_large_rectangles_are_glass():
    reason = np.zeros((80, 80), dtype=np.int64)
    residual = np.zeros(reason.shape)
    reason[10:30, 10:30], residual[10:30, 10:30] = Reason.RECESSED, -0.1
    hole = np.zeros(reason.shape, dtype=bool)
    hole[15:20, 15:25] = True  # In a frame
    hole[50:70, 10:30] = True  # 20 x 20 cm, flush with the wall
    hole[60:63, 50:80] = True  # 90 cm²
    result = explained(reason, residual, hole)
    assert (result[15:20, 15:25] == Reason.GLASS).all()
    assert (result[50:70, 10:30] == Reason.GLASS).all()
    assert (result[60:63, 50:80] == Reason.UNSEEN).all()


def test_what_lies_far_behind_is_seen_through_glass():
    reason = np.full((5, 5), int(Reason.RECESSED))
    residual = np.full((5, 5), -0.1)
    residual[2, 2] = -2.0
    result = explained(reason, residual, np.zeros((5, 5), dtype=bool))
    assert result[2, 2] == Reason.GLASS
    assert np.count_nonzero(result == Reason.RECESSED) == 24


def test_gaps_of_two_cells_are_closed_and_holes_of_three_are_not():
    seen = np.ones((40, 40), dtype=bool)
    seen[5:7, 5:7] = False
    seen[20:22, :] = False
    seen[30:33, 30:33] = False
    gaps = close_gaps(seen, spacing=0.003, cell=CELL)
    assert gaps[5:7, 5:7].all()
    assert gaps[20:22].all()
    assert not gaps[30:33, 30:33].any()
    # Of points 15 mm apart a cell in two is empty by chance.
    assert close_gaps(seen, spacing=0.015, cell=CELL)[30:33, 30:33].all()
