"""Smooth surfaces over a grid: penalised splines fitted by weighted least squares.

A tensor-product cubic B-spline with a penalty on third differences of its coefficients:
a quadratic (tilt, bulge and twist) where the penalty is strong; where it is weak, a
spline that bridges places without weight.

Source: Eilers and Marx, "Flexible smoothing with B-splines and penalties", 1996.
"""

import math

import numpy as np
from scipy import linalg, sparse
from scipy.interpolate import BSpline

from perception.ground import FloatArray

_RIDGE = 1e-6
_SPAN = 4  # Cubic splines that are not 0 at a place.


class SplineSurface:
    """Weighted, penalised least squares of tensor-product splines on a grid.

    Only four splines reach any place, so the normal matrix is a band, built from the
    products of neighbouring splines along each axis: memory and time grow with the
    cells and not with the square of the coefficients.
    """

    def __init__(
        self, y: FloatArray, x: FloatArray, *, within: FloatArray, knot: float
    ) -> None:
        """Lays the splines.

        Args:
            y: (ny,) m, places along one axis, ascending.
            x: (nx,) m, along the other.
            within: (2, 2) m, lowest and highest y, and x, that the splines cover.
            knot: Largest distance of knots, m.
        """
        # The band is as wide as the shorter side is long.
        self._turned = bool(np.ptp(within[1]) > np.ptp(within[0]))
        if self._turned:
            y, x, within = x, y, within[::-1]
        self._within, self._knot = within, knot
        self._along = _basis(y, within[0], knot)
        self._across = _basis(x, within[1], knot)
        ky, kx = self._along.shape[1], self._across.shape[1]
        self._pairs_y = _pairs(self._along).reshape(-1, _SPAN * ky)
        self._pairs_x = _pairs(self._across).reshape(-1, _SPAN * kx)
        rough = sparse.kron(_roughness(ky), sparse.eye_array(kx))
        rough += sparse.kron(sparse.eye_array(ky), _roughness(kx))
        self._rough = np.zeros((_SPAN * kx, ky * kx))
        for row in range(_SPAN * kx):
            self._rough[row, : ky * kx - row] = rough.diagonal(-row)

    def solve(
        self, weight: FloatArray, values: FloatArray, penalty: float
    ) -> FloatArray:
        """Fits the surface.

        Args:
            weight: (ny, nx) of each place, >= 0.
            values: (ny, nx) heights, finite also where the weight is 0.
            penalty: Weight of the roughness.

        Returns:
            The surface's coefficients.

        Raises:
            ValueError: The weights are no numbers that determine a surface.
        """
        if self._turned:
            weight, values = weight.T, values.T
        ky, kx = self._along.shape[1], self._across.shape[1]
        products = (self._pairs_y.T @ weight @ self._pairs_x).reshape(
            _SPAN, ky, _SPAN, kx
        )
        band = penalty * self._rough
        band[0] += _RIDGE
        # Coefficient (a, b) is number a kx + b; a band's row r holds pairs r apart.
        for dy in range(_SPAN):
            for dx in range(-_SPAN + 1 if dy else 0, _SPAN):
                part = products[dy, :, abs(dx)]
                if dx < 0:  # The pair is numbered by its spline on the left.
                    part = np.pad(part[:, :dx], ((0, 0), (-dx, 0)))
                band[dy * kx + dx] += part.ravel()
        right = (self._along.T @ (weight * values) @ self._across).ravel()
        try:
            solved: FloatArray = linalg.solveh_banded(
                band, right, lower=True, overwrite_ab=True, check_finite=False
            )
        except np.linalg.LinAlgError as error:
            raise ValueError(f"no surface fits: {error}") from error
        return solved.reshape(ky, kx)

    def heights(self, coefficients: FloatArray) -> FloatArray:
        """Returns the surface (ny, nx) at the places that it was laid over."""
        height: FloatArray = self._along @ coefficients @ self._across.T
        return height.T if self._turned else height

    def heights_at(
        self, y: FloatArray, x: FloatArray, coefficients: FloatArray
    ) -> FloatArray:
        """Returns the surface over another grid, y (n,) by x (m,), m."""
        if self._turned:
            y, x = x, y
        along = _basis(y, self._within[0], self._knot)
        across = _basis(x, self._within[1], self._knot)
        height: FloatArray = along @ coefficients @ across.T
        return height.T if self._turned else height


def _basis(at: FloatArray, within: FloatArray, knot: float) -> FloatArray:
    """Returns the cubic B-splines (n, k) at some places, on even knots."""
    low, high = within
    count = max(1, math.ceil((high - low) / knot))
    width = max((high - low) / count, 1e-9)
    knots = low + width * np.arange(-3, count + 4)
    inside = np.clip(at, low, low + count * width * (1.0 - 1e-12))
    matrix: FloatArray = BSpline.design_matrix(inside, knots, 3).toarray()
    return matrix


def _pairs(basis: FloatArray) -> FloatArray:
    """Returns (n, 4, k): products of each spline (n, k) with itself and the next."""
    pairs = np.zeros((basis.shape[0], _SPAN, basis.shape[1]))
    for step in range(_SPAN):
        count = basis.shape[1] - step
        pairs[:, step, :count] = basis[:, :count] * basis[:, step:]
    return pairs


def _roughness(count: int) -> sparse.csr_array:
    """Returns the matrix whose quadratic form sums squared third differences."""
    differences = sparse.csr_array(np.diff(np.eye(count), n=3, axis=0))
    return sparse.csr_array(differences.T @ differences)
