"""The statistical filter against its definition."""

import numpy as np
import pytest

from perception.paper_steps.filters import morton_codes, statistical_filter
from perception.synthetic.furnished_wall import furnished_wall

K, ALPHA = 50, 3.5  # As in the paper.


def brute_force(points: np.ndarray, k: int, alpha: float) -> np.ndarray:
    """The definition, word for word: all distances, own point left out."""
    distances = np.linalg.norm(points[:, :, None] - points[:, None, :], axis=0)
    np.fill_diagonal(distances, np.inf)
    figures = np.sort(distances, axis=1)[:, :k].mean(axis=1)
    return figures <= figures.mean() + alpha * figures.std(ddof=1)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("k", "alpha"), [(50, 3.5), (8, 1.0), (1, 2.0)])
def test_keeps_what_the_definition_keeps(seed, k, alpha):
    rng = np.random.default_rng(seed)
    points = np.concatenate(
        [
            rng.normal(size=(3, 500)) * [[1.0], [1.0], [0.01]],
            rng.normal(size=(3, 40)) * 3,
        ],
        axis=1,
    )
    keep = statistical_filter(points, neighbors=k, std_multiplier=alpha)
    np.testing.assert_array_equal(keep, brute_force(points, k, alpha))
    assert 0 < np.count_nonzero(~keep) < 100


def test_only_the_upper_side_is_an_outlier():
    # A dense clump beside a regular lattice has tiny distances, far below the mean.
    lattice = np.stack(np.meshgrid(*[np.arange(6.0)] * 3)).reshape(3, -1)
    clump = np.full((3, 5), 20.0) + 1e-6 * np.arange(5)
    points = np.concatenate([lattice, clump], axis=1)
    assert statistical_filter(points, neighbors=3, std_multiplier=3.0).all()


def test_one_far_point_is_removed_and_a_lattice_stays():
    lattice = np.stack(np.meshgrid(*[np.arange(6.0)] * 3)).reshape(3, -1)
    assert statistical_filter(lattice, neighbors=3, std_multiplier=3.5).all()
    points = np.concatenate([lattice, [[30.0], [0.0], [0.0]]], axis=1)
    keep = statistical_filter(points, neighbors=3, std_multiplier=3.5)
    np.testing.assert_array_equal(np.flatnonzero(~keep), [216])


def test_non_finite_points_are_outliers_and_count_nowhere():
    rng = np.random.default_rng(0)
    points = rng.normal(size=(3, 300))
    spoilt = np.concatenate(
        [points, [[np.nan, 0.0], [0.0, np.inf], [0.0, 0.0]]], axis=1
    )
    keep = statistical_filter(points, neighbors=10, std_multiplier=2.0)
    spoilt_keep = statistical_filter(spoilt, neighbors=10, std_multiplier=2.0)
    np.testing.assert_array_equal(spoilt_keep, [*keep, False, False])


def test_coincident_points_are_their_own_neighbours():
    # Sixty copies: mean distance 0 with k = 50, which is no outlier.
    points = np.concatenate([np.zeros((3, 60)), np.eye(3) * 0.01], axis=1)
    keep = statistical_filter(points, neighbors=50, std_multiplier=3.5)
    np.testing.assert_array_equal(keep, brute_force(points, 50, 3.5))


def test_order_of_points_does_not_matter():
    rng = np.random.default_rng(5)
    points = rng.normal(size=(3, 2000))
    order = rng.permutation(2000)
    keep = statistical_filter(points, neighbors=50, std_multiplier=2.0)
    moved = statistical_filter(points[:, order], neighbors=50, std_multiplier=2.0)
    np.testing.assert_array_equal(moved, keep[order])


@pytest.mark.parametrize("fast", [False, True])
def test_order_of_the_array_does_not_matter(fast):
    # Row by row or column by column in memory, and a cloud's x, y and z swapped.
    points = furnished_wall(25_000, seed=4).p_CQs
    keep = filtered(np.ascontiguousarray(points), fast=fast)
    np.testing.assert_array_equal(filtered(np.asfortranarray(points), fast=fast), keep)
    turned = filtered(points[[2, 0, 1]], fast=fast)
    assert np.count_nonzero(turned != keep) <= (1 if fast else 0)


@pytest.mark.parametrize("count", [0, 1, 2, 3, 20])
def test_fewer_points_than_neighbours_do_not_fail(count):
    points = np.random.default_rng(1).normal(size=(3, count))
    keep = statistical_filter(points, neighbors=50, std_multiplier=3.5)
    assert keep.shape == (count,)
    assert keep.all()


