"""Votes at the centres of cells: straight edges, and who is heard."""

import numpy as np
import pytest

from perception.fine_steps.votes import Votes, wall_share

CELL = 0.01
SHAPE = (20, 20)


def votes(edge, *, spacing, slope=0.0):
    """Points on an even lattice, wall where x < edge + slope y."""
    axis = np.arange(spacing / 2, 0.2, spacing)
    points = np.stack([part.ravel() for part in np.meshgrid(axis, axis)])
    wall = points[0] < edge + slope * points[1]
    return Votes(p_TQs=points, wall=wall, weight=np.ones(wall.size))


@pytest.mark.parametrize("spacing", [0.002, 0.004])
@pytest.mark.parametrize("edge", [0.096, 0.104, 0.1])
def test_cell_is_wall_if_its_centre_lies_on_the_side_of_wall(edge, spacing):
    # The lattice has points at half the spacing before and behind each edge.
    share = wall_share(votes(edge, spacing=spacing), SHAPE, cell=CELL, spacing=spacing)
    centres = (np.arange(20) + 0.5) * CELL
    np.testing.assert_array_equal(share[3:-3] > 0.5, np.tile(centres < edge, (14, 1)))


def test_slanted_edge_is_unbiased():
    share = wall_share(
        votes(0.06, spacing=0.004, slope=0.4), SHAPE, cell=CELL, spacing=0.004
    )
    y, x = (np.indices(SHAPE) + 0.5) * CELL
    beyond = (x - 0.06 - 0.4 * y) / np.hypot(1.0, 0.4)
    inner = (slice(2, -2),) * 2
    assert (share[inner][beyond[inner] < -0.001] > 0.5).all()
    assert (share[inner][beyond[inner] > 0.001] < 0.5).all()


def test_share_follows_the_normal_curve_across_an_edge():
    # A Gaussian of the spacing's width, cut by an edge d away: Phi(d / spacing).
    spacing = 0.0025
    share = wall_share(votes(0.1, spacing=spacing), SHAPE, cell=CELL, spacing=spacing)
    assert share[10, 9] == pytest.approx(0.977, abs=0.015)  # d = 5 mm: Phi(2).
    assert share[10, 10] == pytest.approx(0.023, abs=0.015)


def test_where_no_point_is_near_nothing_is_wall():
    points = np.array([[0.02], [0.02]])
    lone = Votes(p_TQs=points, wall=np.ones(1, dtype=bool), weight=np.ones(1))
    share = wall_share(lone, SHAPE, cell=CELL, spacing=0.004)
    assert share[1, 1] == 1.0
    assert share[10, 10] == 0.0


def test_stacked_points_count_no_more_than_their_weight():
    # Ten points of a window's reveal, one behind the other, against one of the wall.
    points = np.array([[0.05] * 10 + [0.051], [0.05] * 11])
    wall = np.arange(11) == 10
    stacked = Votes(p_TQs=points, wall=wall, weight=np.where(wall, 1.0, 0.1))
    share = wall_share(stacked, SHAPE, cell=CELL, spacing=0.005)
    assert share[5, 5] == pytest.approx(0.5, abs=0.05)
