"""Why cells were not seen: gaps between points, shadows, glass, or no picture."""

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

from perception.fine_steps.sight import seen_from
from perception.ground import BoolArray, FloatArray, IntArray

_FAR = 0.25
"""Points farther behind the wall than any frame are seen through glass, m."""
_SHADOW_REACH = 1.5
"""Reach of a shadow, in heights of the thing that casts it: a view at 56 deg."""
_SHADOW_MARGIN = 0.02
"""Distance from an edge within which the matcher loses wall that is visible, m."""
_SURE_VIEW = 0.5
"""A camera square to the wall surely shows places up to this share of its distance
aside."""
_SURE_PICTURES = 5
"""A place that so many pictures should have shown is not hidden."""
_MOST_CENTRES = 40
"""Of more camera centres, so many are chosen evenly."""
_LEAST_PANE = 0.02
"""Smaller holes without a frame are not taken for panes, m²."""
_PANE_FILL = 0.85
"""Share of its upright box that such a hole fills."""
_SQUARE = np.ones((3, 3), dtype=np.bool_)


class Reason(enum.IntEnum):
    """Why a cell is not painted."""

    WALL = 0  # It is wall and is painted.
    RAISED = 1  # A thing in front of the wall.
    RECESSED = 2  # The surface lies behind the wall: frame, panel, niche.
    UNSEEN = 3  # No picture shows it.
    GLASS = 4  # Seen through, mirrored, or nothing came back from a pane.
    SHADOW = 5  # Hidden by a thing in front of the wall.
    SPECK = 6  # Level with the wall, but alone and tiny.


def close_gaps(seen: BoolArray, *, spacing: float, cell: float) -> BoolArray:
    """Finds the unseen cells that are mere gaps between points.

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
    # The opening rounds a hole's outline; cells that touch it belong to it.
    hole = binary_dilation(core, _SQUARE, iterations=1, mask=unseen)
    inner = (slice(2 * reach, -2 * reach),) * 2
    gaps: BoolArray = ~seen & ~hole[inner]
    return gaps


def explain(
    reason: IntArray,
    residual: FloatArray,
    hole: BoolArray,
    *,
    cell: float,
    p_TCs: FloatArray | None = None,
) -> IntArray:
    """Decides for each hole whether it is glass, a shadow or just unseen.

    A hole so close to a raised thing that this can hide the wall from an oblique view
    is its shadow, unless known camera centres should have seen it. A hole that touches
    a recess, or is a large upright rectangle, is glass. So are cells that show things
    far behind the wall.

    Args:
        reason: (ny, nx) values of `Reason`, as far as the seen cells go.
        residual: (ny, nx) m before the wall's surface; NaN = not seen.
        hole: (ny, nx) unseen cells.
        cell: Edge of a cell, m.
        p_TCs: (3, k) m, in T: camera centres, square to the wall; None = unknown.

    Returns:
        (ny, nx) values of `Reason` for all cells.
    """
    result = np.where(hole, Reason.UNSEEN, reason)
    result[~hole & (result == Reason.RECESSED) & (residual < -_FAR)] = Reason.GLASS
    raised = result == Reason.RAISED
    shadow = in_shadow(hole, raised, residual, cell=cell, p_TCs=p_TCs)
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


def in_shadow(
    hole: BoolArray,
    raised: BoolArray,
    residual: FloatArray,
    *,
    cell: float,
    p_TCs: FloatArray | None = None,
) -> BoolArray:
    """Finds the holes in the shadow of raised things.

    Args:
        hole: (ny, nx) unseen cells.
        raised: (ny, nx) cells of things in front of the wall.
        residual: (ny, nx) m before the wall's surface; NaN = not seen.
        cell: Edge of a cell, m.
        p_TCs: See `explain`.

    Returns:
        (ny, nx) bool.
    """
    if not raised.any():
        return np.zeros(raised.shape, dtype=np.bool_)
    parts, count = label(raised, structure=_SQUARE)
    tops = np.nan_to_num(residual, nan=0.0)
    top = np.concatenate([[0.0], maximum(tops, parts, np.arange(1, count + 1))])
    distance, (rows, columns) = distance_transform_edt(
        ~raised, sampling=cell, return_indices=True
    )
    reach = _SHADOW_REACH * top[parts[rows, columns]] + _SHADOW_MARGIN
    shadow: BoolArray = hole & (distance <= reach)
    doubtful = shadow & (distance > _SHADOW_MARGIN)
    if p_TCs is not None and p_TCs.shape[1] and doubtful.any():
        height = np.where(raised, tops, 0.0)
        shadow[doubtful] = ~_shown(doubtful, height, p_TCs, cell)
    return shadow


def _shown(
    cells: BoolArray, height: FloatArray, p_TCs: FloatArray, cell: float
) -> BoolArray:
    """Returns which of the n cells marked the pictures should have shown."""
    rows, columns = np.nonzero(cells)
    p_TQs = cell * np.column_stack([columns + 0.5, rows + 0.5])
    every = math.ceil(p_TCs.shape[1] / _MOST_CENTRES)
    centres = p_TCs.T[::every]
    centres = centres[centres[:, 2] > height.max()]
    aside = np.abs(centres[:, None, :2] - p_TQs[None]).max(axis=2)
    shown = aside <= _SURE_VIEW * centres[:, 2:]
    shown &= seen_from(centres, p_TQs, height, cell=cell)
    return np.asarray(shown.sum(axis=0) * every >= _SURE_PICTURES)


def _box_area(window: tuple[slice, slice]) -> int:
    rows, columns = window
    return int((rows.stop - rows.start) * (columns.stop - columns.start))
