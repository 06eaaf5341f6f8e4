"""Film of an elliptical double-beta fan, in closed form.

With the gun square on a wall at stand-off d, fan half axes a (long, T x) and b (short,
T y), the film grows at the rate

    Q TE / (a b B(1/2, beta2) B(1/2, gamma + 1))
        (1 - u²)^(gamma - 1/2) (1 - s²)^(beta2 - 1),  u = x/a,  s = y / (b sqrt(1 - u²))

where Q is the tip's flow and TE its transfer efficiency. Everything here follows from
it: u and s are independent, u with density (1 - u²)^gamma / B(1/2, gamma + 1), s with
density (1 - s²)^(beta2 - 1) / B(1/2, beta2), and both half axes grow linearly with d.

Source: double-beta rate: Coatings 2025, 15(5), 581; flow normalisation: its integral
over the ellipse is Q TE.
"""

import math
from collections.abc import Iterable

import numpy as np
from scipy.optimize import brentq
from scipy.special import ai_zeros, beta, betainc, gammaln, jv

from painter.planning.config import TipConfig
from painter.planning.spray_path import Stroke
from perception.ground import FloatArray

_HARMONICS = 2000  # The series falls with k^-(2 gamma + 2): ample for gamma > 0.


def half_axes(tip: TipConfig, standoff: float) -> tuple[float, float]:
    """Returns the fan's long and short half axis at a stand-off.

    Args:
        tip: The spray tip.
        standoff: Nozzle to wall along the spray axis, m.

    Returns:
        a and b, m.
    """
    scale = 0.5 * standoff / tip.fan_distance
    return scale * tip.fan_width, scale * tip.fan_thickness


def flow_share(x: FloatArray, a: float, gamma: float) -> FloatArray:
    """Returns how a fan's flow is spread over its long axis.

    Args:
        x: Distances from the spray axis along the fan's long axis, m.
        a: Long half axis, m.
        gamma: Exponent of the profile.

    Returns:
        Density of the flow, 1/m; its integral over x is 1.
    """
    core = np.clip(1.0 - (x / a) ** 2, 0.0, None)
    return np.asarray(core**gamma / (a * beta(0.5, gamma + 1.0)))


def stroke_profile(
    x: FloatArray, *, tip: TipConfig, standoff: float, speed: float
) -> FloatArray:
    """Returns the film across one long stroke.

    Args:
        x: Distances from the stroke's line, m.
        tip: The spray tip.
        standoff: Nozzle to wall, m.
        speed: Gun speed, m/s.

    Returns:
        Wet film, m: Q TE / v times the flow's share at x.
    """
    a, _ = half_axes(tip, standoff)
    line_dose = tip.flow * tip.transfer_efficiency / speed
    return line_dose * flow_share(x, a, tip.gamma)


def mean_film(tip: TipConfig, *, speed: float, pitch: float) -> float:
    """Returns a raster's mean wet film, m: Q TE / (v p), whatever the stand-off."""
    return tip.flow * tip.transfer_efficiency / (speed * pitch)


def first_bessel_zero(order: float) -> float:
    """Returns j(order, 1), the first positive zero of J of any real order > 0.

    Source: bounds that hold for every order > 0: Qu and Wong, "Best possible upper and
    lower bounds for the zeros of the Bessel function", Trans. AMS 351 (1999), eq. 1.4.
    """
    (airy_zero,) = ai_zeros(1)[0]
    lower = order - airy_zero * (order / 2.0) ** (1.0 / 3.0)
    upper = lower + 0.15 * airy_zero**2 * (2.0 / order) ** (1.0 / 3.0)
    return float(brentq(lambda x: jv(order, x), lower, upper, xtol=1e-13))


def best_pitch(tip: TipConfig, standoff: float) -> float:
    """Returns the raster pitch at which the film's first harmonic vanishes, m.

    p* = 2 pi a / j(gamma + 1/2, 1): the zero of the profile's Fourier transform.
    """
    a, _ = half_axes(tip, standoff)
    return 2.0 * math.pi * a / first_bessel_zero(tip.gamma + 0.5)


def raster_cv(pitch: float, *, tip: TipConfig, standoff: float) -> float:
    """Returns the film's standard deviation over its mean on an endless raster.

    By Poisson summation CV² = 2 sum over k >= 1 of |F(2 pi k / p) / F(0)|² with
    F(w) / F(0) = Gamma(gamma + 3/2) (2 / (w a))^(gamma + 1/2) J_(gamma + 1/2)(w a).

    Args:
        pitch: Distance between strokes, m.
        tip: The spray tip.
        standoff: Nozzle to wall, m.
    """
    a, _ = half_axes(tip, standoff)
    order = tip.gamma + 0.5
    wa = 2.0 * math.pi * a / pitch * np.arange(1, _HARMONICS + 1)
    log_scale = gammaln(order + 1.0) + order * np.log(2.0 / wa)
    return float(np.sqrt(2.0 * np.sum((np.exp(log_scale) * jv(order, wa)) ** 2)))


def predicted_film(
    strokes: Iterable[Stroke],
    x: FloatArray,
    y: FloatArray,
    *,
    tip: TipConfig,
) -> FloatArray:
    """Returns the film that strokes along T y leave on a flat wall.

    Each stroke's integral is exact, its ends included: a point at y gets the share of
    the fan's thickness that passed over it.

    Args:
        strokes: Strokes along T y, either way.
        x: (nx,) m, columns at which to give the film, ascending, in T.
        y: (ny,) m, rows, in T.
        tip: The spray tip.

    Returns:
        (ny, nx) wet film, m.

    Raises:
        ValueError: A stroke does not run along T y.
    """
    film = np.zeros((y.size, x.size))
    for stroke in strokes:
        a, b = half_axes(tip, stroke.standoff)
        x_line, y_line = _line(stroke)
        columns = slice(*np.searchsorted(x, [x_line - a, x_line + a]))
        offset = x[columns] - x_line
        thickness = b * np.sqrt(np.clip(1.0 - (offset / a) ** 2, 1e-12, None))
        passed = [
            _flow_passed((y[:, None] - y_end) / thickness, tip.beta2)
            for y_end in y_line
        ]
        profile = stroke.flow * stroke_profile(
            offset, tip=tip, standoff=stroke.standoff, speed=stroke.speed
        )
        film[:, columns] += profile * (passed[0] - passed[1])
    return film


def _line(stroke: Stroke) -> tuple[float, tuple[float, float]]:
    """Returns a stroke's x and its lower and upper y."""
    (x_start, y_start), (x_end, y_end) = stroke.start_T, stroke.end_T
    if abs(x_end - x_start) > 1e-6:
        raise ValueError(
            "strokes run along T y, across the fan's long axis; got one from x "
            f"{x_start:.4f} to {x_end:.4f} m."
        )
    return x_start, (min(y_start, y_end), max(y_start, y_end))


def _flow_passed(s: FloatArray, beta2: float) -> FloatArray:
    """Returns the share of the flow at thickness coordinates below s."""
    return np.asarray(betainc(beta2, beta2, np.clip(0.5 + 0.5 * s, 0.0, 1.0)))
