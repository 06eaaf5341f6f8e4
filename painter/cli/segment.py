"""`painter segment`: a recorded cloud or depth image to wall and other regions."""

import enum
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from painter.cli import common
from painter.cli.common import output_folder, print_result
from painter.errors import InputError


class Unit(enum.StrEnum):
    """A unit of length."""

    M = "m"
    CM = "cm"
    MM = "mm"


METRES = {Unit.M: 1.0, Unit.CM: 0.01, Unit.MM: 0.001}

CloudArgument = Annotated[
    Path,
    typer.Argument(
        metavar="CLOUD",
        help="PLY, PCD, XYZ, NPY or NPZ file; 16-bit depth PNG, or a folder of them "
        "from a camera and scene at rest; RealSense .bag or .db3 recording.",
    ),
]
IntrinsicsOption = Annotated[
    Path | None,
    typer.Option(
        metavar="JSON",
        help="Camera of a depth PNG: width, height, fx, fy, cx, cy, in px.  "
        "[default: intrinsics.json beside it]",
    ),
]
UpOption = Annotated[
    str | None,
    typer.Option(
        metavar="AXIS",
        help="Up direction in the cloud's frame: z, -y or X,Y,Z. With it floors and "
        "ceilings are not taken for walls.  [default: -y, as in a camera's frame]",
    ),
]
UnitOption = Annotated[Unit, typer.Option(help="Unit of a cloud's coordinates.")]
ViewpointOption = Annotated[
    str | None,
    typer.Option(
        metavar="X,Y,Z",
        help="Position of the sensor in the cloud's frame, m; tells the wall's front "
        "from its back.  [default: from the PCD file, else the origin; for a map far "
        "from its origin, the side opposite to its recesses]",
    ),
]
TileOption = Annotated[
    str | None,
    typer.Option(
        metavar="WxH",
        help="Size of the tile, m, centred on the visible wall.  [default: the whole "
        "wall]",
    ),
]
CellOption = Annotated[
    float | None,
    typer.Option(
        help="Edge of a grid cell, m.  [default: 0.01, or larger for sparse points and "
        "for walls of more than 4 million cells, 400 000 with --fine]"
    ),
]
InlierOption = Annotated[
    float | None,
    typer.Option(
        help="Maximum distance of a wall point from the wall's plane, m.  [default: "
        "four standard deviations of the noise, 0.006 to 0.03]"
    ),
]
SetBackOption = Annotated[
    float,
    typer.Option(
        help="Maximum distance behind the plane, m, at which parts beside it, such as "
        "dormers, still count as wall."
    ),
]
FineOption = Annotated[
    bool,
    typer.Option(
        "--fine",
        help="Segment by fine steps against the wall's curved surface, as the robot "
        "does: steps of 10 mm are found and bulges stay wall. For dense depth images. "
        "Adds surface, normals, confidence, reasons and outlines of openings. Without "
        "it, all points within --inlier-distance of the plane are wall (the paper's "
        "method).",
    ),
]
DistanceOption = Annotated[
    float | None,
    typer.Option(
        help="Expected distance of the wall from the sensor, m.  [default: any]"
    ),
]
MaxRangeOption = Annotated[
    float | None,
    typer.Option(
        help="Ignore points farther than this from the sensor, m.  [default: none]"
    ),
]
SeedOption = Annotated[int, typer.Option(min=0, help="Random seed of RANSAC.")]


def segment(
    cloud: CloudArgument,
    out: common.Out,
    intrinsics: IntrinsicsOption = None,
    up: UpOption = None,
    unit: UnitOption = Unit.M,
    viewpoint: ViewpointOption = None,
    tile: TileOption = None,
    cell: CellOption = None,
    inlier_distance: InlierOption = None,
    set_back: SetBackOption = 0.0,
    fine: FineOption = False,
    distance: DistanceOption = None,
    max_range: MaxRangeOption = None,
    overrides: common.Set = None,
    seed: SeedOption = 1,
    as_json: common.Json = False,
) -> None:
    """Segment a recorded cloud or depth image into wall and other regions.

    Writes segmentation.npz, segmentation.json, segmentation.png and wall_mask.png.
    """
    values: dict[str, Any] = _lengths(
        cell=cell,
        inlier_distance=inlier_distance,
        distance=distance,
        max_range=max_range,
    )
    values |= _parsed(tile, up, viewpoint, set_back)
    from painter.config import load_scenario
    from painter.run.page.recorded_wall import write_recorded_wall
    from perception.recorded.segment_file import segment_file

    config = load_scenario("blank", overrides or ()).segmentation
    for name, field in (("cell", "cell"), ("inlier_distance", "distance_threshold")):
        if values[name] is None and _is_set(overrides, f"segmentation.{field}"):
            values[name] = getattr(config, field)
    wall = segment_file(
        cloud,
        config=config,
        intrinsics=intrinsics,
        unit=METRES[unit],
        fine=fine,
        seed=seed,
        **values,
    )
    with output_folder(out) as folder:
        figures = write_recorded_wall(folder, wall, title=cloud.name)
    _print_figures(figures, out, as_json=as_json)


