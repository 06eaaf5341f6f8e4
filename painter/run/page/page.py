"""The report page: one HTML file with everything in it."""

import base64
import json
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from pydrake.math import RigidTransform

from painter.planning.config import TileConfig
from painter.planning.tile import nominal_tile_pose
from painter.run.figures.figures import fan_width
from painter.run.figures.predicted_film import run_preview
from painter.run.figures.time_figures import (
    COLLISION,
    DONE,
    STOPPED,
    named,
    phase_spans,
)
from painter.run.folder import folder as files
from painter.run.folder.folder import RunFolder
from painter.run.page.catalog import FIGURES, HEADLINE, FigureInfo, figure_info
from painter.run.pictures import charts, pictures, style
from painter.run.pictures.film_preview import preview_picture

_TITLES = {
    "cycle_time_s": "Cycle time",
    "coverage": "Coverage",
    "overspray": "Overspray",
    "mask_iou": "Mask IoU",
    "collisions": "Collisions",
}


def report_page(folder: RunFolder, figures: Mapping[str, Any]) -> str:
    """Makes the page of a run, complete or not.

    Args:
        folder: The run; each picture is there whose files are.
        figures: The content of report.json.

    Returns:
        A self-contained HTML document.

    Raises:
        InputError: A file of the run cannot be read.
    """
    sheet = Path(__file__).with_name("report.css").read_text(encoding="utf-8")
    title = f"Paint cycle: {figures.get('scene')}, seed {figures.get('seed')}"
    sections = [
        _header(folder, figures),
        _tiles(figures),
        _section("Timeline", _pictures(_timeline(folder))),
        _section("The wall, from first sight to film", _pictures(_wall(folder))),
        _section("Tracking", _pictures(_tracking(folder))),
        _section("All figures", _table(figures)),
        _section("Run", _details(folder, figures)),
    ]
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">\n'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>\n{sheet}</style></head>\n"
        f"<body><main>\n{''.join(sections)}</main></body></html>\n"
    )


def _header(folder: RunFolder, figures: Mapping[str, Any]) -> str:
    result = str(figures["result"])
    good = result == DONE
    parts = [
        f"scene <b>{escape(str(figures.get('scene')))}</b>",
        f"seed {escape(str(figures.get('seed')))}",
        f"scenario {escape(str(figures.get('scenario')))}",
    ]
    if (folder.path / files.SCENE).exists():
        parts.append(f'<a href="{files.SCENE}">3-D replay of the cycle</a>')
    notice = ""
    if not good:
        phases = [name for name, _, _ in phase_spans(folder.events())]
        working = [name for name in phases if name not in STOPPED]
        phase = f" in {working[-1]}" if working else ""
        cause = escape(
            str(figures.get("cause") or "the run broke off; no cause is known")
        )
        notice = (
            f'<p class="notice"><b>This run is not complete: {escape(result)}{phase}.'
            f"</b><br>{cause}<br>Below is what it left; figures that cannot be known "
            "are shown as a dash.</p>"
        )
    return (
        f"<header><h1>Paint cycle<span "
        f'class="result {"good" if good else "bad"}">{escape(result)}</span></h1>'
        f"<p>{' · '.join(parts)}</p>{notice}</header>\n"
    )


def _tiles(figures: Mapping[str, Any]) -> str:
    tiles = []
    for name in HEADLINE:
        info = figure_info(name)
        mark, word = _status(info, figures)
        target = f"target {info.target()}"
        tiles.append(
            f'<div class="tile {mark}"><div class="name">{_TITLES[name]}</div>'
            f'<div class="value">{escape(info.text(figures))}</div>'
            f'<div class="target"><span class="mark">{word}</span> {target}</div></div>'
        )
    return f'<div class="tiles">{"".join(tiles)}</div>\n'


def _status(info: FigureInfo, figures: Mapping[str, Any]) -> tuple[str, str]:
    passes = info.passes(figures)
    # What a run did before it broke off earns it no tick.
    if passes is None or (passes and figures["result"] != DONE):
        return "", ""
    return ("good", "✓ met") if passes else ("bad", "✗ missed")


def _timeline(folder: RunFolder) -> list[str]:
    events = folder.events()
    if not any("phase" in event for event in events):
        return []
    return [
        _picture(
            "Phases",
            "robot time in each phase; diamonds mark where perception or planning "
            "computed while the robot stood.",
            style.png(charts.timeline(events)),
            wide=True,
        )
    ]


