"""The tile's frame against the floor plan: W x to the wall, T x right, y up, z back."""

import numpy as np
import pytest

from painter.planning.config import TileConfig
from painter.planning.tile import (
    cell_centres,
    grid_points,
    grid_shape,
    nominal_tile_pose,
)

TILE = TileConfig(width=2.0, height=1.8, bottom=0.2, distance=1.05)


def test_corners_of_the_tile_stand_where_the_floor_plan_says():
    X_WT = nominal_tile_pose(TILE)
    p_TQs = np.array([[0, 0, 0], [2.0, 0, 0], [2.0, 1.8, 0], [0, 0, 0.3]]).T
    p_WQs = [[1.05, 1.0, 0.2], [1.05, -1.0, 0.2], [1.05, -1.0, 2.0], [0.75, 1.0, 0.2]]
    np.testing.assert_allclose((X_WT @ p_TQs).T, p_WQs, atol=1e-15)
    assert X_WT.rotation().IsValid()


def test_cells_fill_the_tile_from_its_corner():
    shape = grid_shape(TILE, 0.01)
    assert shape == (180, 200)
    x, y = cell_centres(shape, 0.01)
    assert x[0] == pytest.approx(0.005) and x[-1] == pytest.approx(1.995)
    assert y[0] == pytest.approx(0.005) and y[-1] == pytest.approx(1.795)


def test_margin_moves_the_first_cell_outside_the_tile():
    x, y = cell_centres((4, 5), 0.1, margin=0.2)
    np.testing.assert_allclose(x, [-0.15, -0.05, 0.05, 0.15, 0.25])
    np.testing.assert_allclose(y, [-0.15, -0.05, 0.05, 0.15])


def test_points_run_row_by_row_from_the_bottom():
    z = np.arange(6.0).reshape(2, 3)
    p_TQs = grid_points(np.array([1.0, 2.0, 3.0]), np.array([5.0, 6.0]), z)
    np.testing.assert_array_equal(p_TQs[0], [1, 2, 3, 1, 2, 3])
    np.testing.assert_array_equal(p_TQs[1], [5, 5, 5, 6, 6, 6])
    np.testing.assert_array_equal(p_TQs[2], np.arange(6))
