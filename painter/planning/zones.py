"""Zones in which the operator wants paint, or none."""

from collections.abc import Sequence

import numpy as np
from matplotlib.path import Path

from painter.planning.config import ZoneConfig
from painter.planning.tile import cell_centres
from perception.values import BoolArray


def in_zones(mask: BoolArray, cell: float, zones: Sequence[ZoneConfig]) -> BoolArray:
    """Returns the cells of a mask that zones leave to be painted.

    Args:
        mask: (ny, nx) bool, True = to be painted.
        cell: Edge of a cell, m.
        zones: Included cells are those inside any zone to include, if there is one,
            and outside all zones to exclude; a cell's centre decides.

    Returns:
        (ny, nx) bool.
    """
    included = [_inside(mask, cell, zone) for zone in zones if zone.kind == "include"]
    excluded = [_inside(mask, cell, zone) for zone in zones if zone.kind == "exclude"]
    marked = mask & np.any(included, axis=0) if included else mask
    return np.asarray(marked & ~np.any(excluded, axis=0) if excluded else marked)


def _inside(mask: BoolArray, cell: float, zone: ZoneConfig) -> BoolArray:
    x, y = cell_centres((mask.shape[0], mask.shape[1]), cell)
    points = np.stack([part.ravel() for part in np.meshgrid(x, y)], axis=1)
    corners = np.asarray(zone.corners, dtype=np.float64)
    if len(corners) == 2:
        inside = (points >= corners.min(axis=0)) & (points <= corners.max(axis=0))
        return np.asarray(inside.all(axis=1).reshape(mask.shape))
    return np.asarray(Path(corners).contains_points(points).reshape(mask.shape))
