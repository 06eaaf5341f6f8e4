"""All figures of a run, computed from the files it left (DESIGN section 6)."""

from typing import Any

from painter.planning.spray_path import PaintProgram
from painter.run.figures.film_figures import film_figures, mass_balance_error
from painter.run.figures.mask_figures import mask_figures, tile_figures
from painter.run.figures.predicted_film import predicted_figures
from painter.run.figures.time_figures import (
    COLLISION,
    ENDED,
    STARTED,
    named,
    time_figures,
    timing_figures,
)
from painter.run.figures.tracking_figures import tracking_figures
from painter.run.folder.folder import RunFolder

INTERRUPTED = "INTERRUPTED"


def run_figures(folder: RunFolder) -> dict[str, Any]:
    """Computes the content of report.json.

    A figure that cannot be known from what is there is left out. All wall-clock figures
    stand under `timing`; all others repeat with the same seed.

    Args:
        folder: A run, complete or not.

    Returns:
        JSON values by the names of DESIGN section 6, in a fixed order.

    Raises:
        InputError: A file of the run cannot be read.
    """
    scenario = folder.scenario()
    events = folder.events()
    ended = named(events, ENDED)
    started = named(events, STARTED)
    last: dict[str, Any] = dict(ended[-1]) if ended else {"result": INTERRUPTED}
    figures: dict[str, Any] = {
        "scenario": scenario.get("name"),
        "scene": scenario.get("scene"),
        "seed": scenario.get("random_seed"),
        "result": last["result"],
        "cause": last.get("cause"),
        "code": last.get("code"),
    }
    figures |= time_figures(events)
    figures |= _mask(folder)
    program = folder.program()
    if program is not None:
        figures |= _program(program)
        figures |= _film(folder, program, scenario) | _tracking(folder, program)
    figures["collisions"] = len(named(events, COLLISION))
    truth = folder.truth()
    figures["truth_source"] = truth.source if truth is not None else None
    figures["versions"] = dict(started[0].get("versions", {})) if started else {}
    figures["timing"] = timing_figures(events)
    return figures


def fan_width(scenario: dict[str, Any]) -> float:
    """Length of the fan's long axis on the wall at the scenario's stand-off, m."""
    tip = scenario["gun"]["tip"]
    scale = scenario["raster"]["standoff"] / tip["fan_distance"]
    return float(tip["fan_width"] * scale)


def _mask(folder: RunFolder) -> dict[str, Any]:
    segmentation, truth = folder.segmentation(), folder.truth()
    if segmentation is None:
        return {}
    mask, cell = segmentation.wall_mask, segmentation.cell
    figures: dict[str, Any] = {"mask_area_m2": float(mask.sum() * cell**2)}
    if truth is not None:
        figures |= mask_figures(mask, truth.wall_mask, cell)
        figures |= tile_figures(truth.X_WS.inverse() @ segmentation.X_WT)
    return figures


def _program(program: PaintProgram) -> dict[str, Any]:
    return {
        "stroke_count": len(program.strokes),
        "stroke_length_m": sum(stroke.length for stroke in program.strokes),
        "skipped_length_m": float(sum(item.stroke.length for item in program.skipped)),
        "program_time_s": program.motion.duration,
        "nominal_thickness_m": program.nominal_thickness,
    }


def _film(
    folder: RunFolder, program: PaintProgram, scenario: dict[str, Any]
) -> dict[str, Any]:
    film = folder.film()
    if film is None:
        return {}
    efficiency = scenario["gun"]["tip"]["transfer_efficiency"]
    figures = film_figures(
        film, nominal=program.nominal_thickness, fan_width=fan_width(scenario)
    )
    figures |= predicted_figures(folder, program, film, scenario)
    return figures | {
        "mass_balance_error": mass_balance_error(film, efficiency),
        "sprayed_m3": film.sprayed,
    }


def _tracking(folder: RunFolder, program: PaintProgram) -> dict[str, Any]:
    executed = folder.executed()
    if executed is None:
        return {}
    return tracking_figures(executed, program.strokes, program.X_WT.GetAsMatrix4())
