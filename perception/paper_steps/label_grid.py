"""Step 3 of the segmentation: labels and depths of points on a grid over the tile."""

import math
from dataclasses import dataclass

import numpy as np

from perception.ground import FloatArray, FrozenValue, IntArray
from perception.values import TileSize

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
    p_TQs: FloatArray,
    labels: IntArray,
    tile: TileSize,
    *,
    cell: float,
    hidden: float = math.inf,
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

    Through a window the camera sees, at a slant, things behind the wall beside the
    window. Straight on they would share cells with the wall and pull the mean depth
    there to between the two. The gun, square to the wall, meets the foremost surface:
    points far behind that can be left out.

    Source: Tadic et al., "Painting Robot with RealSense D435", 2021, equations 4 and 5;
    the paper keeps all points.

    Args:
        p_TQs: (3, N) finite, m, in T; points beside the tile are left out.
        labels: (N,) of the points, >= 0.
        tile: Its size.
        cell: Edge of a cell, m.
        hidden: Points deeper than the foremost of their cell by more are left out, m.

    Returns:
        The grid, of the shape `tile.shape(cell)`.

    Raises:
        ValueError: The tile is smaller than a cell.
    """
    ny, nx = tile.shape(cell)
    if nx < 1 or ny < 1:
        raise ValueError(
            f"a tile of {tile.width} x {tile.height} m has no cell of {cell} m."
        )
    size = nx * ny
    # Axis by axis, whatever the caller's order.
    columns, rows = np.ascontiguousarray(p_TQs[:2]) / cell
    inside = (columns >= 0.0) & (columns < nx) & (rows >= 0.0) & (rows < ny)
    columns, rows, z, tags = (
        values.compress(inside) for values in (columns, rows, p_TQs[2], labels)
    )
    own = rows.astype(np.int64) * nx + columns.astype(np.int64)
    front = np.full(size, -np.inf)
    np.maximum.at(front, own, z)
    visible = z >= front.take(own) - hidden
    own, z, tags = (values.compress(visible) for values in (own, z, tags))
    grid_labels = np.full(size, NOTHING, dtype=np.int64)
    grid_depth = np.full(size, np.nan)
    # Sums of whole quanta are exact, so the means are the same for any input order.
    sums = np.bincount(own, weights=np.rint(z / _QUANTUM), minlength=size)
    means = sums / np.maximum(1, np.bincount(own, minlength=size)) * _QUANTUM
    off = np.abs(z - means.take(own))
    least = np.full(size, np.inf)
    np.minimum.at(least, own, off)
    closest = np.flatnonzero(off == least.take(own))
    # Few are equally close: the last that is written to a cell stays.
    order = closest[np.lexsort((-tags[closest], z[closest]))]
    grid_labels[own[order]] = tags[order]
    grid_depth[own[order]] = z[order]
    shape = (ny, nx)
    return LabelGrid(grid_labels.reshape(shape), grid_depth.reshape(shape), cell)
