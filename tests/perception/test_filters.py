"""The statistical filter against its definition."""

import numpy as np
import pytest

from perception.filters import morton_codes, statistical_filter


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
