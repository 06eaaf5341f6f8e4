"""The wall's own surface over the tile: flat, bulged, twisted or wavy, with normals.

A tensor-product cubic B-spline is fitted to the cells' depths by iteratively reweighted
least squares with Tukey's biweight. A penalty on third differences of the coefficients
makes it a quadratic (which holds tilt, bulge and twist) where it is strong, and bridges
what is not wall where it is weak.

Source: Eilers and Marx, "Flexible smoothing with B-splines and penalties", 1996;
Beaton and Tukey, "The fitting of power series", 1974 (biweight).
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline

from perception.planes import ransac_plane
from perception.values import BoolArray, FloatArray, FrozenValue

_KNOT = 0.25
"""Distance of knots, m: waves from about twice that length are followed, and a plate of
0.2 m or more is bridged and not climbed."""
_STIFF, _SOFT = 1e6, 1e-2
"""Weight of the penalty against that of a cell: first a quadratic, then the spline."""
_RIDGE = 1e-9
_REPEATS = 3
_FIT_CELL = 0.02
_LEAST_CELLS = 500
_START_POINTS = 20_000
_START_THRESHOLD = 0.004
_LEAST_WINDOW = 0.003
"""Cells farther off than a few times the noise, but at least this, count nothing, m."""
_WINDOWS = (16.0, 10.0, 6.0)
"""The same in standard deviations of the noise, from the first fits to the last."""
_LEAST_SHARE = 0.2


@dataclass(frozen=True, eq=False)
class WallSurface(FrozenValue):
    """Surface of the wall at the centres of a grid's cells, also where things hide it.

    Attributes:
        height: (ny, nx) m along T z.
        normals: (ny, nx, 3) unit, in T, towards the robot.
        noise: Standard deviation of a cell's depth against its neighbour's, m.
    """

    height: FloatArray
    normals: FloatArray
    noise: float


def fit_wall_surface(
    depth: FloatArray, wall: BoolArray, *, cell: float, rng: np.random.Generator
) -> WallSurface:
    """Fits the surface that most of the wall's cells lie on.

    Args:
        depth: (ny, nx) m along T z; NaN = nothing seen.
        wall: (ny, nx) cells that may be wall, e.g. of the wall's RANSAC plane; among
            them may be steps of a few cm, which the fit leaves out.
        cell: Edge of a cell, m.
        rng: Source of random triples for the first plane.

    Returns:
        The surface over the whole grid.

    Raises:
        ValueError: No cell of `wall` has a depth, or there is no surface in them.
    """
    use = wall & np.isfinite(depth)
    if not use.any():
        raise ValueError("no cell of the wall has a depth.")
    noise = neighbour_noise(depth, use)
    y, x = (_centres(count, cell) for count in depth.shape)
    # Splines of 0.25 m do not need every cell; the medians of blocks have less noise.
    step = max(1, round(_FIT_CELL / cell))
    if np.count_nonzero(use) < _LEAST_CELLS * step**2:
        step = 1
    blocks = _block_medians(np.where(use, depth, np.nan), step)
    middle_y, middle_x = (_centres(count, step * cell) for count in blocks.shape)
    use = np.isfinite(blocks)
    spread = neighbour_noise(blocks, use)
    height = _first_plane(blocks, use, middle_x, middle_y, noise=spread, rng=rng)
    across, along = _basis(x, x), _basis(y, y)
    fit = _Fit(_basis(middle_y, y), _basis(middle_x, x))
    values = np.where(use, blocks, 0.0)
    for penalty in (_STIFF, _SOFT):
        for window in np.repeat(_WINDOWS, _REPEATS):
            limit = max(_LEAST_WINDOW, window * spread)
            off = np.where(use, (values - height) / limit, 1.0)
            weight = np.square(np.maximum(1.0 - off * off, 0.0))
            if not weight.any():
                raise ValueError("the wall's cells lie on no surface.")
            coefficients = fit.solve(weight, values, penalty)
            height = fit.along @ coefficients @ fit.across.T
    height = along @ coefficients @ across.T
    slopes = [np.gradient(height, cell, axis=axis) for axis in (1, 0)]
    normals = np.stack([-slopes[0], -slopes[1], np.ones_like(height)], axis=-1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    return WallSurface(height=height, normals=normals, noise=noise)


def neighbour_noise(depth: FloatArray, use: BoolArray) -> float:
    """Estimates the noise of depths from the differences of cells side by side.

    The median makes it blind to steps, and neighbours to the wall's shape.

    Args:
        depth: (ny, nx) m.
        use: (ny, nx) cells to use.

    Returns:
        Standard deviation of one cell, m; 0 if no two cells lie side by side.
    """
    steps = np.diff(np.where(use, depth, np.nan), axis=1)
    steps = np.abs(steps[np.isfinite(steps)])
    if steps.size == 0:
        return 0.0
    # The median of |a - b| of two normal values is 0.6745 sqrt(2) standard deviations.
    return float(np.median(steps)) / (0.6745 * math.sqrt(2.0))


def _first_plane(
    depth: FloatArray,
    use: BoolArray,
    x: FloatArray,
    y: FloatArray,
    *,
    noise: float,
    rng: np.random.Generator,
) -> FloatArray:
    """Returns the heights of the plane that most cells share within a fine threshold.

    Between a wall and a door 2 cm deeper least squares would lie between the two.
    """
    rows, columns = np.nonzero(use)
    step = max(1, rows.size // _START_POINTS)
    rows, columns = rows[::step], columns[::step]
    points = np.stack([x[columns], y[rows], depth[rows, columns]])
    threshold = max(_START_THRESHOLD, 3.0 * noise)
    found = ransac_plane(points, threshold=threshold, rng=rng)
    flat = np.full(depth.shape, float(np.median(points[2])))
    if found is None:
        return flat
    plane, inliers = found
    nx, ny, nz = plane.normal
    if inliers.mean() < _LEAST_SHARE or abs(nz) < math.cos(math.radians(30.0)):
        return flat
    height: FloatArray = (
        plane.offset - nx * x[np.newaxis] - ny * y[:, np.newaxis]
    ) / nz
    return height


def _block_medians(depth: FloatArray, step: int) -> FloatArray:
    """Returns the medians of blocks of step x step cells; NaN where all are."""
    if step == 1:
        return depth
    ny, nx = (-(-size // step) for size in depth.shape)
    padded = np.full((ny * step, nx * step), np.nan)
    padded[: depth.shape[0], : depth.shape[1]] = depth
    blocks = padded.reshape(ny, step, nx, step).transpose(0, 2, 1, 3)
    blocks = np.sort(blocks.reshape(ny, nx, -1), axis=2)  # NaN comes last.
    known = np.count_nonzero(np.isfinite(blocks), axis=2)
    middle = np.maximum(known - 1, 0) // 2
    medians: FloatArray = np.take_along_axis(blocks, middle[..., np.newaxis], axis=2)
    return medians[..., 0]


def _centres(count: int, cell: float) -> FloatArray:
    centres: FloatArray = (np.arange(count, dtype=np.float64) + 0.5) * cell
    return centres


def _basis(at: FloatArray, x: FloatArray) -> FloatArray:
    """Returns the cubic B-splines (n, k) at some places, on even knots that cover x."""
    count = max(1, math.ceil((x[-1] - x[0]) / _KNOT))
    width = max((x[-1] - x[0]) / count, 1e-9)
    knots = x[0] + width * np.arange(-3, count + 4)
    inside = np.clip(at, x[0], x[0] + count * width * (1.0 - 1e-12))
    matrix: FloatArray = BSpline.design_matrix(inside, knots, 3).toarray()
    return matrix


class _Fit:
    """Weighted, penalised least squares of tensor-product splines on a grid.

    The normal matrix is built from the products of pairs of splines along each axis,
    without ever forming the (cells x coefficients) matrix.
    """

    def __init__(self, along: FloatArray, across: FloatArray) -> None:
        """Takes the splines along y, (ny, ky), and along x, (nx, kx)."""
        self.along, self.across = along, across
        ky, kx = along.shape[1], across.shape[1]
        self._pairs_y = np.einsum("ia,ib->iab", along, along).reshape(-1, ky * ky)
        self._pairs_x = np.einsum("ja,jb->jab", across, across).reshape(-1, kx * kx)
        self._rough = np.kron(_roughness(ky), np.eye(kx))
        self._rough += np.kron(np.eye(ky), _roughness(kx))

    def solve(
        self, weight: FloatArray, values: FloatArray, penalty: float
    ) -> FloatArray:
        """Returns the coefficients (ky, kx)."""
        ky, kx = self.along.shape[1], self.across.shape[1]
        normal = (self._pairs_y.T @ weight @ self._pairs_x).reshape(ky, ky, kx, kx)
        normal = normal.transpose(0, 2, 1, 3).reshape(ky * kx, ky * kx)
        right = (self.along.T @ (weight * values) @ self.across).ravel()
        normal += penalty * self._rough + _RIDGE * np.eye(ky * kx)
        solved: FloatArray = np.linalg.solve(normal, right)
        return solved.reshape(ky, kx)


def _roughness(count: int) -> FloatArray:
    """Returns the matrix whose quadratic form sums squared third differences."""
    differences = np.diff(np.eye(count), n=3, axis=0)
    matrix: FloatArray = differences.T @ differences
    return matrix
