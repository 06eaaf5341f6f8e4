"""Spray strokes over the part of a tile that is to be painted.

The mount fixes the fan's long axis along T x, and before a plumb wall the arm cannot
roll the gun: strokes run along T y only, on lines that `place_lines` spaces almost
evenly over the tile. A line is left open where it would spray a keep-out;
`find_cut_ins` fills in with narrower strokes from nearer to the wall, and `FilmFit`
fits them all.
"""

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import distance_transform_edt

from painter.planning.film.film_cost import FilmCost
from painter.planning.film.film_model import FilmModel, Site
from painter.planning.spray_path import Stroke
from painter.planning.strokes.cut_in import find_cut_ins
from painter.planning.strokes.film_fit import LEAST_FLOW, FilmFit
from painter.planning.strokes.spans import Span, runs
from painter.planning.strokes.spray_settings import SpraySettings
from painter.planning.strokes.stroke_lines import (
    EDGE_FLOW,
    lines_between,
    place_lines,
    wall_share,
)
from painter.planning.zones import in_zones
from perception.ground import BoolArray, FloatArray

# Of a raster line before it is fitted: the greatest share of the flow that may land on
# keep-out, the same on a tile whose keep-outs are openings alone, beside which narrower
# strokes do better, the least share that must land on wall to be painted, and the same
# where a keep-out is within the fan's reach.
_MOST_OVERSPRAY = 0.03
_MOST_OVERSPRAY_OPENING = 0.003
_LEAST_USE = 0.35
_LEAST_USE_NARROW = 0.93
_SAME_LINE = 0.002  # m


def plan_strokes(
    mask: BoolArray,
    cell: float,
    spray: SpraySettings,
    *,
    height: FloatArray | None = None,
    nearest: FloatArray | None = None,
) -> tuple[Stroke, ...]:
    """Plans the strokes of a tile.

    Without cut-in, the gun is open where at least `raster.wall_share` of the fan's flow
    lands on wall that is to be painted, and `raster.lead` beyond both ends of that.
    With it, strokes on the same lines and narrower ones beside edges are fitted to the
    film that they leave; every coat lays the same share of it, every second one from
    lines half way between those of the others.

    Args:
        mask: (ny, nx) bool, True = to be painted, row 0 at the bottom of the tile.
        cell: Edge of a cell, m.
        spray: The tip and the settings of its strokes.
        height: (ny, nx) m, along T z, what stands out or lies back, NaN = nothing
            seen; None = a plane. For cut-in.
        nearest: Least stand-offs, as `Site` has them; None = any. For cut-in.

    Returns:
        Strokes from the left, coat by coat; none where nothing is to be painted.
        Without cut-in they go up and down in turn, else all upwards.

    Raises:
        ValueError: The mask is not a 2-D array of bool.
    """
    if mask.ndim != 2 or mask.dtype != np.bool_:
        raise ValueError(
            f"mask must be 2-D bool, got {mask.ndim}-D {mask.dtype} instead."
        )
    raster = spray.raster
    marked = in_zones(mask, cell, raster.zones)
    paintable = _keep_off(marked, round(raster.keepout_margin / cell, 6))
    if not paintable.any():
        return ()
    lines = place_lines(paintable, cell, spray)
    if not raster.cut_in:
        return _strokes_on(lines, paintable, cell, spray)
    site = Site.of_tile(paintable, cell, height, nearest)
    # Coats alternate between the lines and those half way between them.
    width = mask.shape[1] * cell
    phases = (lines, lines_between(lines, width))[: raster.coats]
    plans = [
        _fitted(phase, site, spray, width=width, between=number == 1)
        for number, phase in enumerate(phases)
    ]
    return tuple(
        stroke.replace(flow=stroke.flow / raster.coats, coat=coat + 1)
        for coat in range(raster.coats)
        for stroke in plans[coat % len(plans)]
    )


def _fitted(
    lines: FloatArray,
    site: Site,
    spray: SpraySettings,
    *,
    width: float,
    between: bool,
) -> tuple[Stroke, ...]:
    """Returns the strokes that leave all of the film from one set of lines.

    Args:
        lines: (n,) m, x of the raster's lines in T.
        site: The tile and its margin.
        spray: The tip and the settings of its strokes.
        width: Of the tile, m.
        between: The lines are those of `lines_between`.
    """
    tip, raster = spray
    nominal = spray.nominal_film(width)
    model = FilmModel(site, tip=tip, speed=raster.speed, nominal=nominal)
    fit = FilmFit(
        model,
        FilmCost.fine(site),
        raster=raster,
        least_flow=raster.coats * LEAST_FLOW,
    )
    for span in _body_spans(lines, fit, model, spray):
        at_edge = between and span.x in (lines[0], lines[-1])
        fit.add(span._replace(flow=EDGE_FLOW) if at_edge else span)
    if raster.cut_in_standoff < raster.standoff:
        find_cut_ins(fit, model, spray)
    fit.fit()
    return fitted_strokes(fit.spans, spray)


