"""Zones that the operator includes or excludes, and marks on a tile."""

from collections.abc import Sequence

import numpy as np
from matplotlib.path import Path
from numpy.typing import ArrayLike

from painter.planning.config import ZoneConfig
from painter.planning.tile import cell_centres, grid_points
from perception.ground import BoolArray, FloatArray


def in_zones(mask: BoolArray, cell: float, zones: Sequence[ZoneConfig]) -> BoolArray:
    """Returns the cells of a mask that zones leave to be painted.

    Args:
        mask: (ny, nx) bool, True = to be painted.
        cell: Edge of a cell, m.
        zones: A cell stays if its centre is inside any "include" zone, or there is
            none, and outside all "exclude" zones.

    Returns:
        (ny, nx) bool.
    """
    p_TQs = grid_points(*cell_centres((mask.shape[0], mask.shape[1]), cell))
    return mask & points_in_zones(p_TQs[:2].T, zones).reshape(mask.shape)


def points_in_zones(points_T: FloatArray, zones: Sequence[ZoneConfig]) -> BoolArray:
    """Returns which points (k, 2), m, in T, zones leave to paint; see `in_zones`."""
    marked = np.ones(len(points_T), dtype=bool)
    included = [zone.corners for zone in zones if zone.kind == "include"]
    if included:
        marked &= np.any([inside(corners, points_T) for corners in included], axis=0)
    for zone in zones:
        if zone.kind == "exclude":
            marked &= ~inside(zone.corners, points_T)
    return marked


def marked_cells(
    corners_T: ArrayLike, shape: tuple[int, int], cell: float
) -> BoolArray:
    """Returns the cells of a tile whose centres lie inside a mark.

    Args:
        corners_T: See `inside`.
        shape: (ny, nx) of the tile's grid.
        cell: Edge of a cell, m.
    """
    p_TQs = grid_points(*cell_centres(shape, cell))
    return inside(corners_T, p_TQs[:2].T).reshape(shape)


def inside(corners_T: ArrayLike, points_T: FloatArray) -> BoolArray:
    """Returns which points lie inside a mark.

    Args:
        corners_T: (n, 2) m, in T: two opposite corners of a rectangle, or the three or
            more corners of a polygon.
        points_T: (k, 2) m, in T.

    Returns:
        (k,) bool.

    Raises:
        ValueError: There are fewer than two corners.
    """
    corners = np.asarray(corners_T, dtype=np.float64).reshape(-1, 2)
    if len(corners) < 2:
        raise ValueError(f"a mark must have 2 or more corners, got {len(corners)}.")
    if len(corners) == 2:
        within = (points_T >= corners.min(axis=0)) & (points_T <= corners.max(axis=0))
        return np.asarray(within.all(axis=1))
    return np.asarray(Path(corners).contains_points(points_T))
