"""Lines of sight over a tile, past things in front of the wall."""

import numpy as np

from perception.ground import BoolArray, FloatArray


def seen_from(
    p_TCs: FloatArray, p_TQs: FloatArray, height: FloatArray, *, cell: float
) -> BoolArray:
    """Finds which places on the wall each camera centre sees.

    Args:
        p_TCs: (k, 3) m, in T: camera centres, farther from the wall than all things.
        p_TQs: (n, 2) m, in T: places on the wall, x and y.
        height: (ny, nx) m, of things in front of the wall; 0 = none.
        cell: Edge of a cell, m.

    Returns:
        (k, n) True = no thing lies on the line of sight.
    """
    ny, nx = height.shape
    top = float(height.max(initial=0.0))
    way = p_TCs[:, None, :2] - p_TQs[None]
    # Along the line of sight up to the height of the highest thing, in half cells.
    share = top / p_TCs[:, 2]
    longest = float((np.linalg.norm(way, axis=2).max(axis=1) * share).max(initial=0.0))
    clear = np.ones(way.shape[:2], dtype=np.bool_)
    for s in np.linspace(0.0, 1.0, int(np.ceil(2.0 * longest / cell)) + 1)[1:]:
        p = p_TQs[None] + (s * share)[:, None, None] * way
        columns = np.clip(p[..., 0] / cell, 0, nx - 1).astype(np.int64)
        rows = np.clip(p[..., 1] / cell, 0, ny - 1).astype(np.int64)
        clear &= height[rows, columns] <= s * top
    return clear
