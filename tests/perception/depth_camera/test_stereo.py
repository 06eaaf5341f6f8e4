"""The stereo model against the closed forms that its sources give."""

import math

import numpy as np
import pytest

from perception.config import StereoConfig
from perception.depth_camera.stereo import StereoModel, correlated_noise

SHAPE = (480, 848)
FOCAL = 424.0 / math.tan(math.radians(43.5))
DEPTH_DISPARITY = FOCAL * 0.050  # m px
IDEAL = {
    "subpixel": 0.0,
    "ripple": 0.0,
    "quantum": 1e-4,
    "fattening": 1,
    "dropout": 0.0,
}


def flat(depth: float) -> np.ndarray:
    return np.full(SHAPE, depth, dtype=np.float32)


def square_on_wall(near: float, far: float) -> np.ndarray:
    depth = flat(far)
    depth[100:300, 300:500] = near
    return depth


def measure(depth, depth_with_glass=None, *, seed=1, frame=1, **settings) -> np.ndarray:
    glass = depth if depth_with_glass is None else depth_with_glass
    dut = StereoModel(StereoConfig(**settings), seed)
    return dut.measure(depth, glass, np.random.default_rng([seed, frame]))


@pytest.mark.parametrize("distance", [0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0])
@pytest.mark.parametrize("subpixel", [0.032, 0.08])
def test_depth_noise_grows_with_the_square_of_distance(distance, subpixel):
    # 10 mm of lean, so that rounding to whole mm is an even error of (1 mm)² / 12.
    lean = np.linspace(-0.005, 0.005, 480, dtype=np.float32)[:, np.newaxis]
    depth = flat(distance) + lean
    image = measure(depth, **(IDEAL | {"subpixel": subpixel}))
    error = (image / 1000.0 - depth)[:, 150:]
    # sigma_Z = Z² s / (f B). The picture holds some 6000 independent values: 1 %
    # standard error; 4 % allowed.
    sigma = distance**2 * subpixel / DEPTH_DISPARITY
    expected = math.hypot(sigma, 0.001 / math.sqrt(12))
    assert error.std() == pytest.approx(expected, rel=0.04)
    # The mean is off by Z sigma_d² / d² (1 / d is curved), and by 5 sigma / sqrt(6000).
    bias = distance * (subpixel * distance / DEPTH_DISPARITY) ** 2
    assert abs(error.mean()) < 2 * bias + 5 * expected / math.sqrt(6000)


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_the_fixed_share_of_the_variance_survives_averaging(share):
    settings = IDEAL | {"subpixel": 0.08, "fixed_share": share}
    dut = StereoModel(StereoConfig(**settings), 1)
    wall, count = flat(2.0), 16  # At 2 m whole mm are fine steps beside the noise.
    pictures = [
        dut.measure(wall, wall, np.random.default_rng([1, frame]))[:, 100:]
        for frame in range(count)
    ]
    one = np.mean([picture.var() for picture in pictures])
    kept = np.mean(pictures, axis=0).var() / one
    assert kept == pytest.approx(share + (1 - share) / count, abs=0.02)


def test_noise_has_unit_variance_and_the_correlation_of_its_window():
    noise = correlated_noise(np.random.default_rng(1), SHAPE, 5)
    assert noise.std() == pytest.approx(1.0, abs=0.02)
    box = np.ones(5)
    triangle = np.convolve(box, box)
    correlation = np.convolve(triangle, triangle)[8:]  # From lag 0 on.
    for lag in (1, 2, 4, 8):
        expected = correlation[lag] / correlation[0]
        assert (noise * np.roll(noise, lag, axis=1)).mean() == pytest.approx(
            expected, abs=0.03
        )


def test_depth_comes_in_steps_of_the_disparity_quantum():
    depth = np.tile(np.linspace(0.5, 3.0, 480, dtype=np.float32)[:, None], (1, 848))
    image = measure(depth, **(IDEAL | {"quantum": 1 / 32, "grazing_deg": 89.9}))
    steps = np.arange(1, 32 * 100) / 32
    allowed = np.rint(1000 * DEPTH_DISPARITY / steps)
    values = np.unique(image[image > 0])
    assert values.size > 200
    assert np.isin(values, allowed).all()


