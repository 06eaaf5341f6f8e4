"""The wall tile: its nominal pose and its grids.

T has its origin at the tile's lower-left corner as seen by the robot, x right, y up, z
out of the wall towards the robot. Grids over T have shape (ny, nx), row 0 at the
bottom.
"""

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from painter.planning.config import TileConfig
from perception.ground import FloatArray

# Columns are T x, y and z in W: a plumb wall across W x, seen from the arm's base.
_R_WT_NOMINAL = np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


def nominal_tile_pose(tile: TileConfig) -> RigidTransform:
    """Returns the pose at which the job expects the tile: plumb and square to the arm.

    Args:
        tile: Size and place of the tile; it is centred on the arm's base axis.

    Returns:
        X_WT, with T's origin at W [distance, width / 2, bottom].
    """
    p_WT = [tile.distance, tile.width / 2.0, tile.bottom]
    return RigidTransform(RotationMatrix(_R_WT_NOMINAL), p_WT)


def grid_shape(tile: TileConfig, cell: float) -> tuple[int, int]:
    """Returns (ny, nx) of the tile's grid of square cells of edge `cell`, m."""
    return round(tile.height / cell), round(tile.width / cell)


def cell_centres(
    shape: tuple[int, int], cell: float, *, margin: float = 0.0
) -> tuple[FloatArray, FloatArray]:
    """Returns the coordinates of a grid's cell centres in T.

    Args:
        shape: (ny, nx) of the grid.
        cell: Edge of a cell, m.
        margin: How far left of and below T's origin the grid begins, m.

    Returns:
        x (nx,) of the columns and y (ny,) of the rows, m, in T.
    """
    ny, nx = shape
    x = (np.arange(nx, dtype=np.float64) + 0.5) * cell - margin
    y = (np.arange(ny, dtype=np.float64) + 0.5) * cell - margin
    return x, y


def grid_points(
    x: FloatArray, y: FloatArray, z: FloatArray | float = 0.0
) -> FloatArray:
    """Returns a grid's points as one set.

    Args:
        x: (nx,) m, in T.
        y: (ny,) m, in T.
        z: (ny, nx) m, in T, or one height for all.

    Returns:
        p_TQs, (3, ny * nx) m, row by row; `X_WT @ p_TQs` re-expresses them in W.
    """
    xs, ys = np.meshgrid(x, y)
    zs = np.broadcast_to(z, xs.shape)
    return np.stack([xs.ravel(), ys.ravel(), zs.ravel()])
