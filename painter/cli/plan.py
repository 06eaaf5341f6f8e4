"""`painter plan`: from a segmentation to a paint program."""

from pathlib import Path
from typing import Annotated

import typer

from painter.cli import common
from painter.cli.common import (
    output_folder,
    parse_corners,
    parse_zones,
    print_result,
    progress,
)

SegmentationArgument = Annotated[
    Path, typer.Argument(metavar="SEGMENTATION", help="A segmentation.npz.")
]
ExpectedWallOption = Annotated[
    bool,
    typer.Option(
        "--expected-wall",
        help="Place the wall where the scenario expects it: for recorded walls, whose "
        "frame is not the robot's.",
    ),
]
FromStrokeOption = Annotated[
    float,
    typer.Option(
        help="Stroke to begin with, from 1; 12.4 begins where four tenths of the "
        "twelfth are done."
    ),
]
TouchUpOption = Annotated[
    Path | None,
    typer.Option(
        metavar="RUN", help="Plan only strokes that touch up this run's thin film."
    ),
]
MarkOption = Annotated[
    str | None,
    typer.Option(
        metavar="X,Y,X,Y...",
        help="Plan only strokes that repaint this area: two opposite corners of a "
        "rectangle, or all corners of a polygon, m from the tile's lower left corner.",
    ),
]


def plan(
    segmentation: SegmentationArgument,
    out: common.Out,
    scenario: common.Scenario = "cubes",
    overrides: common.Set = None,
    expected_wall: ExpectedWallOption = False,
    from_stroke: FromStrokeOption = 1.0,
    touch_up: TouchUpOption = None,
    mark: MarkOption = None,
    include: common.Include = None,
    exclude: common.Exclude = None,
    as_json: common.Json = False,
) -> None:
    """Plan the paint program of a segmented wall.

    The arm starts and ends at its home pose. Writes program.json, trajectory.npz,
    program.png and film.png, the predicted film.

    Raises:
        InputError: Options exclude each other or name files that cannot be read.
    """
    area = None if mark is None else parse_corners("--mark", mark)
    from painter.config import load_scenario
    from painter.jobs.plan_tile import plan_tile

    job = load_scenario(scenario, overrides or ())
    job.raster.zones += parse_zones(include, exclude, job.tile.width, job.tile.height)
    with output_folder(out) as folder, progress("Planning") as show:
        planned = plan_tile(
            segmentation,
            job,
            expected_wall=expected_wall,
            from_stroke=from_stroke,
            touch_up=touch_up,
            area=area,
            show=show,
        )
        planned.save(folder)
    for item in planned.program.skipped:
        typer.echo(
            f"skipped {item.stroke.length:.2f} m on line {item.stroke.column + 1}: "
            f"{item.reason}",
            err=True,
        )
    print_result(planned.figures(), as_json=as_json)
