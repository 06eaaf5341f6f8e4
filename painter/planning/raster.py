"""Spray strokes over the part of a tile that is to be painted.

The mount fixes the fan's long axis along T x, and on a plumb wall the arm cannot roll
the gun: strokes run along T y only, on lines that `place_lines` spaces almost evenly
over the tile. A stroke of another kind (a cut-in along an edge, a touch-up) is planned
beside these and joins the same tuple.
"""

import numpy as np
from scipy.ndimage import distance_transform_edt

from painter.planning.config import RasterConfig, TipConfig
from painter.planning.spray_path import Stroke
from painter.planning.stroke_lines import place_lines, wall_share
from perception.values import BoolArray, FloatArray


def plan_strokes(
    mask: BoolArray, cell: float, *, tip: TipConfig, raster: RasterConfig
) -> tuple[Stroke, ...]:
    """Plans the strokes of a tile.

    On every line the gun is on where at least `raster.wall_share` of the fan's flow
    lands on wall that is to be painted, and `raster.lead` beyond both ends of that.

    Args:
        mask: (ny, nx) bool, True = to be painted, row 0 at the bottom of the tile.
        cell: Edge of a cell, m.
        tip: The spray tip, its fan's long axis along T x.
        raster: Settings of the raster.

    Returns:
        Strokes in order of execution, up and down in turn from the left; none where
        nothing is to be painted.

    Raises:
        ValueError: The mask is not a 2-D array of bool.
    """
    if mask.ndim != 2 or mask.dtype != np.bool_:
        raise ValueError(
            f"mask must be 2-D bool, got {mask.ndim}-D {mask.dtype} instead."
        )
    paintable = _keep_off(mask, round(raster.keepout_margin / cell, 6))
    lines = place_lines(paintable, cell, tip=tip, raster=raster)
    return _strokes_on(lines, paintable, cell, tip=tip, raster=raster)


def _keep_off(mask: BoolArray, margin: float) -> BoolArray:
    """Returns the cells farther than `margin` (cells) from any that stay clean."""
    if mask.all():
        return mask
    # The distance to the nearest clean cell's centre reaches half a cell into it.
    return np.asarray(distance_transform_edt(mask) - 0.5 >= max(margin, 0.5))


def _strokes_on(
    lines: FloatArray,
    paintable: BoolArray,
    cell: float,
    *,
    tip: TipConfig,
    raster: RasterConfig,
) -> tuple[Stroke, ...]:
    """Returns the strokes on a grid of lines, in order of execution."""
    share = wall_share(paintable, cell, lines, tip=tip, standoff=raster.standoff)
    strokes: list[Stroke] = []
    upwards = True
    for column, x_line in enumerate(lines):
        on = share[:, column] >= raster.wall_share
        spans = _spans(on, cell, tip=tip, raster=raster)
        if not upwards:
            spans = [(high, low) for low, high in reversed(spans)]
        strokes += [
            Stroke(
                start_T=np.array([x_line, y_start]),
                end_T=np.array([x_line, y_end]),
                speed=raster.speed,
                kind="body",
                column=column,
                standoff=raster.standoff,
            )
            for y_start, y_end in spans
        ]
        if spans:
            upwards = not upwards
    return tuple(strokes)


def _spans(
    on: BoolArray, cell: float, *, tip: TipConfig, raster: RasterConfig
) -> list[tuple[float, float]]:
    """Returns the stretches of a line on which the gun is open, bottom to top.

    Args:
        on: (ny,) bool, rows on which it is wanted open.
        cell: Edge of a cell, m.
        tip: Its valve cannot close and open again in less than two delays.
        raster: Gives lead, shortest stroke and speed.
    """
    edges = np.flatnonzero(np.diff(on, prepend=False, append=False))
    shortest_gap = max(raster.min_stroke, 2.0 * tip.valve_delay * raster.speed)
    spans: list[tuple[float, float]] = []
    for first, end in edges.reshape(-1, 2):
        if (end - first) * cell < raster.min_stroke:
            continue
        low, high = first * cell - raster.lead, end * cell + raster.lead
        if spans and low - spans[-1][1] < shortest_gap:
            low, _ = spans.pop()
        spans.append((low, high))
    return spans
