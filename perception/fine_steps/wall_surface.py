"""The wall's own surface over the tile: flat, bulged, twisted, wavy or bent in corners.

The depths split into patches without a step inside. A spline is fitted to the patch of
the wall by iteratively reweighted least squares with Tukey's biweight, and patches that
continue it join it. A large patch that meets the wall in an edge without a step is
another wall in a corner, with a surface of its own.

A moulding is wall where the surface follows it: gentle in slope and wider than about
half a metre. A sharp rise is a step, however low, and not part of the surface.

Source: Beaton and Tukey, "The fitting of power series", 1974 (biweight); for the
splines see `perception.fine_steps.spline_surface`.
"""

import dataclasses
import math
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from scipy.ndimage import distance_transform_edt

from perception.fine_steps.smooth_patches import smooth_patches
from perception.fine_steps.wall_corners import part_at_corners
from perception.fine_steps.wall_piece import (
    Blocks,
    Piece,
    extend_piece,
    fit_piece,
    surface_normals,
)
from perception.ground import BoolArray, FloatArray, FrozenValue, IntArray

_FIT_CELL = 0.02
_MOST_FIT_CELL = 0.125
_NEIGHBOURED = 0.9
"""Share of blocks beside which there is another, from which they show steps."""
_EDGE_BLOCKS = 3.0
_LEAST_CELLS = 500
Grid = TypeVar("Grid", BoolArray, FloatArray)
_NEAR = 0.03  # Standard deviation about T's plane within which the wall is searched.


@dataclass(frozen=True, eq=False)
class WallSurface(FrozenValue):
    """Surface of the wall at the centres of a grid's cells, also where it is hidden.

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
    y, x = (_centres(count, cell) for count in depth.shape)
    step = max(1, round(_FIT_CELL / cell))
    if np.count_nonzero(use) < _LEAST_CELLS * step**2:
        step = 1
    medians = _block_medians(depth, step)
    while _neighboured(medians) < _NEIGHBOURED and step * cell < _MOST_FIT_CELL:
        step += 1  # Between scan lines there are cells without a point.
        medians = _block_medians(depth, step)
    # Over such blocks the slope of waves is no longer small.
    spread = neighbour_noise(medians, np.isfinite(medians), order=2)
    blocks = Blocks(
        depth=medians,
        patches=smooth_patches(medians, noise=spread),
        y=_centres(medians.shape[0], step * cell),
        x=_centres(medians.shape[1], step * cell),
        within=np.array([y[[0, -1]], x[[0, -1]]]),
        cell=step * cell,
        noise=spread,
        rng=rng,
    )
    may_be = np.isfinite(_block_medians(np.where(use, depth, np.nan), step))
    patch = _patch_of_wall(blocks, may_be)
    parts = part_at_corners(blocks, patch)
    if len(parts) == 1:
        parts = [patch & may_be]
    # No piece continues into another's patches.
    others = np.unique(blocks.patches[np.any(parts, axis=0)])
    free = np.where(np.isin(blocks.patches, others), -1, blocks.patches)
    blocks = dataclasses.replace(blocks, patches=free)
    pieces = [extend_piece(fit_piece(blocks, cells), blocks) for cells in parts]
    heights = np.stack(
        [piece.spline.heights_at(y, x, piece.coefficients) for piece in pieces]
    )
    normals = np.stack([surface_normals(height, cell) for height in heights])
    owner = _owners(pieces, heights, blocks, y, x)[np.newaxis]
    height = np.take_along_axis(heights, owner, axis=0)[0]
    normal = np.take_along_axis(normals, owner[..., np.newaxis], axis=0)[0]
    return WallSurface(height=height, normals=normal, noise=neighbour_noise(depth, use))


def neighbour_noise(depth: FloatArray, use: BoolArray, *, order: int = 1) -> float:
    """Estimates the noise of depths from the differences of cells side by side.

    The median rejects steps, and differences of neighbours the wall's shape.

    Args:
        depth: (ny, nx) m.
        use: (ny, nx) cells to use.
        order: Of the differences; the second do not see slopes.

    Returns:
        Standard deviation of one cell, m; 0 if no two cells lie side by side.
    """
    steps = np.diff(np.where(use, depth, np.nan), n=order, axis=1)
    steps = np.abs(steps[np.isfinite(steps)])
    if steps.size == 0:
        return 0.0
    # The median of |a - b| of two normal values is 0.6745 sqrt(2) standard deviations,
    # that of |a - 2 b + c| 0.6745 sqrt(6).
    scale = math.sqrt(math.comb(2 * order, order))
    return float(np.median(steps)) / (0.6745 * scale)


def _patch_of_wall(blocks: Blocks, may_be: BoolArray) -> BoolArray:
    """Returns the blocks of the patch that most of the wall's plane lies in."""
    near = np.exp(-0.5 * np.square(blocks.depth[may_be] / _NEAR))
    share = np.bincount(blocks.patches[may_be], near)
    main: BoolArray = blocks.patches == int(share.argmax())
    return main


