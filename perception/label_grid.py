"""Step 3 of the segmentation: labels and depths of points on a grid over the tile."""

from dataclasses import dataclass

import numpy as np

from perception.values import BoolArray, FloatArray, FrozenValue, IntArray

NOTHING = -1  # Label of a cell without a point; 0 is a point of no plane.
# Depths are summed in these steps, m: 2^53 of them, as many as a float counts exactly,
# are the depths of a million points 2 m from the wall.
_QUANTUM = 2.0**-32


@dataclass(frozen=True, eq=False)
class LabelGrid(FrozenValue):
    """Plane labels and depths over the tile; row 0 is the bottom row.

    Attributes:
        labels: (ny, nx) label of the cell's chosen point; NOTHING = no point.
        depth: (ny, nx) m along T z, of the same point; NaN = no point.
        cell: Edge of a cell, m.
    """

    labels: IntArray
    depth: FloatArray
    cell: float


def label_grid(
    p_TQs: FloatArray, labels: IntArray, *, width: float, height: float, cell: float
) -> LabelGrid:
    """Gives each cell the label and depth of its point closest to the mean depth.

    Equations 4 and 5 of the paper are misprinted and read as follows.

    - Equation 4 compares the square roots of X + Y of a point and of GX + GY of a cell.
      These are no distances: x + y is the same along whole diagonals of the tile, and
      its root is not even real left of the origin. Squares under the roots, making
      them distances from the origin, would collect rings. The length of the offset,
      |(X - GX, Y - GY)| <= 0.01 sqrt(2) / 2, is the circle around the cell's square,
      and such circles overlap. The text says "all available points belonging to each
      1 x 1 cm pixel": so a cell collects the points above its square, left and lower
      edge included, and every point belongs to one cell.
    - Equation 5 gives Z2d(x, y) = X(i*); the text says that the cell inherits "the
      Z axis for the selected point", so it is Z(i*). The mean of Z is over the cell's
      points of all labels, and a cell without a point has neither label nor depth.

    Of two points equally close to the mean, the one nearer to the robot counts (the gun
    meets it first), then the one of the smaller label; so the grid does not depend on
    the points' order.

    Source: Tadic et al., "Painting Robot with RealSense D435", 2021, equations 4 and 5.

    Args:
        p_TQs: (3, N) finite, m, in T; points beside the tile are left out.
        labels: (N,) of the points, >= 0.
        width: Of the tile, m, along T x.
        height: Of the tile, m, along T y.
        cell: Edge of a cell, m.

    Returns:
        The grid, (round(height / cell), round(width / cell)).
    """
    cells, shape = _cells_of(p_TQs, width=width, height=height, cell=cell)
    index = np.flatnonzero(cells >= 0)
    own, z, tags = cells[index], p_TQs[2, index], labels[index]
    size = shape[0] * shape[1]
    grid_labels = np.full(size, NOTHING, dtype=np.int64)
    grid_depth = np.full(size, np.nan)
    # Sums of whole quanta are exact, so the means are the same for any input order.
    sums = np.bincount(own, weights=np.rint(z / _QUANTUM), minlength=size)
    means = sums / np.maximum(1, np.bincount(own, minlength=size)) * _QUANTUM
    off = np.abs(z - means[own])
    least = np.full(size, np.inf)
    np.minimum.at(least, own, off)
    closest = np.flatnonzero(off == least[own])
    # Few are equally close: the last that is written to a cell stays.
    order = closest[np.lexsort((-tags[closest], z[closest]))]
    grid_labels[own[order]] = tags[order]
    grid_depth[own[order]] = z[order]
    return LabelGrid(grid_labels.reshape(shape), grid_depth.reshape(shape), cell)


def visible_points(
    p_TQs: FloatArray, *, width: float, height: float, cell: float, tolerance: float
) -> BoolArray:
    """Finds the points that nothing stands in front of, as the gun sees them.

    Through a window the camera sees, at a slant, things behind the wall beside the
    window. Straight on they would share cells with the wall and pull the mean depth
    there to between the two. The gun, square to the wall, meets the foremost surface:
    points deeper than that by more than `tolerance` are hidden.

    Args:
        p_TQs: (3, N) finite, m, in T.
        width: Of the tile, m.
        height: Of the tile, m.
        cell: Edge of a cell, m.
        tolerance: What still counts as the same surface, m.

    Returns:
        (N,) True = visible; points beside the tile are.
    """
    cells, shape = _cells_of(p_TQs, width=width, height=height, cell=cell)
    inside = cells >= 0
    front = np.full(shape[0] * shape[1], -np.inf)
    np.maximum.at(front, cells[inside], p_TQs[2, inside])
    visible = np.ones(cells.size, dtype=np.bool_)
    visible[inside] = p_TQs[2, inside] >= front[cells[inside]] - tolerance
    return visible


def _cells_of(
    p_TQs: FloatArray, *, width: float, height: float, cell: float
) -> tuple[IntArray, tuple[int, int]]:
    """Numbers each point's cell row by row, -1 beside the tile; and (ny, nx)."""
    nx, ny = round(width / cell), round(height / cell)
    if nx < 1 or ny < 1:
        raise ValueError(f"a tile of {width} x {height} m has no cell of {cell} m.")
    columns, rows = np.floor(p_TQs[:2] / cell).astype(np.int64)
    inside = (columns >= 0) & (columns < nx) & (rows >= 0) & (rows < ny)
    return np.where(inside, rows * nx + columns, -1), (ny, nx)
