"""The segmentation that a robot without any error would make of a scene.

For planning without a simulation: tests and benchmarks reach in seconds the point that
a cycle reaches after a minute.
"""

import numpy as np

from painter.config import Scenario
from painter.planning.tile import (
    cell_centres,
    grid_points,
    grid_shape,
)
from painter.robot.true_scene import true_scene
from painter.scene.surface import is_paintable, surface_at
from perception.values import WallSegmentation


def true_segmentation(scenario: Scenario, *, cell: float = 0.01) -> WallSegmentation:
    """Returns the true segmentation of a scenario's tile, at the wall's true pose.

    Args:
        scenario: Gives scene, seed and tile.
        cell: Edge of a cell, m.

    Returns:
        Labels 1 = paintable wall, 2 = all else; no cell is unseen.
    """
    scene, X_WT = true_scene(scenario)
    ny, nx = grid_shape(scenario.tile, cell)
    p_TQs = grid_points(*cell_centres((ny, nx), cell))
    height, kind = surface_at(scene, p_TQs[0], p_TQs[1])
    paintable = is_paintable(kind).reshape(ny, nx)
    depth = np.nan_to_num(np.reshape(height, (ny, nx)), nan=-1.0)
    return WallSegmentation(
        labels=np.where(paintable, 1, 2).astype(np.uint16),
        depth=depth.astype(np.float32),
        wall_mask=paintable,
        X_WT=X_WT,
        cell=cell,
    )
