"""Wall that a scan has left in shadow, on the tile's grid."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt

from perception.fine_steps.unseen import close_gaps, in_shadow
from perception.ground import BoolArray, FloatArray, FrozenValue
from perception.values import TileSize

_RAISED = 0.02
"""Things this far in front of the wall hide more than the width of a cell, m."""
_LEVEL = 0.04
"""The wall's own points lie so near to the plane that it was found on, m."""
_SLIVER = 2.0
"""Shadows no wider than so many cells are no worse than an edge's own error."""


@dataclass(frozen=True, eq=False)
class Relief(FrozenValue):
    """Things and hidden wall on the tile after a scan.

    Attributes:
        height: (ny, nx) m, of raised things; 0 elsewhere.
        hidden: (ny, nx) cells in shadows wider than an edge's own error.
        cell: Edge of a cell, m.
    """

    height: FloatArray
    hidden: BoolArray
    cell: float


def find_relief(
    p_TQs: FloatArray,
    p_TCs: FloatArray,
    tile: TileSize,
    *,
    cell: float,
) -> Relief:
    """Lays a map on the tile's grid and finds the wall in shadow.

    Args:
        p_TQs: (3, N) m, in T: surface points, denser than the grid.
        p_TCs: (3, k) m, in T: camera centres.
        tile: Its size.
        cell: Edge of a cell, m.
    """
    ny, nx = tile.shape(cell)
    columns, rows = np.floor(p_TQs[:2] / cell).astype(np.int64)
    inside = (columns >= 0) & (columns < nx) & (rows >= 0) & (rows < ny)
    top = np.full((ny, nx), -np.inf)
    np.maximum.at(top, (rows[inside], columns[inside]), p_TQs[2, inside])
    seen = np.isfinite(top)
    level = seen & (np.abs(top) < _LEVEL)
    residual = top - (float(np.median(top[level])) if level.any() else 0.0)
    raised = seen & (residual > _RAISED)
    hole = ~seen & ~close_gaps(seen, spacing=0.0, cell=cell)
    residual[~seen] = np.nan
    shadow = in_shadow(hole, raised, residual, cell=cell, p_TCs=p_TCs)
    lit = distance_transform_edt(~(seen & ~raised))
    return Relief(
        height=np.where(raised, residual, 0.0),
        hidden=shadow & (lit > _SLIVER),
        cell=cell,
    )