def _lengths(**values: float | None) -> dict[str, float | None]:
    """Returns the options that are lengths, m, checked."""
    for name, value in values.items():
        if value is not None and not 0.0 < value < math.inf:
            option = "--" + name.replace("_", "-")
            raise InputError(
                f"{option} must be > 0 m, got {value!r}.", code="PNT-USE-047"
            )
    return values


def _parsed(
    tile: str | None, up: str | None, viewpoint: str | None, set_back: float
) -> dict[str, Any]:
    """Returns the options that are read from text, and the set-back, checked."""
    if not 0.0 <= set_back < math.inf:
        raise InputError(
            f"--set-back must be >= 0 m, got {set_back!r}.", code="PNT-USE-046"
        )
    import numpy as np

    return {
        "set_back": set_back,
        "tile": None if tile is None else parse_tile(tile),
        "up": None if up is None else np.array(parse_direction(up)),
        "viewpoint": None if viewpoint is None else np.array(parse_point(viewpoint)),
    }


def parse_direction(argument: str) -> list[float]:
    """Reads a direction: an axis, such as "z" or "-y", or "X,Y,Z".

    Returns:
        Unit vector [x, y, z].

    Raises:
        InputError: It is neither, or of no length.
    """
    axis = argument.strip().lower().lstrip("+")
    if axis.removeprefix("-") in ("x", "y", "z"):
        sign = -1.0 if axis.startswith("-") else 1.0
        return [sign * (name == axis[-1]) for name in "xyz"]
    vector = _three_numbers(argument) or [0.0]
    length = math.hypot(*vector)
    if not 0.0 < length < math.inf:
        raise InputError(
            f"--up must be x, -x, ... -z or X,Y,Z, got {argument!r}.",
            code="PNT-USE-037",
        )
    return [value / length for value in vector]


def parse_point(argument: str) -> list[float]:
    """Reads a point: "X,Y,Z", m.

    Raises:
        InputError: It is not three numbers.
    """
    point = _three_numbers(argument)
    if point is None:
        raise InputError(
            f"--viewpoint must be X,Y,Z in m, got {argument!r}.", code="PNT-USE-038"
        )
    return point


def parse_tile(argument: str) -> tuple[float, float]:
    """Reads the size of a tile: "WxH", m.

    Returns:
        Width and height, m.

    Raises:
        InputError: It is not two positive numbers.
    """
    try:
        width, height = (float(number) for number in argument.lower().split("x"))
    except ValueError:
        raise InputError(
            f"--tile must be WxH in m, e.g. 2x2, got {argument!r}.", code="PNT-USE-039"
        ) from None
    if not (0.0 < width < math.inf and 0.0 < height < math.inf):
        raise InputError(f"--tile must be > 0 m, got {argument!r}.", code="PNT-USE-040")
    return width, height


def _three_numbers(argument: str) -> list[float] | None:
    try:
        numbers = [float(number) for number in argument.split(",")]
    except ValueError:
        return None
    return numbers if len(numbers) == 3 and all(map(math.isfinite, numbers)) else None


def _is_set(overrides: Sequence[str] | None, key: str) -> bool:
    return any(override.partition("=")[0] == key for override in overrides or ())


def _print_figures(figures: dict[str, Any], out: Path, *, as_json: bool) -> None:
    short = {
        name: value
        for name, value in figures.items()
        if not isinstance(value, list | dict)
    }
    print_result(figures, as_json=as_json, short=short)
    if not as_json:
        _print_regions(figures["regions"])
        typer.echo(f"written to {out}")


def _print_regions(regions: list[dict[str, Any]], most: int = 10) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table("region", "kind", "area, m²", "depth, m", title=None, box=None)
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
    Console().print(table)