def test_ripple_follows_the_fraction_of_disparity():
    disparity = 32.25  # The sine is 1 here.
    depth = DEPTH_DISPARITY / disparity
    image = measure(flat(depth), **(IDEAL | {"ripple": 0.05}))
    expected = 1000 * DEPTH_DISPARITY / (disparity + 0.05)
    assert np.abs(image[:, 100:] - expected).max() <= 0.51  # Whole mm.


@pytest.mark.parametrize("distance", [0.4, 0.8, 2.0])
def test_left_band_without_depth_is_f_b_over_z_wide(distance):
    image = measure(flat(distance), **IDEAL)
    blind = (image == 0).sum(axis=1)
    assert np.ptp(blind) == 0
    assert blind[0] == math.ceil(DEPTH_DISPARITY / distance)
    assert (image[:, blind[0] :] > 0).all()


def test_near_edges_throw_a_shadow_to_their_left_alone():
    near, far = 0.5, 0.8
    image = measure(square_on_wall(near, far), **IDEAL)
    width = DEPTH_DISPARITY * (1 / near - 1 / far)
    band = math.ceil(DEPTH_DISPARITY / far)
    lost = image[:, band:] == 0
    rows = lost.sum(axis=1)
    assert np.abs(rows[100:300] - width).max() <= 1.0
    assert rows[:100].max() == rows[300:].max() == 0
    assert np.flatnonzero(lost[200]).max() + band == 299


def test_near_edges_grow_by_half_the_window():
    settings = IDEAL | {"fattening": 7, "fattening_share": 1.0, "flying_share": 0.0}
    image = measure(square_on_wall(0.6, 0.8), **settings)
    rows, columns = np.nonzero(image == 600)
    assert (rows.min(), rows.max()) == (97, 302)
    assert (columns.min(), columns.max()) == (297, 502)


def test_edges_grow_at_the_stated_share_of_places():
    settings = IDEAL | {"fattening": 7, "fattening_share": 0.7, "flying_share": 0.0}
    shares = [
        (measure(square_on_wall(0.6, 0.8), frame=frame, **settings) == 600)[
            100:300, 500:503
        ].mean()
        for frame in range(8)
    ]
    assert np.mean(shares) == pytest.approx(0.7, abs=0.05)


def test_flying_pixels_lie_between_near_and_far_beside_edges():
    settings = IDEAL | {"fattening": 7, "fattening_share": 1.0, "flying_share": 0.2}
    image = measure(square_on_wall(0.6, 0.8), **settings)
    flying = (image > 605) & (image < 795)
    rows, columns = np.nonzero(flying)
    assert rows.min() >= 97
    assert rows.max() <= 302
    assert columns.max() <= 502
    # In the outermost column nothing to their right hides them from the right imager.
    # 200 px: 3 % standard error.
    assert flying[100:300, 502].mean() == pytest.approx(0.2, abs=0.09)


def test_a_leaning_plane_has_no_edges():
    # A plane is linear in 1 / Z; this one leans by more than 60 deg in places.
    plane = np.tile(1 / np.linspace(1 / 0.9, 1 / 0.3, 848), (480, 1))
    settings = IDEAL | {"fattening": 7, "fattening_share": 1.0, "grazing_deg": 89.9}
    image = measure(plane.astype(np.float32), **settings)
    inside = image[:, 60:-4] / 1000.0  # The window is cut off at the border.
    np.testing.assert_allclose(inside, plane[:, 60:-4], atol=0.0006)


