"""The report page: one HTML file with everything in it, from report.html.j2."""

import base64
import itertools
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup
from matplotlib.figure import Figure

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

_HERE = Path(__file__).parent


@dataclass(frozen=True)
class Picture:
    """One picture of the page.

    Attributes:
        name: Its title.
        text: What it shows, one sentence.
        data: PNG, base64.
        wide: Whether it takes the whole width of the page.
    """

    name: str
    text: str
    data: str
    wide: bool = False

    @classmethod
    def of(
        cls, name: str, text: str, drawn: Figure | bytes, **options: Any
    ) -> "Picture":
        """Makes one of a figure or of PNG data."""
        image = drawn if isinstance(drawn, bytes) else style.png(drawn)
        return cls(name, text, base64.b64encode(image).decode("ascii"), **options)


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
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(_HERE),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    events = folder.events()
    phases = [name for name, _, _ in phase_spans(events) if name not in STOPPED]
    return environment.get_template("report.html.j2").render(
        sheet=Markup((_HERE / "report.css").read_text(encoding="utf-8")),
        figures={
            "scene": None,
            "seed": None,
            "scenario": None,
            "cause": None,
            "code": None,
        }
        | dict(figures),
        is_done=figures["result"] == DONE,
        last_phase=phases[-1] if phases else "",
        replay=files.SCENE,
        has_replay=(folder.path / files.SCENE).exists(),
        headline=[
            (title, _row(figure_info(name), figures))
            for name, title in HEADLINE.items()
        ],
        groups=[
            (group, [_row(info, figures) for info in infos])
            for group, infos in itertools.groupby(FIGURES, lambda info: info.group)
        ],
        timeline=list(_timeline(events)),
        wall=list(_wall(folder)),
        tracking=list(_tracking(folder)),
        files={
            "Scenario, as resolved": (folder.path / files.SCENARIO).read_text(),
            "Events": (folder.path / files.EVENTS).read_text(),
            "report.json": json.dumps(figures, indent=2),
        },
        notes=list(_notes(events, figures)),
    )


def _row(info: FigureInfo, figures: Mapping[str, Any]) -> dict[str, Any]:
    """Returns one figure as the page shows it."""
    passes = info.passes(figures)
    # What a run did before it broke off earns it no tick.
    if passes is None or (passes and figures["result"] != DONE):
        mark, sign, word = "", "", ""
    else:
        mark, sign, word = ("good", "✓", "met") if passes else ("bad", "✗", "missed")
    return {
        "name": info.name,
        "meaning": info.meaning,
        "text": info.text(figures),
        "target": info.target(),
        "mark": mark,
        "sign": sign,
        "word": word,
    }


def _timeline(events: list[dict[str, Any]]) -> Iterator[Picture]:
    if any("phase" in event for event in events):
        yield Picture.of(
            "Phases",
            "robot time in each phase; diamonds mark where perception or planning "
            "computed while the robot stood.",
            charts.timeline(events),
            wide=True,
        )


def _wall(folder: RunFolder) -> Iterator[Picture]:
    segmentation, truth = folder.segmentation(), folder.truth()
    points, program, film = folder.map_points(), folder.program(), folder.film()
    look = folder.path / files.LOOK
    if look.exists():
        text = "colour picture of the wall camera, from where the arm first looks."
        yield Picture.of("First sight", text, look.read_bytes())
    if points is not None:
        if segmentation is None:
            tile = TileConfig(**folder.scenario()["tile"])
            X_WT, size = nominal_tile_pose(tile), (tile.width, tile.height)
        else:
            X_WT, size = segmentation.X_WT, pictures.grid_size(segmentation)
        text = "fused points of the scan, as distance from the wall's plane."
        yield Picture.of(
            "Map", text, pictures.map_picture(X_WT.inverse() @ points, size)
        )
    if segmentation is None:
        return
    text = "the segmenter's labels; 1 is the largest region."
    yield Picture.of("Regions", text, pictures.label_picture(segmentation))
    text = (
        "what is paintable and what is keep-out."
        if truth is None
        else "against the truth from the scene's geometry."
    )
    true_mask = None if truth is None else truth.wall_mask
    yield Picture.of("Paint mask", text, pictures.mask_picture(segmentation, true_mask))
    if program is None:
        return
    text = "by kind, over the mask; arrows show the gun's direction."
    yield Picture.of("Strokes", text, pictures.stroke_picture(program, segmentation))
    if film is None:
        return
    nominal, scenario = program.nominal_thickness, folder.scenario()
    text = "wet paint on the true surface as seen from the robot."
    yield Picture.of("Film", text, pictures.film_picture(film, nominal))
    planned = run_preview(folder, program, scenario)
    if planned is not None:
        text = "wet paint as planned, over the mask as the robot saw it."
        drawn = preview_picture(planned, segmentation, nominal)
        yield Picture.of("Film as planned", text, drawn)
    text = "share of the wall's cells by wet thickness."
    drawn = charts.film_histogram(film, nominal, fan_width(scenario))
    yield Picture.of("Film thickness", text, drawn)


def _tracking(folder: RunFolder) -> Iterator[Picture]:
    executed, program = folder.executed(), folder.program()
    if executed is not None and program is not None:
        yield Picture.of(
            "Executed against commanded",
            "nozzle position, gun orientation and speed while painting.",
            charts.tracking_chart(executed, program),
            wide=True,
        )


def _notes(events: list[dict[str, Any]], figures: Mapping[str, Any]) -> Iterator[str]:
    """Yields the notes at the foot of the page."""
    collisions = len(named(events, COLLISION))
    if collisions:
        yield f"{collisions} collisions; see the events"
    if figures.get("truth_source"):
        yield f"Truth: {figures['truth_source'].rstrip('.')}"
    versions = figures.get("versions", {})
    if versions:
        made_with = ", ".join(f"{name} {number}" for name, number in versions.items())
        yield f"Made with {made_with}"
