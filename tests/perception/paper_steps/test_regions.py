"""Splitting, inheriting and sorting on small grids drawn by hand."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from perception.paper_steps.label_grid import NOTHING, LabelGrid
from perception.paper_steps.regions import (
    absorb_tiny_regions,
    adjacent_regions,
    drop_specks,
    euclidean_clusters,
    join_fragments,
    sort_by_area,
)

CELL = 0.01


def make_grid(labels, depth=0.0):
    """Grid of 1 cm cells; label -1 = nothing seen."""
    labels = np.array(labels)
    depth = np.where(labels == NOTHING, np.nan, np.broadcast_to(depth, labels.shape))
    return LabelGrid(labels, depth, CELL)


@pytest.mark.parametrize(("gap", "clusters"), [(7, 1), (8, 2)])
def test_gap_in_the_plane_splits_beyond_the_tolerance(gap, clusters):
    # `gap` empty cells: centres are gap + 1 cells apart, 8 cm for 7.
    grid = make_grid([[1] + [NOTHING] * gap + [1]])
    found = euclidean_clusters(grid, tolerance=0.08)
    assert found.max() + 1 == clusters
    np.testing.assert_array_equal(found[0, 1:-1], -1)


@pytest.mark.parametrize(("step", "clusters"), [(0.079, 1), (0.0795, 2)])
def test_depth_counts_in_the_distance(step, clusters):
    # Neighbours 1 cm apart: sqrt(0.08^2 - 0.01^2) = 0.07937 m of depth join.
    grid = make_grid([[1, 1]], depth=[[0.0, step]])
    assert euclidean_clusters(grid, tolerance=0.08).max() + 1 == clusters


def test_labels_never_share_a_cluster():
    grid = make_grid([[1, 2, 1]])
    np.testing.assert_array_equal(euclidean_clusters(grid, tolerance=0.08), [[0, 1, 0]])


@pytest.mark.parametrize("seed", range(4))
def test_clusters_are_those_of_a_tree_search(seed):
    rng = np.random.default_rng(seed)
    labels = np.where(
        rng.random((40, 50)) < 0.06, rng.integers(1, 3, (40, 50)), NOTHING
    )
    grid = make_grid(labels, rng.uniform(0.0, 0.12, labels.shape))
    found = euclidean_clusters(grid, tolerance=0.08)
    rows, columns = np.nonzero(labels != NOTHING)
    points = np.stack([columns * CELL, rows * CELL, grid.depth[rows, columns]], axis=1)
    tags, mine = labels[rows, columns], found[rows, columns]
    # Flood along the pairs that the tree finds, one label at a time.
    theirs = np.arange(len(points))
    pairs = cKDTree(points).query_pairs(0.08, output_type="ndarray")
    pairs = pairs[tags[pairs[:, 0]] == tags[pairs[:, 1]]]
    for _ in range(len(points)):
        low = theirs.copy()
        np.minimum.at(low, pairs[:, 0], theirs[pairs[:, 1]])
        np.minimum.at(low, pairs[:, 1], theirs[pairs[:, 0]])
        if (low == theirs).all():
            break
        theirs = low
    same_mine = mine[:, None] == mine[None, :]
    same_theirs = theirs[:, None] == theirs[None, :]
    np.testing.assert_array_equal(same_mine, same_theirs)


def test_parts_that_do_not_touch_become_regions():
    # One cluster, two parts; diagonal neighbours touch.
    clusters = np.array([[0, 1, 0, 0], [0, 1, 1, 0], [1, 1, 0, -1]])
    np.testing.assert_array_equal(
        adjacent_regions(clusters), [[0, 1, 2, 2], [0, 1, 1, 2], [1, 1, 2, 3]]
    )


def test_wrapping_round_the_edge_does_not_touch():
    clusters = np.array([[0, 1, 1], [1, 1, 0]])
    np.testing.assert_array_equal(adjacent_regions(clusters), [[0, 1, 1], [1, 1, 2]])


def drawn(*patches):
    """A 30 x 30 region 0 with patches (rows, columns) of one-cell regions."""
    regions = np.zeros((30, 30), dtype=int)
    number = 1
    for rows, columns in patches:
        for row in range(*rows):
            for column in range(*columns):
                regions[row, column] = number
                number += 1
    return regions


def test_large_patch_of_fragments_becomes_one_region():
    regions = drawn(((5, 13), (5, 13)))  # 64 cells.
    joined = join_fragments(regions, min_area=0.005, cell=CELL)
    assert np.unique(joined[5:13, 5:13]).size == 1
    assert (joined == 0).sum() == 900 - 64


def test_small_patch_and_thin_line_of_fragments_stay_fragments():
    regions = drawn(((5, 12), (5, 12)), ((20, 22), (0, 30)))  # 49 cells; 60, two wide.
    joined = join_fragments(regions, min_area=0.005, cell=CELL)
    np.testing.assert_array_equal(joined, regions)


def test_tiny_regions_inherit_from_the_nearest_large_cell():
    regions = np.zeros((20, 20), dtype=int)  # Region 0 left, 1 right of column 10.
    regions[:, 10:] = 1
    regions[5:10, 6:14] = 2  # 40 cells across the border of both.
    absorbed = absorb_tiny_regions(
        regions, np.ones((20, 20), bool), min_area=0.005, cell=CELL
    )
    np.testing.assert_array_equal(absorbed[:, :10], 0)
    np.testing.assert_array_equal(absorbed[:, 10:], 1)


@pytest.mark.parametrize(("cells", "stays"), [(49, False), (50, True)])
def test_region_of_exactly_the_area_stays(cells, stays):
    regions = np.zeros((20, 20), dtype=int)
    regions.flat[:cells] = 1
    seen = np.ones((20, 20), bool)
    absorbed = absorb_tiny_regions(regions, seen, min_area=0.005, cell=CELL)
    assert (1 in absorbed) == stays


def test_large_hole_stays_a_hole_and_a_small_one_is_filled():
    regions = np.zeros((30, 30), dtype=int)
    regions[2:12, 2:12] = 1  # 100 cm² of nothing seen.
    regions[20:24, 20:24] = 2  # 16 cm².
    seen = regions == 0
    absorbed = absorb_tiny_regions(regions, seen, min_area=0.005, cell=CELL)
    np.testing.assert_array_equal(absorbed[2:12, 2:12], -1)
    np.testing.assert_array_equal(absorbed[20:24, 20:24], 0)


def test_nothing_inherits_from_a_hole():
    regions = np.zeros((30, 30), dtype=int)
    regions[:, 10:] = 1  # A large hole ...
    regions[10, 10] = (
        2  # ... with one cell seen in it, beside the wall, and one far in.
    )
    regions[10, 25] = 3
    seen = regions != 1
    absorbed = absorb_tiny_regions(regions, seen, min_area=0.005, cell=CELL)
    assert absorbed[10, 10] == 0
    assert absorbed[10, 25] == 0


def test_without_a_large_region_nothing_is_left():
    regions = np.arange(9).reshape(3, 3)
    absorbed = absorb_tiny_regions(
        regions, np.ones((3, 3), bool), min_area=0.005, cell=CELL
    )
    assert (absorbed == -1).all()
    assert (sort_by_area(absorbed) == 0).all()


def test_labels_are_sorted_by_area():
    regions = np.array([[5, 5, 2, 2], [-1, 9, 9, 9], [7, 4, 4, -1]])
    # 9 has three cells; 2, 4 and 5 two each, by number; 7 one.
    np.testing.assert_array_equal(
        sort_by_area(regions), [[4, 4, 2, 2], [0, 1, 1, 1], [5, 3, 3, 0]]
    )


def test_specks_alone_leave_the_mask():
    mask = np.zeros((30, 30), dtype=bool)
    mask[:, :5] = True  # 150 cells ...
    mask[10, 5] = mask[11, 6] = True  # ... and two that touch it, by a corner too.
    mask[10:17, 20:27] = True  # 49 cells alone.
    kept = drop_specks(mask, min_area=0.005, cell=CELL)
    assert kept.sum() == 152
    assert not kept[:, 7:].any()
