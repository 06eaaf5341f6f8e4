"""Straight outlines: parts of the tile that are rectangles get the sides of one.

Most things on a wall or set into it are rectangles. Votes of points round off their
corners; and a side, fitted to all points along it, is known much better than from the
votes of single cells.
"""

import dataclasses
import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.ndimage import binary_fill_holes, find_objects, label

from perception.fine_steps.openings import fit_rectangle
from perception.fine_steps.votes import Votes
from perception.ground import BoolArray, FloatArray

_LEAST_CELLS = 9
_FIT = 0.85
"""Overlap (IoU) of part and rectangle from which the part may be one."""
_BAND = 1.5
"""Distance from a side of the points that it is fitted to, cells."""
_DOUBT = 1.0
"""Distance from a side of the centres of cells that it decides, cells."""
_TURNS = np.deg2rad([0.5, 0.25, 0.12, 0.06])
"""Tried to both sides of the best turn so far, first that which fits the cells best."""
_BETTER = 0.9
"""Share of the wrong points that another turn must get down to."""
_SQUARE = np.ones((3, 3), dtype=np.bool_)


def straighten(level: BoolArray, votes: Votes, *, cell: float) -> BoolArray:
    """Draws the outlines of rectangles straight.

    A part off the wall is a rectangle if one leaves fewer points along the outline on
    the wrong side than the part's cells do.

    Args:
        level: (ny, nx) True = level with the wall, or not known.
        votes: Of the points.
        cell: Edge of a cell, m.

    Returns:
        (ny, nx) the same, where cells beside the sides of rectangles have changed.
    """
    result = level.copy()
    parts, _ = label(~level, structure=_SQUARE)
    p_TQs = votes.p_TQs / cell
    columns, rows = np.floor(p_TQs).astype(np.int64)
    owner = parts[rows, columns]
    for number, window in enumerate(find_objects(parts), start=1):
        region = np.zeros(level.shape, dtype=np.bool_)
        region[window] = binary_fill_holes(parts[window] == number)
        if np.count_nonzero(region) < _LEAST_CELLS:
            continue
        corners, _, fit = fit_rectangle(region, 1.0)
        if fit < _FIT:
            continue
        # Cells of another part are not evidence for this one.
        near = ((owner == 0) | (owner == number)) & _near(p_TQs, window)
        start = _Rectangle.of(corners)
        near[near] = np.abs(start.inside(p_TQs[:, near])) <= 2.0 * _BAND
        points = p_TQs[:, near], votes.wall[near], votes.weight[near]
        own = owner[near] == number
        rectangle = start.through(0.0, *points)
        for step in _TURNS:
            turns = [start.through(rectangle.turn + t, *points) for t in (-step, step)]
            turned = min(turns, key=lambda one: one.wrong)
            if turned.wrong < _BETTER * rectangle.wrong:
                rectangle = turned
        inside = rectangle.inside(points[0])
        band = np.abs(inside) <= _BAND
        wrong = own == points[1]
        if rectangle.wrong <= np.sum((points[2] * wrong)[band]):
            y, x = np.indices(level.shape) + 0.5
            inside = rectangle.inside(np.stack([x.ravel(), y.ravel()]))
            inside = inside.reshape(level.shape)
            doubt = np.abs(inside) <= _DOUBT
            result &= ~(doubt & (inside > 0.0))
            result |= doubt & (inside <= 0.0) & (parts == number)
    return result


def _near(p_TQs: FloatArray, window: tuple[slice, slice]) -> BoolArray:
    """Returns which points lie in a window of cells or up to 3 cells beside it."""
    rows, columns = window
    x, y = p_TQs
    near: BoolArray = (x > columns.start - 3) & (x < columns.stop + 3)
    near &= (y > rows.start - 3) & (y < rows.stop + 3)
    return near


@dataclass(frozen=True)
class _Rectangle:
    """A rectangle, in cells.

    Attributes:
        turn: Against the one it was made from, rad.
        axes: (2, 2) its axes, row by row.
        sides: (2, 2) where it begins and ends along each.
        wrong: Weight of the points near its outline that lie on the wrong side.
    """

    turn: float
    axes: FloatArray
    sides: FloatArray
    wrong: float

    @classmethod
    def of(cls, corners: FloatArray) -> Self:
        """Makes it from corners, (2, 4), counter-clockwise from the lower left."""
        edges = corners[:, [1, 3]] - corners[:, :1]
        lengths = np.linalg.norm(edges, axis=0)
        axes = (edges / lengths).T
        begin = np.diag(axes @ corners[:, [0, 0]])
        sides = np.stack([begin, begin + lengths], axis=1)
        return cls(turn=0.0, axes=axes, sides=sides, wrong=math.inf)

    def through(
        self, turn: float, points: FloatArray, wall: BoolArray, weight: FloatArray
    ) -> Self:
        """Turns it, and moves its sides to where the fewest points are wrong."""
        middle = self.axes.T @ self.sides.mean(axis=1)
        spin = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
        axes = spin @ self.axes
        half = np.diff(self.sides, axis=1) / 2.0 * np.array([-1.0, 1.0])
        sides = (axes @ middle)[:, np.newaxis] + half
        at = axes @ points
        moved = sides.copy()
        for axis, end in np.ndindex(2, 2):
            outward = (-1.0, 1.0)[end]
            out = outward * (at[axis] - sides[axis, end])
            low, high = sides[1 - axis]
            band = (np.abs(out) <= _BAND) & (at[1 - axis] > low) & (at[1 - axis] < high)
            shift = _boundary(out[band], wall[band], weight[band])
            moved[axis, end] += outward * shift
        one = dataclasses.replace(self, turn=turn, axes=axes, sides=moved)
        inside = one.inside(points)
        wrong = (np.abs(inside) <= _BAND) & ((inside > 0.0) == wall)
        return dataclasses.replace(one, wrong=float(weight[wrong].sum()))

    def inside(self, points: FloatArray) -> FloatArray:
        """Returns how far (2, n) points lie inside, cells; outside it is negative."""
        at = self.axes @ points
        depth: FloatArray = np.minimum(
            at - self.sides[:, :1], self.sides[:, 1:] - at
        ).min(axis=0)
        return depth


def _boundary(out: FloatArray, wall: BoolArray, weight: FloatArray) -> float:
    """Returns the place that parts the points outside, of wall, from those inside.

    Where several places do it equally well, as between two points, it is the middle.

    Args:
        out: (n,) where the points lie along a line that leads out.
        wall: (n,) which should be outside.
        weight: (n,) of the points.
    """
    order = np.argsort(out, kind="stable")
    out, wall, weight = out[order], wall[order], weight[order]
    wall_inside = np.concatenate([[0.0], np.cumsum(weight * wall)])
    off_inside = np.concatenate([[0.0], np.cumsum(weight * ~wall)])
    wrong = wall_inside + off_inside[-1] - off_inside
    best = np.flatnonzero(wrong <= wrong.min() + 1e-9)
    ends = np.concatenate([[-_BAND], out, [_BAND]])
    return float(ends[best[0]] + ends[best[-1] + 1]) / 2.0
