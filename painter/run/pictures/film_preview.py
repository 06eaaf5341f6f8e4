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
    """Draws the film as planned, % of nominal, with the edges of what stays clean."""
    ny, nx = preview.film.shape
    low = -preview.border * preview.cell
    right, top = low + nx * preview.cell, low + ny * preview.cell
    figure = style.new_figure(5.8, 4.9)
    axes = style.tile_axes(figure, right, top)
    axes.set(xlim=(low, right), ylim=(low, top))
    shown = axes.imshow(
        100 * preview.film / nominal,
        origin="lower",
        extent=(low, right, low, top),
        cmap="viridis",
        vmin=0,
        vmax=150,
        interpolation="nearest",
    )
    mask = np.pad(np.asarray(segmentation.wall_mask), preview.border)
    x = low + (np.arange(nx) + 0.5) * preview.cell
    y = low + (np.arange(ny) + 0.5) * preview.cell
    if mask.any():
        axes.contour(x, y, mask, levels=[0.5], colors=[style.VERMILION], linewidths=1.1)
    bar = figure.colorbar(shown, ax=axes, extend="max", shrink=0.9, pad=0.02)
    bar.set_label(f"wet film as planned [% of nominal {1e6 * nominal:.0f} µm]")
    return figure