def _wall(folder: RunFolder) -> list[str]:
    segmentation, truth = folder.segmentation(), folder.truth()
    points, program, film = folder.map_points(), folder.program(), folder.film()
    shown: list[str] = []
    look = folder.path / files.LOOK
    if look.exists():
        text = "colour picture of the wall camera, from where the arm first looks."
        shown.append(_picture("First sight", text, look.read_bytes()))
    if points is not None:
        X_WT, size = (
            _tile(folder)
            if segmentation is None
            else (
                segmentation.X_WT,
                pictures.grid_size(segmentation),
            )
        )
        text = "fused points of the scan, as distance from the wall's plane."
        drawn = pictures.map_picture(X_WT.inverse() @ points, size)
        shown.append(_picture("Map", text, style.png(drawn)))
    if segmentation is not None:
        text = "the segmenter's labels; 1 is the largest region."
        drawn = pictures.label_picture(segmentation)
        shown.append(_picture("Regions", text, style.png(drawn)))
        text = (
            "what is to be painted and what is to stay clean."
            if truth is None
            else "against the truth from the scene's geometry."
        )
        drawn = pictures.mask_picture(
            segmentation, None if truth is None else truth.wall_mask
        )
        shown.append(_picture("Paint mask", text, style.png(drawn)))
    if program is not None and segmentation is not None:
        text = "by kind, over the mask; arrows show the gun's direction."
        drawn = pictures.stroke_picture(program, segmentation)
        shown.append(_picture("Strokes", text, style.png(drawn)))
    if film is not None and program is not None:
        nominal = program.nominal_thickness
        text = "wet paint on the true surface as seen from the robot."
        drawn = pictures.film_picture(film, nominal)
        shown.append(_picture("Film", text, style.png(drawn)))
        planned = run_preview(folder, program, folder.scenario())
        if planned is not None and segmentation is not None:
            text = "wet paint as planned, over the mask as the robot saw it."
            drawn = preview_picture(planned, segmentation, nominal)
            shown.append(_picture("Film as planned", text, style.png(drawn)))
        text = "share of the wall's cells by wet thickness."
        drawn = charts.film_histogram(film, nominal, fan_width(folder.scenario()))
        shown.append(_picture("Film thickness", text, style.png(drawn)))
    return shown


def _tile(folder: RunFolder) -> tuple[RigidTransform, tuple[float, float]]:
    tile = TileConfig(**folder.scenario()["tile"])
    return nominal_tile_pose(tile), (tile.width, tile.height)


def _tracking(folder: RunFolder) -> list[str]:
    executed, program = folder.executed(), folder.program()
    if executed is None or program is None:
        return []
    return [
        _picture(
            "Executed against commanded",
            "nozzle position, gun orientation and speed over the painting.",
            style.png(charts.tracking_chart(executed, program)),
            wide=True,
        )
    ]


def _picture(name: str, text: str, image: bytes, *, wide: bool = False) -> str:
    data = base64.b64encode(image).decode("ascii")
    return (
        f"<figure{' class=wide' if wide else ''}><figcaption><b>{name}</b>: {text}"
        f'</figcaption><img alt="{name}: {escape(text)}" '
        f'src="data:image/png;base64,{data}"></figure>\n'
    )


def _pictures(shown: Sequence[str]) -> str:
    return f'<div class="pictures">{"".join(shown)}</div>\n' if shown else ""


def _section(title: str, content: str) -> str:
    return f"<section><h2>{title}</h2>\n{content}</section>\n" if content else ""


def _table(figures: Mapping[str, Any]) -> str:
    rows, group = [], ""
    for info in FIGURES:
        if info.group != group:
            group = info.group
            rows.append(
                f"<tr><th>{group}</th><th>value</th><th>target</th><th>meaning</th></tr>"
            )
        mark, word = _status(info, figures)
        rows.append(
            f"<tr><td><code>{info.name}</code></td>"
            f'<td class="number">{escape(info.text(figures))}</td>'
            f'<td class="status {mark}">{info.target()} {word.partition(" ")[0]}</td>'
            f"<td>{escape(info.meaning)}</td></tr>"
        )
    return f"<table>{''.join(rows)}</table>\n"


def _details(folder: RunFolder, figures: Mapping[str, Any]) -> str:
    versions = figures.get("versions", {})
    software = ", ".join(f"{name} {number}" for name, number in versions.items())
    collisions = named(folder.events(), COLLISION)
    blocks = [
        ("Scenario, as resolved", (folder.path / files.SCENARIO).read_text()),
        ("Events", (folder.path / files.EVENTS).read_text()),
        ("report.json", json.dumps(figures, indent=2)),
    ]
    text = "".join(
        f"<details><summary>{name}</summary><pre>{escape(content)}</pre></details>\n"
        for name, content in blocks
    )
    truth = figures.get("truth_source")
    notes = [
        f"Truth: {truth}" if truth else "",
        f"Made with {software}" if software else "",
    ]
    if collisions:
        notes.insert(0, f"{len(collisions)} collisions; see the events.")
    footer = " · ".join(escape(note.rstrip(".")) for note in notes if note)
    return f"{text}<footer>{footer}</footer>\n"
