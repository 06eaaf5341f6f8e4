"""Openings as regions with a clean outline: a rectangle where one fits."""

from collections import defaultdict

import numpy as np
from scipy.ndimage import binary_closing, binary_fill_holes, find_objects, label

from perception.fine_steps.unseen import Reason
from perception.ground import BoolArray, FloatArray, IntArray
from perception.values import Opening

_LEAST_AREA = 0.02
"""Smaller recesses are no windows or doors, m²."""
_RECTANGLE_FIT = 0.92
"""Overlap (IoU) of region and rectangle from which it is called one."""
_TURNS_DEG = sorted(np.linspace(-3.0, 3.0, 13), key=abs)
"""Windows are plumb; tile and wall are turned by a degree or two at most."""
_BETTER = 1e-3  # A larger turn must fit better by so much.
_CLOSE = 2  # Cells: seams between frame, glass and shadow.
_SQUARE = np.ones((3, 3), dtype=np.bool_)


def find_openings(
    reason: IntArray, residual: FloatArray, *, cell: float
) -> tuple[Opening, ...]:
    """Joins recessed and glass cells to openings and draws their outlines.

    Args:
        reason: (ny, nx) values of `Reason`.
        residual: (ny, nx) m before the wall's surface; NaN = not seen.
        cell: Edge of a cell, m.

    Returns:
        The openings, the largest first.
    """
    open_ = (reason == Reason.RECESSED) | (reason == Reason.GLASS)
    padded = np.pad(open_, _CLOSE + 1, mode="edge")
    inner = (slice(_CLOSE + 1, -_CLOSE - 1),) * 2
    closed = binary_closing(padded, _SQUARE, iterations=_CLOSE)[inner]
    parts, _ = label(closed, structure=_SQUARE)
    found = []
    for number, window in enumerate(find_objects(parts), start=1):
        region = np.zeros(reason.shape, dtype=np.bool_)
        region[window] = binary_fill_holes(parts[window] == number)
        if np.count_nonzero(region) * cell**2 >= _LEAST_AREA:
            found.append(_opening(region, reason, residual, cell))
    return tuple(sorted(found, key=lambda opening: -opening.area))


def _opening(
    region: BoolArray, reason: IntArray, residual: FloatArray, cell: float
) -> Opening:
    corners, _, fit = fit_rectangle(region, cell)
    is_rectangle = fit >= _RECTANGLE_FIT
    depths = residual[region & (reason == Reason.RECESSED)]
    glass = np.count_nonzero(region & (reason == Reason.GLASS))
    return Opening(
        kind="rectangle" if is_rectangle else "contour",
        p_TVs=corners if is_rectangle else trace_contour(region, cell),
        area=float(np.count_nonzero(region) * cell**2),
        depth=float(np.median(depths)) if depths.size else float("nan"),
        glass_share=glass / np.count_nonzero(region),
    )


def fit_rectangle(
    region: BoolArray, cell: float
) -> tuple[FloatArray, BoolArray, float]:
    """Fits a rectangle, turned by a few degrees at most, to a region.

    Each side lies where the region's profile passes half of its usual length, so that
    ragged borders move it by their mean and not by their extremes.

    Args:
        region: (ny, nx).
        cell: Edge of a cell, m.

    Returns:
        Corners (2, 4) m in T, counter-clockwise from the lower left; (ny, nx) the cells
        whose centres lie inside; and the overlap (IoU) of the two.
    """
    ny, nx = region.shape
    rows, columns = np.nonzero(region)
    centre = np.array([columns.mean() + 0.5, rows.mean() + 0.5])
    own = np.stack([columns + 0.5, rows + 0.5]) - centre[:, np.newaxis]
    grid = np.stack(np.meshgrid(np.arange(nx) + 0.5, np.arange(ny) + 0.5), axis=0)
    grid = grid.reshape(2, -1) - centre[:, np.newaxis]
    best: tuple[float, FloatArray, BoolArray] | None = None
    for turn in np.deg2rad(_TURNS_DEG):
        axes = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
        sides = np.array([_sides(values) for values in axes @ own])
        turned = axes @ grid
        inside = np.all((turned >= sides[:, :1]) & (turned < sides[:, 1:]), axis=0)
        inside = inside.reshape(ny, nx)
        fit = np.count_nonzero(inside & region) / np.count_nonzero(inside | region)
        if best is None or fit > best[0] + _BETTER:
            (left, right), (low, high) = sides
            box = np.array([[left, right, right, left], [low, low, high, high]])
            best = fit, cell * (axes.T @ box + centre[:, np.newaxis]), inside
    assert best is not None
    return best[1], best[2], best[0]


def _sides(values: FloatArray) -> tuple[float, float]:
    """Returns where a profile of cells along one axis begins and ends, cells."""
    low = np.floor(values.min())
    profile = np.bincount((values - low).astype(np.int64))
    usual = float(np.median(profile[profile > 0.5 * profile.max()]))
    full = np.flatnonzero(profile >= 0.5 * usual)
    first, last = int(full[0]), int(full[-1])
    return low + first, low + last + 1.0


def trace_contour(region: BoolArray, cell: float) -> FloatArray:
    """Traces the outer border of a region along the edges of its cells.

    Args:
        region: (ny, nx), one part.
        cell: Edge of a cell, m.

    Returns:
        (2, n) m in T: corners, counter-clockwise, the region on the left.
    """
    padded = np.pad(region, 1)
    inside = padded[1:-1, 1:-1]
    # Edges run so that the region is on their left: under a cell to the right, ...
    edges: dict[tuple[int, int], list[tuple[int, int]]] = defaultdict(list)
    for (dy, dx), start, end in (
        ((-1, 0), (0, 0), (1, 0)),
        ((0, 1), (1, 0), (1, 1)),
        ((1, 0), (1, 1), (0, 1)),
        ((0, -1), (0, 1), (0, 0)),
    ):
        ny, nx = region.shape
        beside = padded[1 + dy : 1 + dy + ny, 1 + dx : 1 + dx + nx]
        for row, column in zip(*np.nonzero(inside & ~beside), strict=True):
            edges[column + start[0], row + start[1]].append(
                (column + end[0], row + end[1])
            )
    first = min(edges, key=lambda corner: (corner[1], corner[0]))
    path = [first, edges[first].pop()]
    while path[-1] != first:
        before, here = path[-2], path[-1]
        ways = edges[here]
        # Where two cells meet at a corner alone, keep to the outside: turn right.
        ways.sort(key=lambda to: _turn(before, here, to))
        path.append(ways.pop(0))
    points = np.array(path[:-1], dtype=float).T
    turns = np.any(
        np.roll(points, -1, axis=1) - points != points - np.roll(points, 1, axis=1),
        axis=0,
    )
    corners: FloatArray = cell * points[:, turns]
    return corners


def _turn(before: tuple[int, int], here: tuple[int, int], to: tuple[int, int]) -> int:
    """Returns > 0 for a turn to the left, < 0 for one to the right."""
    a = here[0] - before[0], here[1] - before[1]
    b = to[0] - here[0], to[1] - here[1]
    return int(a[0] * b[1] - a[1] * b[0])