def test_morton_code_interleaves_bits():
    # Over the range 0 .. 2^21 - 1 a coordinate is its own 21-bit number.
    top = 2.0**21 - 1
    points = np.array(
        [[0.0, top, 1, 0, 0, 2], [0, top, 0, 1, 0, 0], [0, top, 0, 0, 1, 0]]
    )
    np.testing.assert_array_equal(
        morton_codes(points), np.array([0, 2**63 - 1, 1, 2, 4, 8], dtype=np.uint64)
    )


def golden_figures(points: np.ndarray) -> np.ndarray:
    """Mean distance to the 50 nearest others by brute force, over (N, 3) points.

    Distances are taken to all points of the 27 cells around a point's cell of edge R:
    where the 50th is at most R, no point beyond can be nearer. For points where it is
    not, R grows, and in the end all points count.
    """
    figures = np.full(len(points), np.nan)
    everything = np.arange(len(points))
    spacing = np.sqrt(np.prod(np.ptp(points[:, :2], axis=0)) / len(points))
    for edge in np.array([5, 15, 45, 135]) * spacing:
        cells = np.floor(points / edge).astype(int)
        _, cell_of = np.unique(cells, axis=0, return_inverse=True)
        members = np.split(
            np.argsort(cell_of, kind="stable"), np.cumsum(np.bincount(cell_of))[:-1]
        )
        table = {tuple(cells[own[0]]): own for own in members}
        around = np.stack(np.meshgrid(*[[-1, 0, 1]] * 3)).reshape(3, -1).T
        for cell, own in table.items():
            own = own[np.isnan(figures[own])]
            near = [table.get(tuple(cell + step)) for step in around]
            others = np.concatenate([some for some in near if some is not None])
            if own.size and others.size > K:
                mean, last = nearest_mean(points, own, others)
                figures[own[last <= edge]] = mean[last <= edge]
    for some in np.array_split(
        np.flatnonzero(np.isnan(figures)), 4 + len(points) // 1000
    ):
        if some.size:
            figures[some] = nearest_mean(points, some, everything)[0]
    return figures


def nearest_mean(points, own, others):
    """Mean and largest of the 50 least distances from `own` to `others`."""
    squares = sum(
        (points[own, axis][:, None] - points[others, axis]) ** 2 for axis in range(3)
    )
    squares[own[:, None] == others] = np.inf
    nearest = np.sqrt(np.partition(squares, K - 1, axis=1)[:, :K])
    return nearest.mean(axis=1), nearest.max(axis=1)


def golden(points: np.ndarray) -> np.ndarray:
    figures = golden_figures(points.T)
    return figures <= figures.mean() + ALPHA * figures.std(ddof=1)


def filtered(points, **options):
    return statistical_filter(points, neighbors=K, std_multiplier=ALPHA, **options)


def test_brute_force_on_cells_is_the_definition():
    points = furnished_wall(2_000, seed=5).p_CQs
    np.testing.assert_array_equal(golden(points), brute_force(points, K, ALPHA))


def test_large_clouds_are_filtered_by_the_definition():
    points = furnished_wall(40_000, seed=2).p_CQs
    keep = golden(points)
    np.testing.assert_array_equal(filtered(points), keep)
    assert 100 < np.count_nonzero(~keep) < 2000
    # 10 of a million.
    assert np.count_nonzero(filtered(points, fast=True) != keep) <= 1


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("count", [100_000, 500_000, 1_000_000])
def test_walls_are_filtered_by_the_definition(count):
    points = furnished_wall(count, seed=1).p_CQs
    keep = golden(points)
    np.testing.assert_array_equal(filtered(points), keep)
    assert np.count_nonzero(filtered(points, fast=True) != keep) <= 10


def test_fast_filter_holds_without_outliers():
    # The threshold is close above most figures: nearly all points must be queried.
    rng = np.random.default_rng(0)
    points = rng.uniform(0.0, [[1.0], [1.0], [0.01]], (3, 30_000))
    exact = filtered(points)
    assert np.count_nonzero(filtered(points, fast=True) != exact) <= 1


def test_duplicates_in_a_large_cloud_stay():
    # The points of a clump have figure 0, which is no outlier, and count in the mean.
    wall = furnished_wall(25_000, seed=3).p_CQs
    points = np.concatenate([wall, np.full((3, 200), 0.7)], axis=1)
    keep = golden(points)
    assert keep[25_000:].all()
    np.testing.assert_array_equal(filtered(points), keep)
    assert np.count_nonzero(filtered(points, fast=True) != keep) <= 1


@pytest.mark.parametrize("fast", [False, True])
def test_large_lattice_has_no_outliers(fast):
    # All figures are the same: the 8 nearest points of each are its duplicates.
    corner = np.stack(np.meshgrid(*[np.arange(2.0)] * 3)).reshape(3, -1)
    points = np.repeat(corner, 3200, axis=1)
    keep = statistical_filter(points, neighbors=8, std_multiplier=3.5, fast=fast)
    assert keep.all()
