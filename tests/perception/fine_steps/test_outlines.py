"""Straight outlines: rectangles get their sides, other shapes are left alone."""

import numpy as np
import pytest

from perception.fine_steps.outlines import straighten
from perception.fine_steps.votes import Votes

CELL = 0.01
N = 40


def scene(is_off, *, spacing=0.004, seed=0, turn_deg=0.0):
    """Votes of jittered points, and the truth at the cells' centres."""
    rng = np.random.default_rng(seed)
    axis = np.arange(0.0, N * CELL - spacing / 2, spacing)
    points = np.stack([part.ravel() for part in np.meshgrid(axis, axis)])
    points = points + rng.uniform(0.0, spacing, points.shape)
    points = np.minimum(points, N * CELL * (1.0 - 1e-9))
    y, x = (np.indices((N, N)) + 0.5) * CELL
    off = is_off(*points)
    votes = Votes(p_TQs=points, wall=~off, weight=np.ones(off.size))
    return votes, ~is_off(x, y)


def box(left, right, low, high, turn_deg=0.0):
    angle = np.deg2rad(turn_deg)

    def is_off(x, y):
        dx, dy = x - (left + right) / 2, y - (low + high) / 2
        u = np.cos(angle) * dx + np.sin(angle) * dy
        v = np.cos(angle) * dy - np.sin(angle) * dx
        return (np.abs(u) < (right - left) / 2) & (np.abs(v) < (high - low) / 2)

    return is_off


def spoil(truth):
    """Rounds the corners off and frays the sides, as votes of single cells do."""
    level = truth.copy()
    rows, columns = np.nonzero(~truth)
    for row in (rows.min(), rows.max()):
        for column in (columns.min(), columns.max()):
            level[row, column] = True
    level[rows.min() - 1, columns.min() + 3 : columns.min() + 6] = False
    level[rows.min() + 4 : rows.min() + 7, columns.max()] = True
    return level


@pytest.mark.parametrize(
    "sides",
    [(0.1, 0.3, 0.12, 0.27), (0.103, 0.298, 0.112, 0.277), (0.1, 0.2, 0.1, 0.2)],
)
def test_corners_and_sides_come_back(sides):
    votes, truth = scene(box(*sides))
    level = spoil(truth)
    assert (level != truth).sum() >= 10
    assert (straighten(level, votes, cell=CELL) != truth).sum() == 0


@pytest.mark.parametrize("turn", [0.8, -1.7])
def test_turned_rectangles_are_followed(turn):
    # 0.8 deg over half of 30 cm is 2 mm: rows of cells change along a side.
    votes, truth = scene(box(0.05, 0.35, 0.1, 0.3, turn), spacing=0.0025)
    result = straighten(spoil(truth), votes, cell=CELL)
    # Cells whose centres lie within half a millimetre of a side may be either.
    sure = np.ones_like(truth)
    for grow in (-0.0005, 0.0005):
        size = (0.05 - grow, 0.35 + grow, 0.1 - grow, 0.3 + grow)
        sure &= scene(box(*size, turn))[1] == truth
    assert (result == truth)[sure].all()


def test_no_cell_farther_than_one_from_a_side_changes():
    votes, truth = scene(box(0.1, 0.3, 0.12, 0.27))
    level = spoil(truth)
    level[18:20, 18:20] = True  # A hole in the middle is none of the outline's.
    assert straighten(level, votes, cell=CELL)[18:20, 18:20].all()


def test_disc_stays_round():
    def disc(x, y):
        return np.hypot(x - 0.2, y - 0.2) < 0.08

    votes, truth = scene(disc)
    np.testing.assert_array_equal(straighten(truth, votes, cell=CELL), truth)


def test_specks_stay_as_they_are():
    votes, truth = scene(box(0.1, 0.12, 0.1, 0.12))
    np.testing.assert_array_equal(straighten(truth, votes, cell=CELL), truth)


def test_gap_without_points_is_shared_by_both_sides():
    # Nothing is known from 6 mm outside to 8 mm inside: the side is drawn at 1 mm.
    inner, outer = box(0.108, 0.292, 0.128, 0.262), box(0.094, 0.306, 0.114, 0.276)
    votes, _ = scene(inner, spacing=0.002)
    kept = ~outer(*votes.p_TQs) | inner(*votes.p_TQs)
    votes = Votes(
        p_TQs=votes.p_TQs[:, kept], wall=votes.wall[kept], weight=votes.weight[kept]
    )
    truth = scene(box(0.101, 0.299, 0.121, 0.269))[1]
    result = straighten(spoil(truth), votes, cell=CELL)
    np.testing.assert_array_equal(result, truth)
