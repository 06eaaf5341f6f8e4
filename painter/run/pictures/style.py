"""How the pictures of a report look: one style, safe for colour-blind readers."""

import io
from collections.abc import Callable, Sequence
from functools import wraps
from pathlib import Path
from typing import Any, ParamSpec

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colorbar import Colorbar
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.image import AxesImage

P = ParamSpec("P")

# Source: Okabe & Ito, "Color Universal Design", 2008.
BLUE = "#0072B2"
SKY = "#56B4E9"
GREEN = "#009E73"
ORANGE = "#E69F00"
VERMILION = "#D55E00"
PURPLE = "#CC79A7"
YELLOW = "#F0E442"
INK = "#1f2933"
MUTED = "#7b8794"
PALE = "#e4e7eb"
# The largest region is a background to the others.
SERIES = ("#d3dae3", BLUE, ORANGE, GREEN, PURPLE, SKY, VERMILION, YELLOW, "#8c6d31")

_STYLE = mpl.rc_params_from_file(
    Path(__file__).with_name("painter.mplstyle"), use_default_template=False
)


def styled(draw: Callable[P, Figure]) -> Callable[P, Figure]:
    """Makes a drawing function use the common style."""

    @wraps(draw)
    def wrapper(*args: P.args, **kwargs: P.kwargs) -> Figure:
        with mpl.rc_context(_STYLE):
            return draw(*args, **kwargs)

    return wrapper


def new_figure(width: float, height: float) -> Figure:
    """Makes an empty figure, inches, that needs no display."""
    return Figure(figsize=(width, height), layout="constrained")


def tile_axes(figure: Figure, width: float, height: float) -> Axes:
    """Adds axes over a tile as seen from the robot, m in T's x and y."""
    axes = figure.add_subplot()
    axes.set(xlim=(0.0, width), ylim=(0.0, height), aspect="equal")
    axes.set_xlabel("x to the right [m]")
    axes.set_ylabel("y up [m]")
    axes.locator_params(nbins=6)
    return axes


def show_grid(
    axes: Axes,
    values: np.ndarray,
    size: tuple[float, float],
    low: tuple[float, float] = (0.0, 0.0),
    **options: Any,
) -> AxesImage:
    """Shows the cells of a grid, row 0 at the bottom.

    Args:
        axes: Where.
        values: (ny, nx).
        size: Width and height of the grid, m.
        low: Its lower left corner, m.
        options: Of Matplotlib's `imshow`.
    """
    extent = (low[0], low[0] + size[0], low[1], low[1] + size[1])
    return axes.imshow(
        values, origin="lower", extent=extent, interpolation="nearest", **options
    )


def show_kinds(
    axes: Axes, kinds: np.ndarray, colors: Sequence[str], size: tuple[float, float]
) -> AxesImage:
    """Shows a grid of kinds, numbered from 0, each in its colour."""
    limits: dict[str, Any] = {"vmin": -0.5, "vmax": len(colors) - 0.5}
    return show_grid(axes, kinds, size, cmap=ListedColormap(colors), **limits)


def film_figure(
    share: np.ndarray, size: tuple[float, float], low: tuple[float, float]
) -> tuple[Figure, Axes, Colorbar]:
    """Makes the figure of a film.

    Args:
        share: (ny, nx) film over nominal.
        size: Width and height of the grid, m.
        low: Its lower left corner, m.
    """
    figure = new_figure(5.8, 4.9)
    axes = tile_axes(figure, *size)
    axes.set(xlim=(low[0], low[0] + size[0]), ylim=(low[1], low[1] + size[1]))
    shown = show_grid(axes, 100 * share, size, low, cmap="viridis", vmin=0, vmax=150)
    bar = figure.colorbar(shown, ax=axes, extend="max", shrink=0.9, pad=0.02)
    return figure, axes, bar


def png(figure: Figure, dpi: int = 160) -> bytes:
    """Renders a figure as PNG.

    Args:
        figure: Matplotlib figure, as `map_picture` and its like return.
        dpi: Pixels per inch of the figure's size.

    Returns:
        Content of the PNG file.
    """
    stream = io.BytesIO()
    with mpl.rc_context(_STYLE):
        figure.savefig(stream, format="png", dpi=dpi)
    return stream.getvalue()
