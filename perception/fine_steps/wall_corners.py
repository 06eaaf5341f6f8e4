"""Walls that meet in an edge within the tile: each is a smooth piece of its own.

The edge is found between planes; each wall then gets its own spline. So only walls that
are flat within a few mm are split.
"""

import math

import numpy as np
from scipy.ndimage import binary_dilation

from perception.fine_steps.smooth_patches import smooth_patches
from perception.fine_steps.wall_piece import Blocks, plane_heights, surface_normals
from perception.ground import BoolArray, FloatArray

_LEAST_AREA = 0.2
"""A smaller patch is no wall in a corner, m²."""
_LEAST_WIDTH = 0.12
"""Nor is a narrower one, such as a moulding's flank, m."""
_TURN_DEG = (3.0, 45.0)
"""Nor is one that is turned less, or too far for the gun."""
_LEAST_MEETING = 0.3
"""Length on which two walls meet at least, m; ..."""
_MEETING = 0.8
"""... share of their border on which they do so without a step ..."""
_EDGE_STEP = 0.012
"""... higher than this, m; ..."""
_FLAT = 0.95
"""... and share of both that is level with the two planes."""
_FIRST_SLACK = 0.02  # m, before the two are parted cleanly.
_ROUNDS = 3


def part_at_corners(blocks: Blocks, wall: BoolArray) -> list[BoolArray]:
    """Splits a wall where it bends, and finds the walls that meet it.

    Args:
        blocks: Depths over the tile.
        wall: (my, mx) blocks of the wall, at least one.

    Returns:
        Blocks (my, mx) of the wall alone, then of each other, the largest first.
    """
    sides: list[BoolArray] = []
    while (parted := _first_corner(blocks, wall, sides)) is not None:
        wall, side = parted
        sides.append(side)
    return [wall, *sides]


def _first_corner(
    blocks: Blocks, wall: BoolArray, sides: list[BoolArray]
) -> tuple[BoolArray, BoolArray] | None:
    """Returns the wall and the largest other one that it meets, if there is any."""
    off = ~_level(blocks, plane_heights(blocks, wall))
    for side in sides:
        off &= ~side
    rest = smooth_patches(np.where(off, blocks.depth, np.nan), noise=blocks.noise)
    counts = np.bincount(rest[rest >= 0], minlength=1)
    for number in np.argsort(-counts, kind="stable"):
        if counts[number] * blocks.cell**2 < _LEAST_AREA:
            break
        side = rest == number
        parted = _part(blocks, wall & ~side, side)
        if parted is not None:
            return parted
    return None


def _part(
    blocks: Blocks, wall: BoolArray, side: BoolArray
) -> tuple[BoolArray, BoolArray] | None:
    """Gives each block of two walls to the plane that it is closer to.

    Returns:
        Both; or None if they do not meet as two walls do in a corner.
    """
    slack = _FIRST_SLACK
    for _ in range(_ROUNDS):
        if not wall.any() or not side.any():
            return None
        planes = [plane_heights(blocks, cells) for cells in (wall, side)]
        if not _meet(blocks, wall, side, planes, slack):
            return None
        slack = 0.0
        off = [np.abs(blocks.depth - plane) for plane in planes]
        with np.errstate(invalid="ignore"):
            closer = off[1] < off[0]
        both = wall | side
        wall, side = both & ~closer, both & closer
    level = np.where(side, _level(blocks, planes[1]), _level(blocks, planes[0]))
    return (wall, side) if level[both].mean() >= _FLAT else None


def _meet(
    blocks: Blocks,
    wall: BoolArray,
    side: BoolArray,
    planes: list[FloatArray],
    slack: float,
) -> bool:
    """Checks that one wall meets the other as in a corner.

    A wedge or a slanting sill meets the wall without a step on one side alone.
    """
    border = side & binary_dilation(wall, np.ones((5, 5), dtype=np.bool_))
    length = np.count_nonzero(border) * blocks.cell / 2.0  # Two blocks wide.
    area = np.count_nonzero(side) * blocks.cell**2
    if length < _LEAST_MEETING or area < _LEAST_WIDTH * length:
        return False
    a, b = (surface_normals(plane, blocks.cell)[0, 0] for plane in planes)
    turn = math.degrees(math.acos(min(1.0, float(a @ b))))
    if not _TURN_DEG[0] <= turn <= _TURN_DEG[1]:
        return False
    step = np.abs(planes[1] - planes[0])[border]
    # Two blocks from the edge the planes are apart by as much as they are turned.
    limit = _EDGE_STEP + 2.0 * blocks.cell * math.tan(math.radians(turn)) + slack
    return bool((step <= limit).mean() >= _MEETING)


def _level(blocks: Blocks, height: FloatArray) -> BoolArray:
    with np.errstate(invalid="ignore"):
        level: BoolArray = np.abs(blocks.depth - height) <= 2.0 * blocks.limit
    return level
