"""One smooth piece of a wall: a spline through patches within which nothing steps.

Source: Beaton and Tukey, "The fitting of power series", 1974 (biweight); for the
splines see `perception.fine_steps.spline_surface`.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt

from perception.fine_steps.spline_surface import SplineSurface
from perception.ground import BoolArray, FloatArray, IntArray
from perception.paper_steps.planes import ransac_plane

_KNOTS = (0.25, 0.125)
"""Distance of knots, m. The spline follows waves from about three times that length and
bridges a plate of 0.2 m; closer knots are for walls that need them."""
_SCATTER, _FOLLOWED = 0.0012, 2.5
"""A surface fits if the wall scatters about it by less than this, m, or than so many
times the noise."""
_MOST_SPLINES = 4096
"""256 m² at 0.25 m; on larger tiles the knots lie farther apart."""
_FINEST = 0.2
"""Blocks larger than this share of the closer knots' distance cannot place a step; the
spline would follow things on the wall."""
_PENALTIES = (1e6, 1e3, 1.0, 1e-2)
"""Weight of the penalty against that of a cell: from a quadratic to the spline."""
_MOST_REPEATS = 30
_GROWN = 1.001  # Growth of the weighted cells below which a fit has converged.
_START_POINTS = 20_000
_START_THRESHOLD = 0.004
_LEAST_WINDOW = 0.003
"""Cells off by more than a few times the noise, but at least this, lose weight, m."""
_WINDOWS = (16.0, 10.0, 6.0)
"""The same in standard deviations of the noise, from the first fits to the last."""
_WIDE = 4.5  # Median deviations within which cells keep weight in early fits.
_LEAST_PATCH = 0.002  # m²
_SWAY = 0.02  # Error of an extrapolated surface, m for each metre.
_LEAST_FACING = math.cos(math.radians(60.0))


@dataclass(frozen=True, eq=False)
class Blocks:
    """Medians of square blocks of cells: splines do not need every cell.

    Attributes:
        depth: (my, mx) m, NaN = nothing seen.
        patches: (my, mx) from `smooth_patches`.
        y: (my,) m, centres.
        x: (mx,) m, centres.
        within: (2, 2) m, first and last cell's centre along y and x.
        cell: Edge of a block, m.
        noise: Standard deviation of a block's depth, m.
        rng: Source of random triples.
    """

    depth: FloatArray
    patches: IntArray
    y: FloatArray
    x: FloatArray
    within: FloatArray
    cell: float
    noise: float
    rng: np.random.Generator

    @property
    def limit(self) -> float:
        """How far from a surface a block is still level with it, m."""
        return max(_LEAST_WINDOW, _WINDOWS[-1] * self.noise)


@dataclass(frozen=True, eq=False)
class Piece:
    """One smooth part of the wall.

    Attributes:
        cells: (my, mx) blocks of its patches.
        height: (my, mx) m, its surface.
        spline: Its splines and their coefficients.
        coefficients: See `SplineSurface`.
    """

    cells: BoolArray
    height: FloatArray
    spline: SplineSurface
    coefficients: FloatArray


def fit_piece(blocks: Blocks, cells: BoolArray) -> Piece:
    """Fits a surface to connected blocks, with no closer knots than needed.

    Args:
        blocks: Depths over the tile.
        cells: (my, mx) the blocks to fit to, at least one.

    Returns:
        The piece.

    Raises:
        ValueError: There is no surface in them.
    """
    height = plane_heights(blocks, cells)
    least = math.sqrt(float(np.prod(np.ptp(blocks.within, axis=1))) / _MOST_SPLINES)
    for distance in _KNOTS:
        knot = max(distance, least)
        spline = SplineSurface(blocks.y, blocks.x, within=blocks.within, knot=knot)
        piece = _settle(spline, blocks, cells, height, penalties=_PENALTIES)
        # 1.282: eight tenths of a normal variable are closer to its mean.
        off = np.abs(blocks.depth - piece.height)[cells]
        scatter = float(np.quantile(off, 0.8)) / 1.282
        even = scatter <= max(_SCATTER, _FOLLOWED * blocks.noise)
        if even or blocks.cell > _FINEST * _KNOTS[-1]:
            break
    return piece


def _settle(
    spline: SplineSurface,
    blocks: Blocks,
    cells: BoolArray,
    height: FloatArray,
    *,
    penalties: tuple[float, ...],
) -> Piece:
    """Fits softer and softer splines, with weights by the fit before.

    Raises:
        ValueError: No cell is near the surface.
    """
    values = np.where(cells, blocks.depth, 0.0)
    for penalty in penalties:
        for window in _WINDOWS:
            followed = 0
            for _ in range(_MOST_REPEATS):
                off = np.abs(values - height)
                # Stiff splines cannot follow bends yet: cells there are no outliers.
                scatter = _WIDE * float(np.median(off[cells]))
                least = _LEAST_WINDOW * window / _WINDOWS[-1]
                limit = max(least, window * blocks.noise, scatter)
                off = np.where(cells, off / limit, 1.0)
                weight = np.square(np.maximum(1.0 - off * off, 0.0))
                count = int(np.count_nonzero(weight))
                if not count:
                    raise ValueError("the wall's cells lie on no surface.")
                coefficients = spline.solve(weight, values, penalty)
                height = spline.heights(coefficients)
                # The surface grows along a wave from where it already fits.
                if count <= _GROWN * followed:
                    break
                followed = count
    return Piece(cells, height, spline, coefficients)


def extend_piece(piece: Piece, blocks: Blocks) -> Piece:
    """Adds the neighbouring patches that continue a piece's surface.

    The farther the surface is extrapolated, the larger its error may be.

    Args:
        piece: Fitted to some of the blocks.
        blocks: Depths over the tile.

    Returns:
        The piece with all of them.

    Raises:
        ValueError: There is no surface in them.
    """
    known = blocks.patches >= 0
    count = np.bincount(blocks.patches[known])
    large = count * blocks.cell**2 >= _LEAST_PATCH
    while True:
        distance = distance_transform_edt(~piece.cells, sampling=blocks.cell)
        with np.errstate(invalid="ignore"):
            off = np.abs(blocks.depth - piece.height) - _SWAY * distance
        level = blocks.patches[known & (off <= blocks.limit)]
        share = np.bincount(level, minlength=count.size) / np.maximum(count, 1)
        more = np.append((share > 0.5) & large, False)[blocks.patches] & ~piece.cells
        if not more.any():
            return piece
        piece = _settle(
            piece.spline,
            blocks,
            piece.cells | more,
            piece.height,
            penalties=_PENALTIES[-1:],
        )


def plane_heights(blocks: Blocks, use: BoolArray) -> FloatArray:
    """Finds the plane that most blocks share within a fine threshold.

    Between a wall and a door 2 cm deeper least squares would lie between the two.

    Args:
        blocks: Depths over the tile.
        use: (my, mx) the blocks to use, at least one.

    Returns:
        (my, mx) m, the plane's heights; without such a plane, the median everywhere.
    """
    rows, columns = np.nonzero(use)
    step = max(1, rows.size // _START_POINTS)
    rows, columns = rows[::step], columns[::step]
    points = np.stack([blocks.x[columns], blocks.y[rows], blocks.depth[rows, columns]])
    threshold = max(_START_THRESHOLD, 3.0 * blocks.noise)
    found = ransac_plane(points, threshold=threshold, rng=blocks.rng)
    if found is None or abs(found[0].normal[2]) < _LEAST_FACING:
        return np.full(use.shape, float(np.median(points[2])))
    nx, ny, nz = found[0].normal
    height: FloatArray = (
        found[0].offset - nx * blocks.x[np.newaxis] - ny * blocks.y[:, np.newaxis]
    ) / nz
    return height


def surface_normals(height: FloatArray, cell: float) -> FloatArray:
    """Returns the normals of a surface.

    Args:
        height: (ny, nx) m along T z.
        cell: Edge of a cell, m.

    Returns:
        (ny, nx, 3) unit, in T, towards the robot.
    """
    slopes = [np.gradient(height, cell, axis=axis) for axis in (1, 0)]
    normals = np.stack([-slopes[0], -slopes[1], np.ones_like(height)], axis=-1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    return normals
