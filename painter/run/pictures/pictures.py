"""Pictures of the tile as seen from the robot: map, regions, mask, strokes, film."""

import functools
import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from scipy import ndimage

from painter.planning.spray_path import PaintProgram
from painter.run.folder.values import Film
from painter.run.pictures import style
from perception.ground import BoolArray, FloatArray
from perception.values import WallSegmentation

_MAP_CELL = 0.005
_STROKE_COLORS = {
    "body": style.BLUE,
    "cut_in": style.VERMILION,
    "touch_up": style.PURPLE,
}
_NOT_WALL = "#c9ced6"
_WALL = "#f7f4ec"


@style.styled
def map_picture(p_TQs: FloatArray, size: tuple[float, float]) -> Figure:
    """Draws the map's distance from the wall's plane, seen square on.

    Args:
        p_TQs: (3, N) m, points of the map in T.
        size: Width and height of the tile, m.
    """
    image = depth_image(p_TQs, size, _MAP_CELL)
    seen = image[np.isfinite(image)]
    # A few far points must not wash out what is near the wall.
    limit = (
        float(np.clip(np.percentile(np.abs(seen), 98), 0.02, 0.15))
        if seen.size
        else 0.1
    )
    figure = style.new_figure(5.4, 4.4)
    axes = style.tile_axes(figure, *size)
    axes.set_facecolor(style.PALE)
    shown = style.show_grid(
        axes,
        1000 * image,
        size,
        cmap="PuOr_r",
        vmin=-1000 * limit,
        vmax=1000 * limit,
    )
    bar = figure.colorbar(shown, ax=axes, extend="both", shrink=0.9)
    bar.set_label("out of the wall's plane, towards the robot [mm]")
    return figure


def depth_image(
    p_TQs: FloatArray, size: tuple[float, float], cell: float
) -> FloatArray:
    """Rasters points: nearest to the robot in each cell; single gaps are closed.

    Returns:
        (ny, nx) m along T z, row 0 at the bottom; NaN where there is no point.
    """
    nx, ny = (round(length / cell) for length in size)
    column, row = (np.floor(p_TQs[axis] / cell).astype(int) for axis in (0, 1))
    inside = (column >= 0) & (column < nx) & (row >= 0) & (row < ny)
    image = np.full((ny, nx), -np.inf)
    np.maximum.at(image, (row[inside], column[inside]), p_TQs[2, inside])
    # Points stand about a cell apart: some cells between them are skipped.
    near = ndimage.maximum_filter(image, size=3, mode="nearest")
    image = np.where(np.isneginf(image), near, image)
    return np.where(np.isneginf(image), np.nan, image)


@style.styled
def label_picture(segmentation: WallSegmentation) -> Figure:
    """Draws the regions with their areas; the largest has number 1.

    Args:
        segmentation: Of a tile: `labels` (ny, nx), 0 where nothing was seen.

    Returns:
        A Matplotlib figure; axes in m, in T, and areas in m². `png` renders it.
    """
    labels, size = segmentation.labels, grid_size(segmentation)
    numbers, counts = np.unique(labels[labels > 0], return_counts=True)
    shown = len(style.SERIES)
    colors = ["white", *style.SERIES, style.MUTED]
    figure = style.new_figure(5.4, 5.0)
    axes = style.tile_axes(figure, *size)
    style.show_kinds(axes, np.minimum(labels, shown + 1), colors, size)
    area = segmentation.cell**2
    entries = [
        Patch(color=colors[number], label=f"{number}: {count * area:.3f} m²")
        for number, count in zip(numbers, counts, strict=True)
        if number <= shown
    ]
    rest = counts[numbers > shown]
    if rest.size:
        label = f"{rest.size} more: {rest.sum() * area:.3f} m²"
        entries.append(Patch(color=style.MUTED, label=label))
    unseen = np.count_nonzero(labels == 0)
    if unseen:
        label = f"not seen: {unseen * area:.3f} m²"
        entries.append(Patch(facecolor="white", edgecolor=style.MUTED, label=label))
    figure.legend(handles=entries, loc="outside lower center", ncols=4)
    return figure


@style.styled
def mask_picture(
    segmentation: WallSegmentation, truth: BoolArray | None = None
) -> Figure:
    """Draws the mask, and where there is a truth what it has right and wrong."""
    mask, size = segmentation.wall_mask, grid_size(segmentation)
    true = mask if truth is None else truth
    kinds = [
        ("paintable", _WALL, mask & true),
        ("keep-out", _NOT_WALL, ~mask & ~true),
    ]
    if truth is not None:
        kinds += [
            ("wall missed", style.BLUE, ~mask & true),
            ("keep-out taken for wall", style.VERMILION, mask & ~true),
        ]
    image = np.zeros(mask.shape, dtype=int)
    for number, (_, _, cells) in enumerate(kinds):
        image[cells] = number
    figure = style.new_figure(5.4, 5.0)
    axes = style.tile_axes(figure, *size)
    style.show_kinds(axes, image, [color for _, color, _ in kinds], size)
    area = segmentation.cell**2
    entries = [
        Patch(
            facecolor=color,
            edgecolor=style.MUTED,
            label=f"{name}: {np.count_nonzero(cells) * area:.3f} m²",
        )
        for name, color, cells in kinds
    ]
    figure.legend(handles=entries, loc="outside lower center", ncols=2)
    return figure


