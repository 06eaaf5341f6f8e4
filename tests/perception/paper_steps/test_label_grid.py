"""The closest-to-mean rule on cells of a few points."""

import numpy as np
import pytest

from perception.paper_steps.label_grid import NOTHING, label_grid
from perception.values import TileSize


def one_cell(z, labels):
    """Grid of one 1 cm cell with points of the given depths and labels."""
    points = np.stack([np.full(len(z), 0.005), np.full(len(z), 0.005), z])
    return label_grid(points, np.array(labels), tile=TileSize(0.01, 0.01), cell=0.01)


def test_point_closest_to_the_mean_gives_label_and_depth():
    # Mean 0.034: 0.002 is 0.032 off, 0.0 is 0.034 off, 0.1 is 0.066 off.
    grid = one_cell([0.0, 0.002, 0.1], [1, 2, 3])
    assert grid.labels.item() == 2
    assert grid.depth.item() == 0.002


def test_majority_does_not_decide():
    # Mean 0.06: the one point of label 5 at 0.05 wins over two of label 1 at 0.
    grid = one_cell([0.0, 0.0, 0.05, 0.19], [1, 1, 5, 2])
    assert grid.labels.item() == 5


def test_of_two_equally_close_the_nearer_to_the_robot_counts():
    grid = one_cell([0.0, 0.25], [1, 2])
    assert grid.labels.item() == 2
    assert one_cell([0.25, 0.25], [4, 3]).labels.item() == 3


def test_cells_are_squares_with_row_0_at_the_bottom():
    x = [0.0, 0.0099, 0.0101, 0.029, 0.0301, -0.0001, 0.015]
    y = [0.0, 0.0099, 0.0, 0.019, 0.0, 0.0, 0.0201]
    points = np.array([x, y, np.zeros(7)])
    grid = label_grid(points, np.arange(1, 8), tile=TileSize(0.03, 0.02), cell=0.01)
    # Points 5 to 7 lie beside the tile; of points 1 and 2 the smaller label stays.
    np.testing.assert_array_equal(grid.labels, [[1, 3, NOTHING], [NOTHING, NOTHING, 4]])
    np.testing.assert_array_equal(np.isnan(grid.depth), grid.labels == NOTHING)


def test_order_of_points_does_not_matter():
    rng = np.random.default_rng(0)
    points = rng.uniform(0.0, [[0.2], [0.1], [0.3]], (3, 3000))
    labels = rng.integers(0, 5, 3000)
    order = rng.permutation(3000)
    size = {"tile": TileSize(0.2, 0.1), "cell": 0.01}
    one = label_grid(points, labels, **size)
    other = label_grid(points[:, order], labels[order], **size)
    np.testing.assert_array_equal(one.labels, other.labels)
    np.testing.assert_array_equal(one.depth, other.depth)


def test_no_points_give_an_empty_grid():
    grid = label_grid(
        np.zeros((3, 0)), np.zeros(0, dtype=int), tile=TileSize(0.02, 0.02), cell=0.01
    )
    assert (grid.labels == NOTHING).all()


def test_tile_smaller_than_a_cell_is_refused():
    with pytest.raises(ValueError, match="no cell of"):
        label_grid(
            np.zeros((3, 1)), np.zeros(1, int), tile=TileSize(0.001, 1), cell=0.01
        )


def test_points_behind_a_surface_are_hidden():
    # Cell 0: wall at 0 and 0.07 m behind it, something 1 m behind; cell 1: in the open.
    x = [0.005, 0.005, 0.005, 0.005, 0.015]
    z = [0.0, 0.0, -0.07, -1.0, -1.0]
    points, labels = np.array([x, [0.005] * 5, z]), np.array([1, 1, 2, 3, 3])
    size = {"tile": TileSize(0.02, 0.01), "cell": 0.01}
    grid = label_grid(points, labels, **size, hidden=0.08)
    np.testing.assert_array_equal(grid.labels, [[1, 3]])
    # With all points cell 0 has mean -0.2675, to which -0.07 is the closest.
    np.testing.assert_array_equal(label_grid(points, labels, **size).labels, [[2, 3]])
    # What is as deep as the bound is visible, and here closest to the mean.
    grid = label_grid(points[:, [0, 2, 2]], labels[[0, 2, 2]], **size, hidden=0.07)
    np.testing.assert_array_equal(grid.labels, [[2, NOTHING]])


@pytest.mark.parametrize("side", [0.0, -1.0, np.nan, np.inf])
def test_sides_of_a_tile_must_be_positive(side):
    with pytest.raises(ValueError, match=r"tile\.height must be > 0"):
        TileSize(1.0, side)
