"""`painter plan`: a segmentation to a paint program."""

import time
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from painter.cli.common import (
    ExcludeOption,
    IncludeOption,
    JsonOption,
    OutOption,
    SetOption,
    mark_corners,
    operator_zones,
    output_folder,
    print_result,
    progress,
)
from painter.config import load_scenario
from painter.errors import InputError
from painter.planning.film.film_model import margin_cells
from painter.planning.film.preview import preview_film
from painter.planning.program.program import strokes_from
from painter.planning.program.store import program_summary, save_program
from painter.planning.tile import nominal_tile_pose
from painter.planning.zones import marked_cells
from painter.robot.planners import MakeProgramPlanner
from painter.run.figures.film_on_tile import film_around
from painter.run.folder.folder import RunFolder
from painter.run.pictures.film_preview import preview_picture
from painter.run.pictures.pictures import stroke_picture
from painter.run.pictures.style import png
from perception.ground import FloatArray
from perception.io.segmentations import load_segmentation
from perception.values import WallSegmentation

PICTURE_FILE = "program.png"
PREVIEW_FILE = "film.png"


def plan(
    segmentation: Annotated[
        Path,
        typer.Argument(metavar="SEGMENTATION", help="A segmentation.npz."),
    ],
    out: OutOption,
    scenario: Annotated[
        str,
        typer.Option(help="Robot, tip and settings: a named scenario or a YAML file."),
    ] = "cubes",
    overrides: SetOption = None,
    expected_wall: Annotated[
        bool,
        typer.Option(
            "--expected-wall",
            help="Take the wall to stand where the scenario expects it; for recorded "
            "walls, whose frame is not the robot's.",
        ),
    ] = False,
    from_stroke: Annotated[
        float,
        typer.Option(
            help="Number of the stroke to begin with, from 1; 12.4 begins where four "
            "tenths of the twelfth are done."
        ),
    ] = 1.0,
    touch_up: Annotated[
        Path | None,
        typer.Option(
            metavar="RUN",
            help="Run folder: plan only the strokes that mend its film where it is "
            "thin.",
        ),
    ] = None,
    mark: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,X,Y...",
            help="Plan only the strokes that paint what is inside this mark anew: two "
            "opposite corners of a rectangle or the corners of a polygon, m from the "
            "tile's lower left corner.",
        ),
    ] = None,
    include: IncludeOption = None,
    exclude: ExcludeOption = None,
    as_json: JsonOption = False,
) -> None:
    """Plan the paint program of a segmented wall.

    The arm starts and ends at its home pose. Writes program.json, trajectory.npz,
    program.png and film.png, the film after the strokes.

    Raises:
        InputError: The options do not go together or name nothing to be read.
    """
    if touch_up is not None and mark is not None:
        raise InputError(
            "--touch-up and --mark: only one of them can be given.", code="PNT-USE-036"
        )
    job = load_scenario(scenario, overrides or ())
    tile = job.tile
    job.raster.zones += operator_zones(include, exclude, tile.width, tile.height)
    wall = load_segmentation(segmentation)
    if expected_wall:
        wall = wall.replace(X_WT=nominal_tile_pose(job.tile))
    with output_folder(out) as folder, progress("Plan") as show:
        show(0.0, "robot")
        planner = MakeProgramPlanner(job)
        show(0.4, "strokes and moves")
        start = time.perf_counter()
        home = np.deg2rad(job.motion.home_deg)
        nominal = planner.nominal_film(wall)
        film = _film_to_mend(wall, touch_up, mark, nominal)
        if film is None:
            strokes = planner.strokes(wall)
        else:
            strokes = planner.touch_up_strokes(wall, film)
        program = planner.program(strokes, wall, home)
        if from_stroke != 1.0:
            rest = strokes_from(program.strokes, from_stroke)
            program = planner.program(rest, wall, home)
        compute_time = time.perf_counter() - start
        show(0.8, "files")
        asked = wall.replace(wall_mask=planner.paintable(wall))
        preview = preview_film(
            program.strokes, asked, tip=planner.tip, nominal=nominal, before=film
        )
        save_program(folder, program, preview)
        (folder / PICTURE_FILE).write_bytes(png(stroke_picture(program, wall)))
        drawn = preview_picture(preview, asked, nominal)
        (folder / PREVIEW_FILE).write_bytes(png(drawn))
        show(1.0, "done")
    result = program_summary(program) | {
        "planning_time": compute_time,
        "predicted": preview.figures._asdict(),
    }
    for item in program.skipped:
        typer.echo(
            f"skipped {item.stroke.length:.2f} m on line {item.stroke.column + 1}: "
            f"{item.reason}",
            err=True,
        )
    print_result(result, as_json=as_json)


def _film_to_mend(
    wall: WallSegmentation, touch_up: Path | None, mark: str | None, nominal: float
) -> FloatArray | None:
    """Returns the film on the tile and its margin, m; None = paint it all."""
    if touch_up is not None:
        return film_around(RunFolder(touch_up), wall)
    if mark is None:
        return None
    corners = mark_corners("--mark", mark)
    mask = np.asarray(wall.wall_mask)
    bare = marked_cells(corners, mask.shape, wall.cell) | ~mask
    return np.pad(np.where(bare, 0.0, nominal), margin_cells(wall.cell))
