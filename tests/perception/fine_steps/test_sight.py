"""Sight lines past a box, by similar triangles."""

import numpy as np

from perception.fine_steps.sight import seen_from

CELL = 0.01


def test_a_box_hides_what_similar_triangles_say():
    height = np.zeros((100, 200))
    height[40:60, 80:100] = 0.1  # x 0.8 to 1.0
    x = np.linspace(0.5, 0.795, 60)
    p_TQs = np.stack([x, np.full(60, 0.5)], axis=1)
    p_TCs = np.array([[1.5, 0.5, 0.7], [0.9, 0.5, 0.7], [0.4, 0.5, 0.7]])
    seen = seen_from(p_TCs, p_TQs, height, cell=CELL)
    # Over the edge at x = 0.8, z = 0.1 the ray from (1.5, 0.7) meets the wall at
    # 0.8 - 0.1 * 0.7 / 0.6; from 0.9 at 0.8 - 0.1 * 0.1 / 0.6.
    for eye, ends in ((0, 0.8 - 0.07 / 0.6), (1, 0.8 - 0.01 / 0.6), (2, 0.8)):
        clear = abs(x - ends) > CELL
        np.testing.assert_array_equal(seen[eye, clear], (x < ends)[clear])


def test_what_stands_aside_of_the_sight_line_hides_nothing():
    height = np.zeros((100, 100))
    height[40:60, 40:60] = 0.1
    p_TQs = np.array([[0.3, 0.7], [0.5, 0.65], [0.5, 0.35]])
    p_TC = np.array([[0.5, 1.2, 0.7]])
    assert seen_from(p_TC, p_TQs, height, cell=CELL).tolist() == [[True, True, False]]
