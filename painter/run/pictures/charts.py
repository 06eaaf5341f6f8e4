"""Charts of a run: film histogram, timeline of the phases, tracking errors."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from painter.planning.film.figures import COVERED
from painter.planning.spray_path import PaintProgram
from painter.run.figures.film_figures import HALF_COVERED, edge_distance
from painter.run.figures.time_figures import (
    STOPPED,
    Event,
    compute_times,
    computing_phases,
    phase_spans,
    phase_times,
)
from painter.run.figures.tracking_figures import (
    gun_angle_errors,
    spraying,
    tip_errors,
    wall_points,
)
from painter.run.folder.values import Executed, Film
from painter.run.pictures import style

_CLOSED = "#c3cad3"


@style.styled
def film_histogram(film: Film, nominal: float, fan_width: float) -> Figure:
    """Draws how the film is spread over the paintable cells and their interior."""
    percent = 100 * film.thickness / nominal
    far = edge_distance(film.truth_paintable, film.cell) >= 0.5 * fan_width
    figure = style.new_figure(5.4, 4.6)
    axes = figure.add_subplot()
    bins = np.linspace(0.0, 200.0, 101)
    all_cells = np.minimum(percent[film.truth_paintable], 199)
    weights = np.full(all_cells.size, 100 / max(all_cells.size, 1))
    axes.hist(
        all_cells, list(bins), weights=weights, color=style.SKY, label="all wall cells"
    )
    inner = np.minimum(percent[far], 199)
    axes.hist(
        inner,
        list(bins),
        weights=np.full(inner.size, 100 / max(all_cells.size, 1)),
        color=style.BLUE,
        label="half a fan or more from any edge",
    )
    marks = {
        "half covered": (100 * HALF_COVERED, style.MUTED),
        "covered": (100 * COVERED, style.VERMILION),
        "nominal": (100.0, style.INK),
    }
    for name, (value, color) in marks.items():
        axes.axvline(
            value, color=color, lw=1.1, ls="--", label=f"{name}, {value:.0f} %"
        )
    axes.set_xlim(0, 200)
    axes.set_xlabel(f"wet film [% of nominal {1e6 * nominal:.0f} µm]")
    axes.set_ylabel("share of wall cells [% in 2 % steps]")
    axes.grid(axis="y")
    axes.spines[["top", "right"]].set_visible(False)
    figure.legend(loc="outside lower center", ncols=2)
    return figure


@style.styled
def timeline(events: Sequence[Event]) -> Figure:
    """Draws the phases over robot time, and where and how long the brain computed."""
    spans = phase_spans(events)
    names = list(dict.fromkeys(name for name, _, _ in spans))
    rows = {name: row for row, name in enumerate(names)}
    end = max((stop for _, _, stop in spans), default=1.0) or 1.0
    figure = style.new_figure(11.0, 0.8 + 0.3 * max(len(names), 1))
    axes = figure.add_subplot()
    for name, start, stop in spans:
        color = style.VERMILION if name in STOPPED else style.BLUE
        axes.barh(rows[name], stop - start, left=start, height=0.62, color=color)
        axes.plot([start, start], [rows[name] - 0.31, rows[name] + 0.31], color=color)
    for name, row in rows.items():
        stop = max(stop for other, _, stop in spans if other == name)
        axes.text(stop + 0.012 * end, row, _row_text(events, name), va="center", size=8)
    for phase, event in computing_phases(events):
        size = 3.0 + 4.0 * np.sqrt(min(float(event["compute_s"]), 6.0))
        place = float(event["time"]), rows.get(phase, 0)
        axes.plot(*place, "D", ms=size, color=style.ORANGE, mec="white")
    axes.set_yticks(range(len(names)), names)
    axes.set(ylim=(len(names) - 0.4, -0.6), xlim=(-0.005 * end, 1.1 * end))
    axes.set_xlabel("robot time [s]")
    axes.grid(axis="x")
    axes.spines[["top", "right", "left"]].set_visible(False)
    axes.tick_params(axis="y", length=0)
    total = sum(compute_times(events).values())
    mark = Line2D([], [], marker="D", ls="", color=style.ORANGE, mec="white")
    mark.set_label(f"computing while the arm stands, {total:.1f} s in all")
    figure.legend(handles=[mark], loc="outside upper right")
    return figure


def _row_text(events: Sequence[Event], phase: str) -> str:
    moving = phase_times(events)[phase]
    computing = sum(
        float(event["compute_s"])
        for name, event in computing_phases(events)
        if name == phase
    )
    parts = [f"{moving:.1f} s"] if moving >= 0.05 else []
    if computing >= 0.05:
        parts.append(f"computing {computing:.1f} s")
    return " + ".join(parts)


@style.styled
def tracking_chart(executed: Executed, program: PaintProgram) -> Figure:
    """Draws tip error, gun angle error and speed along the wall while spraying."""
    on = spraying(executed)
    time = executed.time
    p_TPs = wall_points(executed, program.X_WT.GetAsMatrix4())
    speed = np.linalg.norm(np.gradient(p_TPs, time, axis=0), axis=1)
    nominal = max((stroke.speed for stroke in program.strokes), default=0.0)
    rows = (
        (1000 * tip_errors(executed), "tip error\n[mm]", 2.0),
        (np.rad2deg(gun_angle_errors(executed)), "gun angle error\n[deg]", 1.0),
        (speed, "speed on the wall\n[m/s]", nominal),
    )
    figure = style.new_figure(11.0, 4.4)
    many = figure.subplots(len(rows), 1, sharex=True)
    first, last = (time[on][0], time[on][-1]) if on.any() else (time[0], time[-1])
    for axes, (values, label, target) in zip(many, rows, strict=True):
        axes.plot(time, np.where(on, np.nan, values), color=_CLOSED, lw=0.9)
        axes.plot(time, np.where(on, values, np.nan), color=style.BLUE, lw=1.2)
        during = values[(time >= first) & (time <= last) & np.isfinite(values)]
        top = max(target, float(during.max()) if during.size else 0.0)
        axes.axhline(target, color=style.VERMILION, lw=1.0, ls="--")
        # Ways between strokes may be far faster than strokes.
        axes.set(
            ylabel=label,
            ylim=(0.0, min(1.15 * top, 2.5 * target)),
            xlim=(first - 1, last + 1),
        )
        axes.grid(axis="y")
        axes.spines[["top", "right"]].set_visible(False)
    many[-1].set_xlabel("robot time [s]")
    figure.align_ylabels(many)
    entries = [
        Line2D([], [], color=style.BLUE, label="gun open"),
        Line2D([], [], color=_CLOSED, label="gun closed"),
        Line2D(
            [],
            [],
            color=style.VERMILION,
            ls="--",
            label="bound or commanded speed on strokes",
        ),
    ]
    figure.legend(handles=entries, loc="outside upper right", ncols=3)
    return figure
