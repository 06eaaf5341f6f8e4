"""What was not seen, and why: gaps between points, shadows, glass, or simply never."""

import enum
import math

import numpy as np
from scipy.ndimage import (
    binary_dilation,
    binary_opening,
    distance_transform_edt,
    find_objects,
    label,
    maximum,
)

from perception.values import BoolArray, FloatArray, IntArray

_FAR = 0.25
"""What lies farther behind the wall than any frame is seen through glass, m."""
_SHADOW_REACH = 1.5
"""Shadows reach so many times the height of what casts them: a view at 56 deg."""
_SHADOW_MARGIN = 0.02
_LEAST_PANE = 0.02
"""Smaller holes without a frame are not taken for panes, m²."""
_PANE_FILL = 0.85
"""Share of its upright box that such a hole fills."""
_SQUARE = np.ones((3, 3), dtype=np.bool_)


class Reason(enum.IntEnum):
    """Why a cell is not to be painted."""

    WALL = 0  # It is wall, and to be painted.
    RAISED = 1  # Something stands before the wall.
    RECESSED = 2  # The surface lies behind the wall: frame, panel, niche.
    UNSEEN = 3  # No picture shows it.
    GLASS = 4  # Seen through, mirrored, or nothing came back from a pane.
    SHADOW = 5  # Hidden by something that stands before the wall.
    SPECK = 6  # Level with the wall, but alone and tiny.


def close_gaps(seen: BoolArray, *, spacing: float, cell: float) -> BoolArray:
    """Marks the unseen cells that are no more than gaps between points.

    Args:
        seen: (ny, nx) True = the cell holds a point.
        spacing: Typical distance of points on the wall, m.
        cell: Edge of a cell, m.

    Returns:
        (ny, nx) True = unseen, but in a gap no wider than two cells or three times the
        spacing of points.
    """
    reach = max(1, math.ceil(1.5 * spacing / cell))
    square = np.ones((2 * reach + 1,) * 2, dtype=np.bool_)
    unseen = np.pad(~seen, 2 * reach, constant_values=False)
    core = binary_opening(unseen, square)
    # The opening rounds a hole's outline off; what touches it belongs to it.
    hole = binary_dilation(core, _SQUARE, iterations=1, mask=unseen)
    inner = (slice(2 * reach, -2 * reach),) * 2
    gaps: BoolArray = ~seen & ~hole[inner]
    return gaps


def explain(
    reason: IntArray, residual: FloatArray, hole: BoolArray, *, cell: float
) -> IntArray:
    """Says of each hole whether it is glass, a shadow or simply unseen.

    A hole beside something raised, no farther than that can hide the wall from a
    slanting view, is its shadow. One that touches a recess, or is a large upright
    rectangle, is glass. So is what shows things far behind the wall.

    Args:
        reason: (ny, nx) values of `Reason`, as far as the seen cells go.
        residual: (ny, nx) m before the wall's surface; NaN = not seen.
        hole: (ny, nx) unseen cells.
        cell: Edge of a cell, m.

    Returns:
        (ny, nx) values of `Reason` for all cells.
    """
    result = np.where(hole, Reason.UNSEEN, reason)
    result[~hole & (result == Reason.RECESSED) & (residual < -_FAR)] = Reason.GLASS
    shadow = hole & _in_shadow(result == Reason.RAISED, residual, cell)
    result[shadow] = Reason.SHADOW
    recess = (result == Reason.RECESSED) | (result == Reason.GLASS)
    parts, count = label(hole & ~shadow, structure=_SQUARE)
    framed = np.zeros(count + 1, dtype=np.bool_)
    framed[np.unique(parts[binary_dilation(recess, _SQUARE)])] = True
    area = np.bincount(parts.ravel(), minlength=count + 1)
    box = np.array([1, *(_box_area(window) for window in find_objects(parts))])
    pane = (area * cell**2 >= _LEAST_PANE) & (area >= _PANE_FILL * box)
    glass = framed | pane
    glass[0] = False
    result[glass[parts]] = Reason.GLASS
    return result


def _in_shadow(raised: BoolArray, residual: FloatArray, cell: float) -> BoolArray:
    """Finds the cells near enough to something raised to be hidden by it."""
    if not raised.any():
        return np.zeros(raised.shape, dtype=np.bool_)
    parts, count = label(raised, structure=_SQUARE)
    tops = np.nan_to_num(residual, nan=0.0)
    top = np.concatenate([[0.0], maximum(tops, parts, np.arange(1, count + 1))])
    distance, (rows, columns) = distance_transform_edt(
        ~raised, sampling=cell, return_indices=True
    )
    reach = _SHADOW_REACH * top[parts[rows, columns]] + _SHADOW_MARGIN
    shadow: BoolArray = distance <= reach
    return shadow


def _box_area(window: tuple[slice, slice]) -> int:
    rows, columns = window
    return int((rows.stop - rows.start) * (columns.stop - columns.start))
