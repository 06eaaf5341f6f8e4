"""A run's film on the grid of its segmentation, where touch-up is planned."""

import numpy as np
from scipy.ndimage import map_coordinates

from painter.errors import InputError
from painter.run.folder import FILM, TRUTH, RunFolder
from perception.values import FloatArray, WallSegmentation


def film_on_tile(run: RunFolder, wall: WallSegmentation) -> FloatArray:
    """Returns the film that a run left, as the robot's tile grid sees it.

    Args:
        run: Folder of a run with film and truth.
        wall: Segmentation whose tile frame and grid are wanted.

    Returns:
        (ny, nx) m, row 0 at the bottom.

    Raises:
        InputError: The run has no film, or nothing that tells where its grid lies.
    """
    film, truth = run.film(), run.truth()
    for name, part in ((FILM, film), (TRUTH, truth)):
        if part is None:
            raise InputError(f"{run.path / name}: no such file.")
    assert film is not None
    assert truth is not None
    ny, nx = wall.wall_mask.shape
    x, y = np.meshgrid(
        (np.arange(nx) + 0.5) * wall.cell, (np.arange(ny) + 0.5) * wall.cell
    )
    p_TQs = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    p_SQs = truth.X_WS.inverse() @ wall.X_WT @ p_TQs
    column = (p_SQs[0] - film.x0) / film.cell - 0.5
    row = (p_SQs[1] - film.y0) / film.cell - 0.5
    thickness = map_coordinates(film.thickness, [row, column], order=1, mode="nearest")
    return np.asarray(thickness, dtype=np.float64).reshape(ny, nx)
