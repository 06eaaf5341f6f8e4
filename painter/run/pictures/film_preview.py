"""The picture of the film as planned."""

import numpy as np
from matplotlib.figure import Figure

from painter.planning.film.preview import FilmPreview
from painter.run.pictures import style
from perception.values import WallSegmentation


@style.styled
def preview_picture(
    preview: FilmPreview, segmentation: WallSegmentation, nominal: float
) -> Figure:
    """Draws the film as planned, % of nominal, with the edges of keep-out."""
    ny, nx = preview.film.shape
    low = -preview.border * preview.cell
    size = nx * preview.cell, ny * preview.cell
    figure, axes, bar = style.film_figure(preview.film / nominal, size, (low, low))
    bar.set_label(f"wet film as planned [% of nominal {1e6 * nominal:.0f} µm]")
    mask = np.pad(np.asarray(segmentation.wall_mask), preview.border)
    x = low + (np.arange(nx) + 0.5) * preview.cell
    y = low + (np.arange(ny) + 0.5) * preview.cell
    if mask.any():
        axes.contour(x, y, mask, levels=[0.5], colors=[style.VERMILION], linewidths=1.1)
    return figure
