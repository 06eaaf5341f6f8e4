"""RANSAC and least squares on planes whose equation is known."""

import numpy as np
import pytest

from perception.config import SegmentationConfig
from perception.paper_steps.planes import fit_plane, ransac_plane, segment_planes


def plane_points(rng, normal, offset, count, *, size=1.0, noise=0.0):
    """Points on n . p = d within a square of half-width `size` around its foot."""
    normal = np.asarray(normal) / np.linalg.norm(normal)
    a = np.cross(normal, [0.3, 0.5, 0.81])
    a /= np.linalg.norm(a)
    b = np.cross(normal, a)
    u, v = rng.uniform(-size, size, (2, count))
    w = offset + rng.normal(0.0, noise, count) if noise else np.full(count, offset)
    return np.outer(a, u) + np.outer(b, v) + np.outer(normal, np.ones(count)) * w


def angle(a, b):
    """Angle between two undirected normals, rad."""
    cosine = abs(np.dot(a, b)) / np.linalg.norm(a) / np.linalg.norm(b)
    return np.arccos(min(1.0, cosine))


def test_least_squares_is_exact_on_exact_points():
    rng = np.random.default_rng(0)
    plane = fit_plane(plane_points(rng, [1.0, 2.0, -2.0], 3.0, 50))
    sign = np.sign(plane.normal[0])
    np.testing.assert_allclose(sign * plane.normal, [1 / 3, 2 / 3, -2 / 3], atol=1e-12)
    assert sign * plane.offset == pytest.approx(3.0, abs=1e-12)
    assert plane.rms == pytest.approx(0.0, abs=1e-7)
    assert plane.count == 50


def test_rms_is_the_noise():
    rng = np.random.default_rng(1)
    points = plane_points(rng, [0.0, 0.0, 1.0], 1.0, 20000, noise=0.004)
    # The standard error of an rms of n values is rms / sqrt(2 n) = 0.5 %.
    assert fit_plane(points).rms == pytest.approx(0.004, rel=0.02)


def test_plane_of_two_points_is_refused():
    with pytest.raises(ValueError, match="3 points, got 2"):
        fit_plane(np.zeros((3, 2)))


@pytest.mark.parametrize("share", [0.8, 0.5, 0.25])
def test_plane_is_found_among_outliers(share):
    rng = np.random.default_rng(2)
    on = round(20000 * share)
    points = np.concatenate(
        [
            plane_points(rng, [0.1, -0.2, 1.0], 0.7, on, noise=0.003),
            rng.uniform(-1.5, 1.5, (3, 20000 - on)),
        ],
        axis=1,
    )
    plane, inliers = ransac_plane(points, threshold=0.03, rng=rng)
    # Outliers within the slab pull evenly: their mean is off by less than
    # 0.017 / sqrt(300), weighed by their share of the slab.
    assert angle(plane.normal, [0.1, -0.2, 1.0]) < np.radians(0.2)
    assert abs(abs(plane.offset) - 0.7) < 0.002
    assert inliers[:on].all()
    np.testing.assert_array_equal(inliers, np.abs(plane.distances(points)) <= 0.03)


def test_points_on_a_line_have_no_plane():
    line = np.outer([1.0, 2.0, 3.0], np.linspace(0.0, 1.0, 100))
    rng = np.random.default_rng(0)
    assert ransac_plane(line, threshold=0.03, rng=rng) is None
    assert ransac_plane(np.zeros((3, 100)), threshold=0.03, rng=rng) is None
    assert ransac_plane(np.zeros((3, 2)), threshold=0.03, rng=rng) is None


def three_planes(rng):
    """Wall, recess 0.12 m behind, board 1 m before: 5000, 2000 and 800 points."""
    wall = plane_points(rng, [0.0, 0.0, 1.0], 0.0, 5000)
    recess = plane_points(rng, [0.0, 0.0, 1.0], -0.12, 2000, size=0.3)
    board = plane_points(rng, [0.0, 0.0, 1.0], 1.0, 800)
    return np.concatenate([wall, recess, board], axis=1)


def test_planes_come_largest_first_with_their_points():
    rng = np.random.default_rng(3)
    labels, planes = segment_planes(
        three_planes(rng), config=SegmentationConfig(), rng=rng
    )
    np.testing.assert_array_equal(labels, np.repeat([1, 2, 3], [5000, 2000, 800]))
    assert [plane.count for plane in planes] == [5000, 2000, 800]


def test_planes_end_at_the_given_number():
    rng = np.random.default_rng(3)
    labels, planes = segment_planes(
        three_planes(rng), config=SegmentationConfig(max_planes=2), rng=rng
    )
    assert len(planes) == 2
    np.testing.assert_array_equal(labels[7000:], 0)


def test_planes_end_when_less_than_the_share_is_left():
    rng = np.random.default_rng(3)
    # 800 of 7800 points are 10.3 %: below 11 % the third plane is not looked for.
    _, planes = segment_planes(
        three_planes(rng), config=SegmentationConfig(stop_fraction=0.11), rng=rng
    )
    assert len(planes) == 2


def test_same_seed_same_planes():
    points = np.random.default_rng(4).uniform(-1.0, 1.0, (3, 6000))
    results = [
        segment_planes(
            points, config=SegmentationConfig(), rng=np.random.default_rng(7)
        )
        for _ in range(2)
    ]
    np.testing.assert_array_equal(results[0][0], results[1][0])
    for one, other in zip(results[0][1], results[1][1], strict=True):
        np.testing.assert_array_equal(one.normal, other.normal)
        assert one.offset == other.offset
