"""A run's film on the grid of its segmentation, where strokes are planned."""

import numpy as np
from scipy.ndimage import map_coordinates

from painter.errors import InputError
from painter.planning.film.film_model import margin_cells
from painter.planning.tile import cell_centres, grid_points
from painter.run.folder.folder import FILM, TRUTH, RunFolder
from painter.run.folder.values import Film, Truth
from perception.ground import FloatArray
from perception.values import WallSegmentation


def film_around(
    run: RunFolder, wall: WallSegmentation, thickness: FloatArray | None = None
) -> FloatArray:
    """Returns a film as the robot's tile grid and the margin around it see it.

    Args:
        run: Folder of a run with film and truth.
        wall: Segmentation whose tile frame and grid are wanted.
        thickness: (ny, nx) m, on the grid of the run's film; None = that film.

    Returns:
        m, on the tile and `margin_cells` around it, row 0 at the bottom.

    Raises:
        InputError: The run has no film, or nothing that tells where its grid lies.
    """
    film, truth = film_and_truth(run)
    border = margin_cells(wall.cell)
    ny, nx = (size + 2 * border for size in wall.wall_mask.shape)
    x, y = cell_centres((ny, nx), wall.cell, margin=border * wall.cell)
    p_SQs = truth.X_WS.inverse() @ wall.X_WT @ grid_points(x, y)
    column = (p_SQs[0] - film.x0) / film.cell - 0.5
    row = (p_SQs[1] - film.y0) / film.cell - 0.5
    laid = film.thickness if thickness is None else thickness
    # The nearest cell: a mean of two would hide where film ends.
    found = map_coordinates(laid, [row, column], order=0, mode="nearest")
    return np.asarray(found, dtype=np.float64).reshape(ny, nx)


def film_and_truth(run: RunFolder) -> tuple[Film, Truth]:
    """Reads a run's film and where it lies; raises InputError if one is missing."""
    film, truth = run.film(), run.truth()
    if film is None:
        raise InputError(f"{run.path / FILM}: no such file.", code="PNT-RUN-001")
    if truth is None:
        raise InputError(f"{run.path / TRUTH}: no such file.", code="PNT-RUN-002")
    return film, truth
