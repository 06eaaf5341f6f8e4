"""Outlines of openings against the rectangles and corners that they were drawn from."""

import numpy as np
import pytest

from perception.fine_steps.openings import find_openings, fit_rectangle, trace_contour
from perception.fine_steps.unseen import Reason

CELL = 0.01


def turned(turn_deg, *, size=(0.8, 0.6), centre=(1.0, 1.0)):
    """Cells whose centres lie in a rectangle turned about its centre."""
    x, y = np.meshgrid(*[(np.arange(200) + 0.5) * CELL] * 2)
    c, s = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    x, y = x - centre[0], y - centre[1]
    return (abs(c * x + s * y) < size[0] / 2) & (abs(c * y - s * x) < size[1] / 2)


@pytest.mark.parametrize("turn_deg", [0.0, 1.0, -2.0])
def test_rectangle_is_found_with_its_turn(turn_deg):
    corners, inside, fit = fit_rectangle(turned(turn_deg), CELL)
    c, s = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    box = np.array([[-0.4, 0.4, 0.4, -0.4], [-0.3, -0.3, 0.3, 0.3]])
    expected = np.array([[c, -s], [s, c]]) @ box + 1.0
    # Half a degree of turn over 0.5 m is 4 mm, and a cell's edge another 5 mm.
    np.testing.assert_allclose(corners, expected, atol=0.012)
    assert fit > 0.97
    assert np.count_nonzero(inside) * CELL**2 == pytest.approx(0.48, rel=0.03)


def test_window_with_a_pane_is_one_rectangle_and_an_arch_a_contour():
    reason = np.zeros((200, 200), dtype=np.int64)
    reason[20:80, 20:70] = Reason.RECESSED
    reason[26:74, 26:64] = Reason.GLASS
    y, x = np.mgrid[:200, :200]
    reason[(x - 140) ** 2 + (y - 100) ** 2 < 30**2] = Reason.RECESSED
    residual = np.where(reason == Reason.RECESSED, -0.1, 0.0)
    window, round_one = find_openings(reason, residual, cell=CELL)
    assert window.kind == "rectangle"
    corners = [[0.2, 0.7, 0.7, 0.2], [0.2, 0.2, 0.8, 0.8]]
    np.testing.assert_allclose(window.p_TVs, corners, atol=1e-6)
    assert window.area == pytest.approx(0.30)
    assert window.depth == pytest.approx(-0.1)
    assert window.glass_share == pytest.approx(48 * 38 / 3000)
    assert round_one.kind == "contour"
    x, y = round_one.p_TVs
    area = 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))
    assert area == pytest.approx(round_one.area)  # Counter-clockwise: > 0.


def test_contour_of_two_squares_that_touch_at_a_corner_holds_both():
    region = np.zeros((6, 6), dtype=bool)
    region[1:3, 1:3] = region[3:5, 3:5] = True
    x, y = trace_contour(region, 1.0)
    assert 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) == 8.0
    assert len(x) == 8
