"""The film as planned, and how near it came to the film as laid."""

from typing import Any

import numpy as np

from painter.planning.config import TipConfig, ZoneConfig
from painter.planning.film.preview import FilmPreview, preview_film
from painter.planning.spray_path import PaintProgram
from painter.planning.tile import grid_points
from painter.planning.zones import in_zones
from painter.run.figures.film_on_tile import film_around
from painter.run.folder.folder import RunFolder
from painter.run.folder.values import Film


def run_preview(
    folder: RunFolder, program: PaintProgram, scenario: dict[str, Any]
) -> FilmPreview | None:
    """Predicts the film after a run's program, on the wall as the robot saw it.

    What an earlier run left counts, where this one went on from it.

    Args:
        folder: The run.
        program: Its program.
        scenario: Its scenario, for the tip and the operator's zones.

    Returns:
        The prediction, or None if the run has no segmentation.
    """
    segmentation = folder.segmentation()
    if segmentation is None:
        return None
    film, before = folder.film(), None
    if film is not None and film.before is not None:
        before = film_around(folder, segmentation, film.before)
    zones = [ZoneConfig(**zone) for zone in scenario["raster"]["zones"]]
    asked = in_zones(np.asarray(segmentation.wall_mask), segmentation.cell, zones)
    return preview_film(
        program.strokes,
        segmentation.replace(wall_mask=asked),
        tip=TipConfig(**scenario["gun"]["tip"]),
        nominal=program.nominal_thickness,
        before=before,
    )


def predicted_figures(
    folder: RunFolder, program: PaintProgram, film: Film, scenario: dict[str, Any]
) -> dict[str, float]:
    """Returns what was planned, and the mean difference from what was laid.

    Args:
        folder: The run.
        program: Its program.
        film: As laid.
        scenario: Its scenario.

    Returns:
        `predicted_coverage`, `predicted_overspray` and `predicted_film_error`, the mean
        |planned - laid| over the tile as share of nominal; none without truth.
    """
    preview, truth = run_preview(folder, program, scenario), folder.truth()
    if preview is None or truth is None:
        return {}
    X_TS = program.X_WT.inverse() @ truth.X_WS
    p_TQs = X_TS @ grid_points(*film.centres())
    planned = preview.film_at(p_TQs[0], p_TQs[1]).reshape(film.thickness.shape)
    tile = film.truth_paintable | film.truth_keepout
    error = np.abs(planned - film.thickness)[tile].mean()
    return {
        "predicted_coverage": preview.figures.coverage,
        "predicted_overspray": preview.figures.overspray,
        "predicted_film_error": float(error / program.nominal_thickness),
    }
