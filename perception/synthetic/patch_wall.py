"""Clouds of made-up walls with known answers, for tests, benchmarks and notebooks."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from pydrake.math import RigidTransform

from perception.ground import BoolArray, FloatArray
from perception.values import TileSize

_TILE = TileSize(2.0, 2.0)


class Patch(NamedTuple):
    """A rectangle of the tile that is not wall.

    Attributes:
        left: Its left edge, m, along T x.
        bottom: Its lower edge, m, along T y.
        right: Its right edge, m.
        top: Its upper edge, m.
        depth: Of its surface, m along T z: > 0 stands before the wall, < 0 lies behind
            it, NaN returns nothing (glass).
    """

    left: float
    bottom: float
    right: float
    top: float
    depth: float


# A window with a frame and glass, a door, two boxes and a stick on a 2 x 2 m tile.
EXAMPLE_PATCHES = (
    Patch(0.20, 0.90, 0.80, 1.60, -0.12),
    Patch(0.26, 0.96, 0.74, 1.54, float("nan")),
    Patch(1.25, 0.00, 1.85, 1.55, -0.07),
    Patch(0.25, 0.30, 0.45, 0.50, 0.10),
    Patch(0.60, 0.20, 0.75, 0.35, 0.08),
    Patch(0.95, 0.30, 0.99, 1.50, 0.05),
)


def synthetic_wall(
    patches: Sequence[Patch] = EXAMPLE_PATCHES,
    *,
    tile: TileSize = _TILE,
    margin: float = 0.2,
    spacing: float = 0.005,
    noise: float = 0.0015,
    outliers: int = 0,
    X_WT: RigidTransform | None = None,
    rng: np.random.Generator,
) -> FloatArray:
    """Makes the cloud of a flat wall as a camera square to it would fuse it.

    Args:
        patches: What is not wall; a later one lies over the earlier ones.
        tile: Its size.
        margin: Of wall around the tile, m.
        spacing: Of the points, m; they are jittered within their squares.
        noise: Standard deviation of depth, m.
        outliers: Points strewn evenly over the tile, up to 0.5 m off the wall.
        X_WT: Tile frame in W; the identity if left out.
        rng: Source of noise.

    Returns:
        p_WQs (3, N) m, in W, in random order.
    """
    # Whole squares: rounding must not add a row or a column on one side.
    nx, ny = (
        round((size + 2.0 * margin) / spacing) for size in (tile.width, tile.height)
    )
    x, y = np.meshgrid(np.arange(nx) * spacing, np.arange(ny) * spacing)
    x, y = x - margin, y - margin
    x, y = x.ravel(), y.ravel()
    x, y = (axis + rng.uniform(0.0, spacing, axis.size) for axis in (x, y))
    z = np.zeros(x.size)
    for patch in patches:
        z[_inside(patch, x, y)] = patch.depth
    p_TQs = np.stack([x, y, z + rng.normal(0.0, noise, z.size)])[:, np.isfinite(z)]
    strewn = rng.uniform(
        [[0.0]] * 2 + [[-0.5]], [[tile.width], [tile.height], [0.5]], (3, outliers)
    )
    p_TQs = rng.permutation(np.concatenate([p_TQs, strewn], axis=1), axis=1)
    return p_TQs if X_WT is None else X_WT @ p_TQs


def synthetic_truth(
    patches: Sequence[Patch] = EXAMPLE_PATCHES,
    *,
    tile: TileSize = _TILE,
    cell: float = 0.01,
) -> BoolArray:
    """Returns the true mask of `synthetic_wall`: cells whose centre is wall.

    Args:
        patches: What is not wall.
        tile: Its size.
        cell: Edge of a cell, m.

    Returns:
        (ny, nx), row 0 at the bottom.
    """
    ny, nx = tile.shape(cell)
    x, y = np.meshgrid((np.arange(nx) + 0.5) * cell, (np.arange(ny) + 0.5) * cell)
    mask = np.ones(x.shape, dtype=np.bool_)
    for patch in patches:
        mask &= ~_inside(patch, x, y)
    return mask


def example_wall(
    patches: Sequence[tuple[float, float, float, float, float]] = EXAMPLE_PATCHES,
    *,
    spacing: float = 0.005,
    noise: float = 0.0015,
    outliers: int = 0,
    seed: int = 1,
) -> tuple[FloatArray, BoolArray]:
    """Makes the cloud of a wall of 2 x 2 m and its true mask.

    Args:
        patches: What is not wall: left, bottom, right and top edge in T, m, and depth
            along T z, m (> 0 before the wall, < 0 behind it, NaN glass); a later one
            lies over the earlier ones.
        spacing: Of the points, m.
        noise: Standard deviation of depth, m.
        outliers: Points strewn evenly over the tile, up to 0.5 m off the wall.
        seed: Of noise and outliers.

    Returns:
        p_TQs (3, N) m, and the mask (200, 200) in cells of 1 cm, row 0 at the bottom.
    """
    rng = np.random.default_rng(seed)
    named = [Patch(*patch) for patch in patches]
    cloud = synthetic_wall(
        named, spacing=spacing, noise=noise, outliers=outliers, rng=rng
    )
    return cloud, synthetic_truth(named)


def _inside(patch: Patch, x: FloatArray, y: FloatArray) -> BoolArray:
    across = (x >= patch.left) & (x < patch.right)
    return across & (y >= patch.bottom) & (y < patch.top)