def _body_spans(
    lines: FloatArray, fit: FilmFit, model: FilmModel, spray: SpraySettings
) -> list[Span]:
    """Returns where raster lines leave no overspray; the rest is for cut-in."""
    site, standoff = model.site, spray.raster.standoff
    spans: list[Span] = []
    most = _MOST_OVERSPRAY if site.stands_out else _MOST_OVERSPRAY_OPENING
    clear_rows = fit.clear_rows(lines, standoff).T
    for x_line, clear in zip(lines, clear_rows, strict=True):
        line = model.line(float(x_line), standoff)
        window = slice(*line.columns)
        flow = line.film.sum(axis=1)
        overspray = (line.film * site.keepout[:, window]).sum(axis=1)
        useful = (line.film * site.paintable[:, window]).sum(axis=1)
        # Where the wall is narrower than the fan, narrow strokes do better.
        narrow = site.keepout[:, window].any(axis=1)
        least = np.where(narrow, _LEAST_USE_NARROW, _LEAST_USE)
        on = clear & (overspray < most * flow) & (useful > least * flow)
        for first, end in runs(on):
            low, high = ((row - site.border) * site.cell for row in (first, end))
            if high - low >= spray.raster.min_stroke:
                spans.append(Span(float(x_line), low, high, standoff, 1.0))
    return spans


def fitted_strokes(spans: Sequence[Span], spray: SpraySettings) -> tuple[Stroke, ...]:
    """Returns fitted spans as strokes, upwards; too short gaps are closed."""
    joined: list[Span] = []
    for span in sorted(spans, key=lambda span: (round(span.x, 4), span.low)):
        last = joined[-1] if joined else None
        if (
            last is not None
            and abs(span.x - last.x) < _SAME_LINE
            and span[3:] == last[3:]
            and max(span.low, last.low) - min(span.high, last.high) < spray.shortest_gap
        ):
            low, high = min(last.low, span.low), max(last.high, span.high)
            joined[-1] = last._replace(low=low, high=high)
        else:
            joined.append(span)
    across = [round(span.x_at(0.5 * (span.low + span.high)), 3) for span in joined]
    places = sorted(set(across))
    raster = spray.raster
    return tuple(
        Stroke(
            start_T=np.array([span.x_at(span.low), span.low]),
            end_T=np.array([span.x_at(span.high), span.high]),
            speed=raster.speed,
            kind="body" if span.standoff == raster.standoff else "cut_in",
            column=places.index(place),
            standoff=span.standoff,
            flow=min(span.flow, 1.0),
        )
        for span, place in zip(joined, across, strict=True)
    )


def _keep_off(mask: BoolArray, margin: float) -> BoolArray:
    """Returns the cells of a mask farther than `margin` (cells) from any keep-out."""
    if mask.all():
        return mask
    # The distance to the nearest keep-out cell's centre reaches half a cell into it.
    return np.asarray(distance_transform_edt(mask) - 0.5 >= max(margin, 0.5))


def _strokes_on(
    lines: FloatArray, paintable: BoolArray, cell: float, spray: SpraySettings
) -> tuple[Stroke, ...]:
    """Returns the strokes on a set of lines, in order of execution."""
    tip, raster = spray
    share = wall_share(paintable, cell, lines, tip=tip, standoff=raster.standoff)
    strokes: list[Stroke] = []
    upwards = True
    for column, x_line in enumerate(lines):
        spans = _open_spans(share[:, column] >= raster.wall_share, cell, spray)
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


def _open_spans(
    on: BoolArray, cell: float, spray: SpraySettings
) -> list[tuple[float, float]]:
    """Returns the spans of a line on which the gun is open, m, bottom to top.

    Args:
        on: (ny,) bool, rows on which it should be open.
        cell: Edge of a cell, m.
        spray: Gives lead, shortest stroke and shortest gap.
    """
    raster = spray.raster
    spans: list[tuple[float, float]] = []
    for first, end in runs(on):
        if (end - first) * cell < raster.min_stroke:
            continue
        low, high = first * cell - raster.lead, end * cell + raster.lead
        if spans and low - spans[-1][1] < spray.shortest_gap:
            low, _ = spans.pop()
        spans.append((low, high))
    return spans