@pytest.mark.parametrize(
    ("angle", "kept"), [(40, 1.0), (58, 1.0), (70, 0.684), (80, 0.347)]
)
def test_pixels_are_lost_at_grazing_angles(angle, kept):
    # A plane through (0, 0, 1) whose normal leans by `angle`: only the centre of the
    # picture sees it at exactly that angle. Kept: cos(angle) / cos(60 deg), at most 1.
    x = ((np.arange(848) - 423.5) / FOCAL).astype(np.float32)
    slope = math.tan(math.radians(angle))
    depth = np.tile(1.0 / np.maximum(1.0 - slope * x, 0.05), (480, 1))
    images = [measure(depth.astype(np.float32), frame=n, **IDEAL) for n in range(5)]
    share = np.mean([(image[230:250, 409:439] > 0).mean() for image in images])
    assert share == pytest.approx(kept, abs=0.03)  # 3000 px: 0.9 % standard error.


def test_dropouts_have_their_share():
    image = measure(flat(0.8), **(IDEAL | {"dropout": 0.05}))
    assert (image[:, 100:] == 0).mean() == pytest.approx(0.05, abs=0.008)


def test_what_is_too_near_or_too_far_has_no_depth():
    depth = flat(1.0)
    depth[:, 400:500] = 0.0  # Nearer than the renderer's near plane.
    depth[:, 600:] = np.inf
    image = measure(depth, **IDEAL)
    assert (image[:, 400:500] == 0).all()
    assert (image[:, 600:] == 0).all()
    assert (image[:, 500:600] == 1000).all()
    for distance, seen in ((0.15, False), (0.2, True), (9.9, True), (10.2, False)):
        picture = measure(flat(distance), **IDEAL)
        assert (picture[:, 200:] > 0).all() == seen
        assert picture[:, 200:].any() == seen


def test_glass_is_a_hole_a_window_or_a_mirror_by_shares():
    far, pane = flat(2.0), flat(0.8)
    settings = IDEAL | {"hole_share": 0.5, "reflection_share": 0.2, "grazing_deg": 89}
    pictures = [measure(far, pane, seed=seed, **settings)[:, 60:] for seed in range(12)]
    shares = [
        np.mean([(picture == value).mean() for picture in pictures])
        for value in (0, 2000, 1600)  # Nothing; what is behind; its own mirror image.
    ]
    # Holes get the shadows at the blotches' edges too; the blotches are some 25 px.
    np.testing.assert_allclose(shares, [0.5, 0.3, 0.2], atol=0.05)
    assert not np.any([(np.abs(picture - 800.0) < 50).any() for picture in pictures])


def test_glass_looks_alike_from_picture_to_picture_but_not_the_same():
    dut = StereoModel(StereoConfig(**IDEAL), 1)
    first, second = (
        dut.measure(flat(2.0), flat(0.8), np.random.default_rng([1, frame]))[:, 60:]
        for frame in (1, 2)
    )
    agree = ((first > 0) == (second > 0)).mean()
    assert 0.6 < agree < 0.95  # 0.5 if independent.


def test_wall_beside_glass_is_untouched():
    far, glass = flat(2.0), flat(2.0)
    glass[:, 500:] = 0.8
    far[:, :450] = glass[:, :450] = 0.8
    image = measure(far, glass, **IDEAL)
    assert (image[:, 60:450] == 800).all()


def test_same_seed_and_frame_give_the_same_picture():
    depth = square_on_wall(0.6, 0.8)
    first = measure(depth, seed=3, frame=7)
    np.testing.assert_array_equal(first, measure(depth, seed=3, frame=7))
    assert (first != measure(depth, seed=3, frame=8)).mean() > 0.2
    assert (first != measure(depth, seed=4, frame=7)).mean() > 0.2


def test_pictures_of_another_size_are_refused():
    with pytest.raises(ValueError, match=r"depth must be \(480, 848\)"):
        measure(np.ones((10, 10), dtype=np.float32), flat(1.0))


@pytest.mark.parametrize(
    "settings",
    [
        {"fattening": 4},
        {"subpixel": -0.1},
        {"dropout": 1.5},
        {"hole_share": 0.7, "reflection_share": 0.4},
        {"hfov_deg": 180.0},
        {"max_range": 70.0},
    ],
)
def test_settings_out_of_bounds_are_refused(settings):
    with pytest.raises(ValueError, match=rf"stereo\.{next(iter(settings))}"):
        StereoModel(StereoConfig(**settings), 1)
