"""Pictures of a segmentation: what was seen, labels, depth, mask."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import TwoSlopeNorm
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Polygon

from painter.run.pictures import style
from painter.run.pictures.pictures import grid_size
from perception.paper_steps.pipeline import SegmentationStages
from perception.values import WallSegmentation

_WALL = "#8fc79a"
_UNSEEN = "#d9dde1"
_OTHERS = (style.ORANGE, style.SKY, style.BLUE, style.VERMILION, style.PURPLE)
_DEPTH_LIMIT = 15.0  # Of the colour scale, cm.


def segmentation_picture(steps: SegmentationStages, *, title: str = "") -> Figure:
    """Draws the input, the labels, the residuals and the mask side by side.

    Args:
        steps: The segmentation with its intermediate results.
        title: Heading.
    """
    result = steps.segmentation
    ny, nx = result.labels.shape
    # Side by side; of a long wall two by two, of a very long one in a column.
    columns = 4 if nx < 1.6 * ny else 2 if nx < 4 * ny else 1
    rows = 4 // columns
    width = {4: 4.3, 2: 7.5, 1: 13.0}[columns]
    height = (width - 1.1) * min(2.5, ny / nx) + 1.25
    figure = style.new_figure(columns * width, rows * height + 0.5)
    axes = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    draw_points(axes.flat[0], steps)
    draw_labels(axes.flat[1], result)
    draw_residuals(axes.flat[2], result)
    draw_mask(axes.flat[3], result)
    for ax in axes[:, 1:].flat:
        ax.set_ylabel("")
    figure.suptitle(title, fontsize=13, fontweight="bold", x=0.01, ha="left")
    return figure


def draw_points(ax: Axes, steps: SegmentationStages) -> None:
    """Draws the cloud as seen from the robot, coloured by depth.

    Args:
        ax: Where to draw.
        steps: The segmentation with its cloud.
    """
    found, result = steps.found, steps.segmentation
    p_TQs = result.X_WT.inverse() @ found.p_WQs
    width, height = grid_size(result)
    inside = (p_TQs[:2] >= 0.0).all(axis=0)
    inside &= (p_TQs[0] <= width) & (p_TQs[1] <= height)
    ax.set_facecolor(_UNSEEN)
    shown = np.flatnonzero(inside & found.kept)
    # Far points first, so that near ones cover them.
    shown = shown[np.argsort(p_TQs[2, shown])]
    dots: dict[str, Any] = {"s": 1.2, "linewidths": 0, "rasterized": True}
    x, y, z = p_TQs[:, shown]
    norm = TwoSlopeNorm(0.0, vmin=-_DEPTH_LIMIT, vmax=_DEPTH_LIMIT)
    points = ax.scatter(x, y, c=100.0 * z, cmap="RdYlBu", norm=norm, **dots)
    _add_bar(ax, points, "cm before the wall's plane")
    x, y, _ = p_TQs[:, inside & ~found.kept]
    ax.scatter(x, y, c="black", **{**dots, "s": 3.0})
    removed = found.kept.size - found.kept_count
    _finish(ax, result, f"Cloud ({found.kept.size:,} points, {removed:,} outliers)")


def draw_labels(ax: Axes, result: WallSegmentation) -> None:
    """Draws the regions; wall in green, nothing seen in grey.

    Args:
        ax: Where to draw.
        result: The segmentation.
    """
    count = int(result.labels.max())
    colors, handles = [_UNSEEN], []
    if (result.labels == 0).any():
        handles.append(Patch(color=_UNSEEN, label="nothing seen"))
    others = 0
    for label in range(1, count + 1):
        cells = result.labels == label
        wall = bool(result.wall_mask[cells].any())
        colors.append(_WALL if wall else _OTHERS[others % len(_OTHERS)])
        others += not wall
        depth = result.depth[cells]
        depth = depth[np.isfinite(depth)]
        if label <= 6 and depth.size:
            kind = "wall" if wall else f"{100 * np.median(depth):+.1f} cm"
            area = np.count_nonzero(cells) * result.cell**2
            handles.append(
                Patch(color=colors[-1], label=f"{label}: {kind}, {area:.2f} m²")
            )
    style.show_kinds(ax, result.labels, colors, grid_size(result))
    if handles:
        ax.legend(
            handles=handles,
            fontsize=7,
            loc="upper left",
            bbox_to_anchor=(1.01, 1.0),
            borderaxespad=0.0,
            handlelength=1.0,
            frameon=False,
        )
    _finish(ax, result, f"Labels ({count} regions by area)")


def draw_residuals(ax: Axes, result: WallSegmentation) -> None:
    """Draws how far the wall's cells are from its surface, or else from its plane.

    Args:
        ax: Where to draw.
        result: The segmentation.
    """
    ax.set_facecolor(_UNSEEN)
    surface = 0.0 if result.surface is None else result.surface
    residuals = np.where(result.wall_mask, 1000.0 * (result.depth - surface), np.nan)
    measured = residuals[np.isfinite(residuals)]
    away = np.abs(measured - np.median(measured)) if measured.size else np.zeros(1)
    limit = max(1.0, float(np.percentile(away, 95.0)))
    limits: dict[str, Any] = {"vmin": -limit, "vmax": limit}
    image = style.show_grid(ax, residuals, grid_size(result), cmap="RdBu", **limits)
    what = "plane" if result.surface is None else "surface"
    _add_bar(ax, image, f"mm before the wall's {what}")
    _finish(ax, result, f"Residuals of the wall (95 % within {limit:.0f} mm)")


def draw_mask(ax: Axes, result: WallSegmentation) -> None:
    """Draws the mask: white = paint, with the outlines of windows and doors.

    Args:
        ax: Where to draw.
        result: The segmentation.
    """
    style.show_kinds(ax, result.wall_mask, ["black", "white"], grid_size(result))
    for opening in result.openings:
        ax.add_patch(
            Polygon(opening.p_TVs.T, fill=False, edgecolor=style.ORANGE, linewidth=1.5)
        )
    area = np.count_nonzero(result.wall_mask) * result.cell**2
    _finish(ax, result, f"Mask (white = paint, {area:.2f} m²)")


def _add_bar(ax: Axes, colored: Any, label: str) -> None:
    """Adds a bar of colours that takes the same room beside each panel."""
    place = ax.inset_axes((1.02, 0.0, 0.025, 1.0))
    bar = ax.figure.colorbar(colored, cax=place, extend="both")
    bar.set_label(label, fontsize=8)
    bar.ax.tick_params(labelsize=8)


def _finish(ax: Axes, result: WallSegmentation, title: str) -> None:
    width, height = grid_size(result)
    ax.set(xlim=(0.0, width), ylim=(0.0, height), aspect="equal")
    ax.set_xlabel("T x, m", fontsize=8)
    ax.set_ylabel("T y, m", fontsize=8)
    ax.tick_params(labelsize=8)
    ax.set_title(title, fontsize=10, loc="left")
