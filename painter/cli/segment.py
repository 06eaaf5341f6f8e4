"""`painter segment`: a recorded cloud or depth image to wall and rest."""

import math
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from painter.cli.common import (
    JsonOption,
    OutOption,
    SetOption,
    output_folder,
    print_result,
)
from painter.cli.recorded_input import (
    Unit,
    parse_direction,
    parse_point,
    parse_tile,
    read_input,
)
from painter.config import load_scenario
from painter.errors import InputError
from painter.run.page.recorded_wall import write_recorded_wall
from perception.config import SegmentationConfig
from perception.recorded.segment_recorded import MAX_CELLS, segment_recorded


def segment(
    cloud: Annotated[
        Path,
        typer.Argument(
            metavar="CLOUD",
            help="PLY, PCD, XYZ, NPY or NPZ file; 16-bit depth PNG, or a folder of "
            "them from a camera and scene at rest; RealSense .bag or .db3 recording.",
        ),
    ],
    out: OutOption,
    intrinsics: Annotated[
        Path | None,
        typer.Option(
            metavar="JSON",
            help="Camera of a depth PNG: width, height, fx, fy, cx, cy, in px.  "
            "[default: intrinsics.json beside it]",
        ),
    ] = None,
    up: Annotated[
        str | None,
        typer.Option(
            metavar="AXIS",
            help="Which way is up in the cloud's frame, as z, -y or X,Y,Z; then floors "
            "are no walls. Without it the mask is turned as in a camera's picture "
            "(up = -y).",
        ),
    ] = None,
    unit: Annotated[Unit, typer.Option(help="Unit of a cloud's numbers.")] = Unit.M,
    viewpoint: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,Z",
            help="Where the sensor was, in the cloud's frame, m; tells the wall's "
            "front from its back.  [default: as a PCD file says; the origin; of a map "
            "far from its origin, the side that openings do not lie on]",
        ),
    ] = None,
    tile: Annotated[
        str | None,
        typer.Option(
            metavar="WxH",
            help="Size of the tile, centred on the wall seen, m.  [default: all of it]",
        ),
    ] = None,
    cell: Annotated[
        float | None,
        typer.Option(
            help="Edge of a grid cell, m.  [default: 0.01, or as the points' spacing "
            "needs, or for at most 4 million cells, 400 000 by --fine]"
        ),
    ] = None,
    inlier_distance: Annotated[
        float | None,
        typer.Option(
            help="How far a point of the wall may be from its plane, m.  [default: "
            "four standard deviations of its noise, 0.006 to 0.03]"
        ),
    ] = None,
    set_back: Annotated[
        float,
        typer.Option(
            help="How far behind the plane parts of the wall may lie that stand beside "
            "it, such as dormers, m."
        ),
    ] = 0.0,
    fine: Annotated[
        bool,
        typer.Option(
            "--fine",
            help="Draw the mask by fine steps against the wall's own surface, as the "
            "robot does: what rises 10 mm from it is no wall, and what bulges with it "
            "is; for dense depth images. Adds surface, normals, confidence, reasons "
            "and outlines of openings. Without it the mask is drawn by the paper's "
            "steps: all within --inlier-distance of a plane.",
        ),
    ] = False,
    distance: Annotated[
        float | None,
        typer.Option(
            help="Expected distance of the wall from the sensor, m.  [default: any]"
        ),
    ] = None,
    max_range: Annotated[
        float | None,
        typer.Option(
            help="Leave out points farther than this from the sensor, m.  "
            "[default: none]"
        ),
    ] = None,
    overrides: SetOption = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of random draws.")] = 1,
    as_json: JsonOption = False,
) -> None:
    """Segment a recorded cloud or depth image into wall and rest.

    Writes segmentation.npz, segmentation.json, segmentation.png and wall_mask.png.
    """
    width, height = (None, None) if tile is None else parse_tile(tile)
    _check_positive(
        cell=cell,
        inlier_distance=inlier_distance,
        distance=distance,
        max_range=max_range,
    )
    if not 0.0 <= set_back < math.inf:
        raise InputError(
            f"--set-back must be >= 0 m, got {set_back!r}.", code="PNT-USE-046"
        )
    words = list(overrides or ())
    if cell is not None:
        words.append(f"segmentation.cell={cell!r}")
    if inlier_distance is not None:
        words.append(f"segmentation.distance_threshold={inlier_distance!r}")
    config = load_scenario("blank", words).segmentation
    if width is not None and height is not None:
        _check_grid(width, height, config)
    up_W = None if up is None else parse_direction(up)
    place = None if viewpoint is None else parse_point(viewpoint)
    recording = read_input(cloud, intrinsics=intrinsics, unit=unit)
    p_WC = recording.p_WC if place is None else place
    points = recording.p_WQs
    if max_range is not None:
        with np.errstate(over="ignore"):
            offsets = points - (np.zeros(3) if p_WC is None else p_WC)[:, None]
            points = points[:, np.linalg.norm(offsets, axis=0) <= max_range]
    wall = segment_recorded(
        points,
        width=width,
        height=height,
        config=config,
        seed=seed,
        up_W=up_W,
        distance=distance,
        p_WC=p_WC,
        fit_cell=not _is_set(words, "cell"),
        fit_inlier_distance=not _is_set(words, "distance_threshold"),
        set_back=set_back,
        fine=fine,
    )
    with output_folder(out) as folder:
        figures = write_recorded_wall(folder, wall, title=cloud.name)
    if as_json:
        print_result(figures, as_json=True)
        return
    short = {
        name: value
        for name, value in figures.items()
        if not isinstance(value, list | dict)
    }
    print_result(short, as_json=False)
    Console().print(_table(figures["regions"]))
    typer.echo(f"written to {out}")


def _check_positive(**values: float | None) -> None:
    for name, value in values.items():
        if value is not None and not 0.0 < value < math.inf:
            option = "--" + name.replace("_", "-")
            raise InputError(
                f"{option} must be > 0 m, got {value!r}.", code="PNT-USE-047"
            )


def _is_set(words: list[str], field: str) -> bool:
    """Tells whether the words set a field of the segmentation."""
    return any(word.partition("=")[0] == f"segmentation.{field}" for word in words)


def _check_grid(width: float, height: float, config: SegmentationConfig) -> None:
    cell = config.cell
    if min(width, height) < cell:
        raise InputError(
            f"--tile {width:g}x{height:g} is smaller than a cell, {cell:g} m.",
            code="PNT-USE-048",
        )
    if width * height / cell**2 > MAX_CELLS:
        raise InputError(
            f"--tile {width:g}x{height:g} with cells of {cell:g} m has more than "
            f"{MAX_CELLS:.0e} cells; take a larger --cell.",
            code="PNT-USE-049",
        )


def _table(regions: list[dict[str, float | None]], most: int = 10) -> Table:
    table = Table("region", "what", "area, m²", "depth, m", title=None, box=None)
    for region in regions[:most]:
        depth = region["median_depth_m"]
        table.add_row(
            str(region["label"]),
            "[green]wall[/]" if region["wall"] else "not wall",
            f"{region['area_m2']:.3f}",
            "-" if depth is None else f"{depth:+.3f}",
        )
    if len(regions) > most:
        table.caption = f"and {len(regions) - most} smaller ones"
    return table
