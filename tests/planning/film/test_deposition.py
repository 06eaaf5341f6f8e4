"""Closed forms against a published table, quadrature of the rate, and brute force."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import beta, jn_zeros

from painter.planning.config import TipConfig
from painter.planning.film.deposition import (
    best_pitch,
    first_bessel_zero,
    flow_share,
    half_axes,
    mean_film,
    predicted_film,
    raster_cv,
    stroke_profile,
)
from painter.planning.spray_path import Stroke

TIP = TipConfig()
STANDOFF = 0.30
SPEED = 0.6
A, B = 0.125, 0.025


def stroke(x, y_start, y_end):
    return Stroke(
        start_T=np.array([x, y_start]),
        end_T=np.array([x, y_end]),
        speed=SPEED,
        kind="body",
        column=0,
    )


def rate(x, y):
    """The double-beta rate as it is defined, m/s; (x, y) from the spray axis."""
    core = 1.0 - (x / A) ** 2
    if core <= 0.0 or abs(y) >= B * np.sqrt(core):
        return 0.0
    scale = A * B * beta(0.5, TIP.beta2) * beta(0.5, TIP.gamma + 1.0)
    along = (1.0 - y**2 / (B**2 * core)) ** (TIP.beta2 - 1.0)
    flow = TIP.flow * TIP.transfer_efficiency
    return flow / scale * core ** (TIP.gamma - 0.5) * along


def test_fan_grows_linearly_with_standoff():
    assert half_axes(TIP, 0.30) == pytest.approx((A, B))
    assert half_axes(TIP, 0.15) == pytest.approx((A / 2, B / 2))


@pytest.mark.parametrize("x", [0.0, 0.04, -0.11])
def test_stroke_profile_is_the_rate_integrated_over_a_pass(x):
    """The gun passes y at speed v, so dt = dy / v."""
    (h,) = stroke_profile(np.array([x]), tip=TIP, standoff=STANDOFF, speed=SPEED)
    end = B * np.sqrt(1.0 - (x / A) ** 2)
    passed, _ = quad(lambda y: rate(x, y), -end, end)
    assert h == pytest.approx(passed / SPEED, rel=1e-6)


@pytest.mark.parametrize("gamma", [0.5, 1.0, 2.0, 3.7])
def test_flow_share_holds_the_whole_flow(gamma):
    total, _ = quad(lambda x: float(flow_share(np.array(x), A, gamma)), -A, A)
    assert total == pytest.approx(1.0, rel=1e-6)


@pytest.mark.parametrize(
    ("order", "zero"),
    [
        (0.5, np.pi),  # J(1/2) is a sine.
        (1.5, 4.493409457909064),  # tan x = x.
        (1.0, jn_zeros(1, 1)[0]),
        (7.0, jn_zeros(7, 1)[0]),
        (60.0, jn_zeros(60, 1)[0]),
    ],
)
def test_first_bessel_zero(order, zero):
    assert first_bessel_zero(order) == pytest.approx(zero, rel=1e-10)


@pytest.mark.parametrize(
    ("gamma", "pitch", "cv", "cv_half_overlap"),
    [
        # Source: the project's planning spike, painting.md section 3.3.
        (0.5, 1.640, 0.0960, 0.105),
        (1.0, 1.398, 0.0533, 0.112),
        (1.5, 1.224, 0.0270, 0.084),
        (2.0, 1.090, 0.0108, 0.041),
        (2.5, 0.985, 0.0019, 0.009),
        (3.0, 0.899, 0.0012, 0.059),
    ],
)
def test_best_pitch_and_its_variation(gamma, pitch, cv, cv_half_overlap):
    tip = TipConfig(gamma=gamma)
    best = best_pitch(tip, STANDOFF)
    assert best / A == pytest.approx(pitch, abs=6e-4)
    assert raster_cv(best, tip=tip, standoff=STANDOFF) == pytest.approx(cv, abs=6e-5)
    half = raster_cv(A, tip=tip, standoff=STANDOFF)
    assert half == pytest.approx(cv_half_overlap, abs=6e-4)


@pytest.mark.parametrize("pitch", [0.06, 0.125, 0.1363, 0.16])
def test_series_agrees_with_summed_strokes(pitch):
    x = np.linspace(0.0, pitch, 2000, endpoint=False)
    film = sum(
        stroke_profile(x - k * pitch, tip=TIP, standoff=STANDOFF, speed=SPEED)
        for k in range(-6, 8)
    )
    assert film.mean() == pytest.approx(mean_film(TIP, speed=SPEED, pitch=pitch))
    cv = raster_cv(pitch, tip=TIP, standoff=STANDOFF)
    assert cv == pytest.approx(film.std() / film.mean(), rel=1e-4, abs=1e-7)


def test_default_tip_lays_a_wall_film():
    """x15 tip, 13.3 cm, 0.6 m/s: 123 um; source: painting.md section 3.4."""
    film = mean_film(TIP, speed=0.6, pitch=0.1333)
    assert film == pytest.approx(123e-6, rel=0.01)


def test_predicted_film_is_the_rate_integrated_along_the_stroke():
    """At points before, at, near and after the ends of the stroke."""
    x = np.array([0.46, 0.5, 0.57])
    y = np.array([0.28, 0.30, 0.31, 0.5, 0.695, 0.71, 0.75])
    film = predicted_film([stroke(0.5, 0.30, 0.70)], x, y, tip=TIP)
    for i, yi in enumerate(y):
        for j, xj in enumerate(x):
            end = B * np.sqrt(1.0 - ((xj - 0.5) / A) ** 2)
            low, high = max(0.30, yi - end), min(0.70, yi + end)
            expected = 0.0
            if high > low:
                expected, _ = quad(
                    lambda gun, xj=xj, yi=yi: rate(xj - 0.5, yi - gun), low, high
                )
            assert film[i, j] == pytest.approx(expected / SPEED, rel=1e-5, abs=1e-12)


def test_predicted_film_holds_all_that_lands():
    cell = 0.002
    x = y = np.arange(0.0, 1.0, cell) + cell / 2
    strokes = [stroke(0.5, 0.2, 0.8), stroke(0.4, 0.7, 0.3)]
    film = predicted_film(strokes, x, y, tip=TIP)
    sprayed = TIP.flow * TIP.transfer_efficiency * (0.6 + 0.4) / SPEED
    # Midpoints on 2 mm of a fan 250 mm wide.
    assert film.sum() * cell**2 == pytest.approx(sprayed, rel=1e-4)


def test_predicted_film_does_not_mind_the_direction():
    x = y = np.linspace(0.0, 1.0, 60)
    up, down = (
        predicted_film([s], x, y, tip=TIP)
        for s in (stroke(0.5, 0.2, 0.8), stroke(0.5, 0.8, 0.2))
    )
    np.testing.assert_array_equal(up, down)


def test_strokes_along_the_fan_are_refused():
    across = Stroke(
        start_T=np.array([0.2, 0.5]),
        end_T=np.array([0.8, 0.5]),
        speed=SPEED,
        kind="body",
        column=0,
    )
    x = y = np.linspace(0.0, 1.0, 10)
    with pytest.raises(ValueError, match="run along T y"):
        predicted_film([across], x, y, tip=TIP)