def _owners(
    pieces: list[Piece],
    heights: FloatArray,
    blocks: Blocks,
    y: FloatArray,
    x: FloatArray,
) -> IntArray:
    """Returns (ny, nx): the piece that each cell belongs to.

    That is the one with the nearest blocks. Along an edge, where blocks are too coarse,
    it is the nearer surface in an inner corner and the farther one in an outer corner.
    """
    rows = np.minimum((y / blocks.cell).astype(np.int64), blocks.y.size - 1)
    columns = np.minimum((x / blocks.cell).astype(np.int64), blocks.x.size - 1)
    distances = np.stack(
        [
            distance_transform_edt(~piece.cells)[np.ix_(rows, columns)]
            for piece in pieces
        ]
    )
    owner = np.asarray(distances.argmin(axis=0), dtype=np.int64)
    for number, piece in enumerate(pieces[1:], start=1):
        rise = np.median((piece.height - pieces[0].height)[piece.cells])
        edge = np.isin(owner, (0, number))
        edge &= np.abs(distances[number] - distances[0]) <= _EDGE_BLOCKS
        own = (heights[number] > heights[0]) == (rise > 0.0)
        owner[edge] = np.where(own, number, 0)[edge]
    return owner


def blocks_of(grid: Grid, size: int) -> Grid:
    """Cuts a grid into square blocks.

    Args:
        grid: (ny, nx).
        size: Edge of a block, cells. Only a grid of numbers may end within a block.

    Returns:
        (my, mx, size²) the cells of each block; NaN beyond the grid.
    """
    beyond = [(0, -count % size) for count in grid.shape]
    if np.any(beyond):
        grid = np.pad(grid, beyond, constant_values=np.nan)
    ny, nx = (count // size for count in grid.shape)
    blocks = grid.reshape(ny, size, nx, size).transpose(0, 2, 1, 3)
    return blocks.reshape(ny, nx, size**2)


def _block_medians(depth: FloatArray, step: int) -> FloatArray:
    """Returns the medians of blocks of step x step cells; NaN where all are."""
    if step == 1:
        return depth
    blocks = np.sort(blocks_of(depth, step), axis=2)  # NaN comes last.
    known = np.count_nonzero(np.isfinite(blocks), axis=2)
    # The mean of the two in the middle: the lower one alone sinks on a slope.
    middle = [np.maximum(known - 1, 0) // 2, known // 2]
    medians = np.take_along_axis(blocks, np.stack(middle, axis=-1), axis=2)
    return np.asarray(medians.mean(axis=2))


def _neighboured(depth: FloatArray) -> float:
    """Returns the share of known cells that have a known one on their right and above.

    Along scan lines there are neighbours on two sides and between them none.
    """
    known = np.isfinite(depth)
    count = max(1, int(np.count_nonzero(known)))
    right = np.count_nonzero(known[:, :-1] & known[:, 1:])
    above = np.count_nonzero(known[:-1] & known[1:])
    return min(right, above) / count


def _centres(count: int, cell: float) -> FloatArray:
    centres: FloatArray = (np.arange(count, dtype=np.float64) + 0.5) * cell
    return centres