@style.styled
def stroke_picture(program: PaintProgram, segmentation: WallSegmentation) -> Figure:
    """Draws the strokes by kind with their direction, and the ways between them."""
    size = grid_size(segmentation)
    figure = style.new_figure(5.4, 5.0)
    axes = style.tile_axes(figure, *size)
    axes.set(xlim=(-0.05, size[0] + 0.05), ylim=(-0.06, size[1] + 0.06))
    style.show_kinds(axes, segmentation.wall_mask, [_NOT_WALL, _WALL], size)
    strokes = program.strokes
    for before, after in itertools.pairwise(strokes):
        way = np.stack([before.end_T, after.start_T])
        axes.plot(*way.T, color=style.MUTED, lw=0.9, ls=(0, (3, 2)), zorder=2)
    for stroke in strokes:
        color = _STROKE_COLORS.get(stroke.kind, style.GREEN)
        line = np.stack([stroke.start_T, stroke.end_T])
        axes.plot(*line.T, color=color, lw=2.2, solid_capstyle="butt", zorder=3)
        middle = line.mean(axis=0)
        ahead = stroke.end_T - stroke.start_T
        angle = np.rad2deg(np.arctan2(ahead[1], ahead[0])) - 90.0
        axes.plot(
            *middle, marker=(3, 0, angle), ms=9, mec="white", mew=0.7, c=color, zorder=4
        )
    for item in program.skipped:
        line = np.stack([item.stroke.start_T, item.stroke.end_T])
        axes.plot(*line.T, color=style.VERMILION, lw=2.2, ls=":", zorder=3)
    if strokes:
        _mark_ends(axes, strokes[0].start_T, strokes[-1].end_T)
    figure.legend(
        handles=[
            *_stroke_entries(program),
            Line2D([], [], color=style.MUTED, ls=(0, (3, 2)), label="to the next"),
        ],
        loc="outside lower center",
        ncols=3,
    )
    return figure


def _mark_ends(axes: Axes, start_T: FloatArray, end_T: FloatArray) -> None:
    marks: dict[str, Any] = {"markersize": 7, "markeredgecolor": "white", "zorder": 5}
    axes.plot(*start_T, "o", color=style.GREEN, **marks)
    axes.plot(*end_T, "s", color=style.VERMILION, **marks)


def _stroke_entries(program: PaintProgram) -> Sequence[Line2D]:
    kinds: dict[str, list[float]] = {}
    for stroke in program.strokes:
        kinds.setdefault(stroke.kind, []).append(stroke.length)
    entries = [
        Line2D(
            [],
            [],
            color=_STROKE_COLORS.get(kind, style.GREEN),
            lw=2.2,
            label=f"{kind.replace('_', '-')}: {len(lengths)}, {sum(lengths):.1f} m",
        )
        for kind, lengths in kinds.items()
    ]
    if program.skipped:
        length = sum(item.stroke.length for item in program.skipped)
        label = f"left out: {len(program.skipped)}, {length:.1f} m"
        color = style.VERMILION
        entries.append(Line2D([], [], color=color, lw=2.2, ls=":", label=label))
    dot: dict[str, Any] = {"ls": "", "markersize": 6}
    entries.append(Line2D([], [], marker="o", color=style.GREEN, label="first", **dot))
    entries.append(
        Line2D([], [], marker="s", color=style.VERMILION, label="last", **dot)
    )
    return entries


@style.styled
def film_picture(film: Film, nominal: float) -> Figure:
    """Draws the wet film with the edges of keep-out areas and of the tile.

    Args:
        film: The film of a run: `thickness` (ny, nx) in m, row 0 at the bottom.
        nominal: Wet film thickness that the program aims at, m, greater than 0; the
            colours show µm and % of it.

    Returns:
        A Matplotlib figure; axes in m, in the scene's frame S. `png` renders it.
    """
    ny, nx = film.thickness.shape
    low = film.x0, film.y0
    size = nx * film.cell, ny * film.cell
    figure, axes, bar = style.film_figure(film.thickness / nominal, size, low)
    bar.set_label(f"wet film [% of nominal {1e6 * nominal:.0f} µm]")
    x, y = film.centres()
    entries = []
    tile = film.truth_paintable | film.truth_keepout
    outlines = (
        (film.truth_keepout, style.VERMILION, "edge of keep-out", "-"),
        (tile, "white", "edge of the tile", (0, (4, 3))),
    )
    for cells, color, label, dashes in outlines:
        if cells.any() and not cells.all():
            axes.contour(
                x,
                y,
                cells,
                levels=[0.5],
                colors=[color],
                linewidths=1.3,
                linestyles=[dashes],
            )
            line = "0.55" if color == "white" else color
            entries.append(Line2D([], [], color=line, ls=dashes, label=label))
    microns = bar.ax.secondary_yaxis(
        "left",
        functions=(
            functools.partial(np.multiply, 1e4 * nominal),
            functools.partial(np.multiply, 1e-4 / nominal),
        ),
    )
    microns.set_ylabel("wet film [µm]")
    if entries:
        figure.legend(handles=entries, loc="outside lower center", ncols=2)
    return figure


def grid_size(segmentation: WallSegmentation) -> tuple[float, float]:
    """Width and height of the segmented tile, m."""
    ny, nx = segmentation.labels.shape
    return nx * segmentation.cell, ny * segmentation.cell
