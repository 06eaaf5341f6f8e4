"""Which cells are wall at their centres, by the votes of the points around them.

A cell is painted or not as a whole, by what lies at its centre. So points are weighted
by their distance from the centre, whether they lie in the cell or beside it. The votes
of both sides of a straight edge balance on the edge itself.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

from perception.fine_steps.steps import StepDetection, SubCells
from perception.fine_steps.wall_surface import WallSurface
from perception.ground import BoolArray, FloatArray, FrozenValue

_NODES = 4
"""Nodes along a cell's edge of the grid that votes are added up on."""
_REACH = 1.0
"""Standard deviation of the weights of votes against the spacing of points."""


@dataclass(frozen=True, eq=False)
class Votes(FrozenValue):
    """Points that are not hidden, each for or against wall.

    Attributes:
        p_TQs: (2, M) m, in T.
        wall: (M,) True = level with the wall's surface.
        weight: (M,) those of one sub-cell add up to 1.
    """

    p_TQs: FloatArray
    wall: BoolArray
    weight: FloatArray


def point_votes(cells: SubCells, steps: StepDetection, surface: WallSurface) -> Votes:
    """Returns the votes of all points that are not hidden.

    Args:
        cells: Foremost surface.
        steps: Its steps.
        surface: The wall's own surface, on the grid of `cells`.
    """
    index = cells.index
    residual = cells.p_TQs[2] - surface.height.ravel()[index]
    # A step that shows in the mean alone shows in no point.
    low = ~steps.level & (np.abs(steps.residual) <= steps.bound)
    wall = (np.abs(residual) <= steps.bound.ravel()[index]) & ~low.ravel()[index]
    return Votes(
        p_TQs=cells.p_TQs[:2].copy(),
        wall=wall,
        weight=1.0 / np.bincount(index, minlength=1)[index],
    )


def wall_share(
    votes: Votes, shape: tuple[int, int], *, cell: float, spacing: float
) -> FloatArray:
    """Counts the votes at the centre of each cell.

    Args:
        votes: Of the points.
        shape: Rows and columns of the grid of cells.
        cell: Edge of a cell, m.
        spacing: Typical distance of points, m.

    Returns:
        (ny, nx) share of the votes that is for wall; 0 where no point is near.
    """
    ny, nx = shape
    x, y = votes.p_TQs * (_NODES / cell)
    columns, rows = np.floor([x, y]).astype(np.int64)
    right, up = x - columns, y - rows
    total = np.zeros((2, (_NODES * ny + 1) * (_NODES * nx + 1)))
    for row, along in ((rows, 1.0 - up), (rows + 1, up)):
        for column, across in ((columns, 1.0 - right), (columns + 1, right)):
            node = row * (_NODES * nx + 1) + column
            weight = votes.weight * along * across
            total[0] += np.bincount(node, weight, total.shape[1])
            total[1] += np.bincount(node, weight * votes.wall, total.shape[1])
    sigma = _NODES * _REACH * spacing / cell
    middle = slice(_NODES // 2, None, _NODES)
    every, wall = (
        gaussian_filter(grid, sigma, mode="constant")[middle, middle]
        for grid in total.reshape(2, _NODES * ny + 1, _NODES * nx + 1)
    )
    heard = every > math.exp(-8.0) / (2.0 * math.pi * sigma**2)
    share: FloatArray = np.where(heard, wall / np.where(heard, every, 1.0), 0.0)
    return share
