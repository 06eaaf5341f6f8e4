"""`painter plan`: a segmentation to a paint program."""

import time
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from painter.cli.common import (
    JsonOption,
    OutOption,
    SetOption,
    output_folder,
    print_result,
    progress,
)
from painter.config import load_scenario
from painter.diagrams.arm_model import (
    GetArmKinematics,
    GetArmLimits,
    MakeArmPlant,
    MakeCollisionChecker,
)
from painter.planning.program import plan_program
from painter.planning.store import program_summary, save_program
from painter.planning.tile import nominal_tile_pose
from painter.run.pictures import stroke_picture
from painter.run.style import png
from perception.store import load_segmentation

PICTURE_FILE = "program.png"


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
    as_json: JsonOption = False,
) -> None:
    """Plan the paint program of a segmented wall.

    The arm starts and ends at its home pose. Writes program.json, trajectory.npz and
    program.png.
    """
    job = load_scenario(scenario, overrides or ())
    wall = load_segmentation(segmentation)
    if expected_wall:
        wall = wall.replace(X_WT=nominal_tile_pose(job.tile))
    with output_folder(out) as folder, progress("Plan") as show:
        show(0.0, "robot")
        plant = MakeArmPlant(job.directives)
        checker = MakeCollisionChecker(job.directives, clearance=job.motion.clearance)
        show(0.4, "strokes and moves")
        start = time.perf_counter()
        program = plan_program(
            wall,
            np.deg2rad(job.motion.home_deg),
            kinematics=GetArmKinematics(plant),
            limits=GetArmLimits(plant),
            checker=checker,
            tip=job.gun.tip,
            raster=job.raster,
            motion=job.motion,
        )
        compute_time = time.perf_counter() - start
        show(0.8, "files")
        save_program(folder, program)
        (folder / PICTURE_FILE).write_bytes(png(stroke_picture(program, wall)))
        show(1.0, "done")
    result = program_summary(program) | {"planning_time": compute_time}
    for item in program.skipped:
        typer.echo(
            f"skipped {item.stroke.length:.2f} m on line {item.stroke.column + 1}: "
            f"{item.reason}",
            err=True,
        )
    print_result(result, as_json=as_json)
