"""How the pictures of a report look: one style, safe for colour-blind readers."""

import io
from collections.abc import Callable
from functools import wraps
from typing import Any, ParamSpec

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

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

_STYLE: Any = {
    "font.family": "sans-serif",
    "font.size": 9,
    "axes.titlesize": 9,
    "axes.edgecolor": "#9aa5b1",
    "axes.labelcolor": INK,
    "axes.linewidth": 0.8,
    "axes.grid": False,
    "axes.axisbelow": True,
    "grid.color": PALE,
    "grid.linewidth": 0.8,
    "xtick.color": "#52606d",
    "ytick.color": "#52606d",
    "text.color": INK,
    "legend.frameon": False,
    "legend.fontsize": 8,
    "figure.facecolor": "white",
}


def styled(draw: Callable[P, Figure]) -> Callable[P, Figure]:
    """Makes a drawing function use the common style."""

    @wraps(draw)
    def wrapper(*args: P.args, **kwargs: P.kwargs) -> Figure:
        with mpl.rc_context(dict(_STYLE)):
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


def png(figure: Figure, dpi: int = 160) -> bytes:
    """Renders a figure as PNG."""
    stream = io.BytesIO()
    with mpl.rc_context(dict(_STYLE)):
        figure.savefig(stream, format="png", dpi=dpi)
    return stream.getvalue()
