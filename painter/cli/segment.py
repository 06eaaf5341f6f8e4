"""`painter segment`: a recorded cloud or depth image to wall and rest."""

import enum
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
from painter.config import load_scenario
from painter.errors import InputError
from painter.run.recorded_wall import write_recorded_wall
from perception.cloud_io import DEPTH_SUFFIX, read_cloud, read_depth
from perception.config import SegmentationConfig
from perception.recorded import segment_recorded
from perception.values import FloatArray


class Axis(enum.StrEnum):
    """A direction of the cloud's frame."""

    X = "x"
    MINUS_X = "-x"
    Y = "y"
    MINUS_Y = "-y"
    Z = "z"
    MINUS_Z = "-z"

    @property
    def vector(self) -> FloatArray:
        """(3,) unit vector."""
        sign = -1.0 if self.value.startswith("-") else 1.0
        return sign * np.eye(3)["xyz".index(self.value[-1])]


class Unit(enum.StrEnum):
    """A unit of length."""

    M = "m"
    CM = "cm"
    MM = "mm"

    @property
    def metres(self) -> float:
        """Its length, m."""
        return {"m": 1.0, "cm": 0.01, "mm": 0.001}[self.value]


def segment(
    cloud: Annotated[
        Path,
        typer.Argument(
            metavar="CLOUD",
            help="PLY, PCD, XYZ, NPY or NPZ file, or a 16-bit depth PNG.",
        ),
    ],
    out: OutOption,
    intrinsics: Annotated[
        Path | None,
        typer.Option(
            metavar="JSON",
            help="Camera of a depth PNG: width, height, fx, fy, cx, cy, in px.",
        ),
    ] = None,
    up: Annotated[
        Axis | None,
        typer.Option(
            help="Which way is up in the cloud's frame; then floors are no walls. "
            "Without it the mask is turned as in a camera's picture (up = -y)."
        ),
    ] = None,
    unit: Annotated[Unit, typer.Option(help="Unit of the cloud's numbers.")] = Unit.M,
    tile: Annotated[
        str,
        typer.Option(
            metavar="WxH", help="Size of the tile, centred on the wall seen, m."
        ),
    ] = "2x2",
    cell: Annotated[
        float | None,
        typer.Option(help="Edge of a grid cell, m.  [default: 0.01]"),
    ] = None,
    distance: Annotated[
        float | None,
        typer.Option(
            help="Expected distance of the wall from the frame's origin, m.  "
            "[default: any]"
        ),
    ] = None,
    overrides: SetOption = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of random draws.")] = 1,
    as_json: JsonOption = False,
) -> None:
    """Segment a recorded cloud or depth image into wall and rest.

    Writes segmentation.npz, segmentation.json, segmentation.png and wall_mask.png.
    """
    width, height = _tile_size(tile)
    if distance is not None and not distance > 0.0:
        raise InputError(f"--distance must be > 0 m, got {distance!r}.")
    config = _config(overrides, cell)
    _check_grid(width, height, config.cell)
    points = _read(cloud, intrinsics) * unit.metres
    steps = segment_recorded(
        points,
        width=width,
        height=height,
        config=config,
        seed=seed,
        up_W=None if up is None else up.vector,
        distance=distance,
    )
    with output_folder(out) as folder:
        figures = write_recorded_wall(
            folder, steps, title=cloud.name, threshold=config.distance_threshold
        )
    if as_json:
        print_result(figures, as_json=True)
        return
    short = {
        name: value for name, value in figures.items() if not isinstance(value, list)
    }
    print_result(short, as_json=False)
    Console().print(_table(figures["regions"]))
    typer.echo(f"written to {out}")


def _read(cloud: Path, intrinsics: Path | None) -> FloatArray:
    is_depth = cloud.suffix.lower() == DEPTH_SUFFIX
    if not is_depth:
        if intrinsics is not None:
            raise InputError(f"--intrinsics is for a depth PNG; {cloud} is none.")
        return read_cloud(cloud)
    if intrinsics is None:
        raise InputError(f"{cloud}: a depth image needs --intrinsics JSON.")
    return read_depth(cloud, intrinsics)


def _tile_size(words: str) -> tuple[float, float]:
    try:
        width, height = (float(word) for word in words.lower().split("x"))
    except ValueError:
        raise InputError(f"--tile must be WxH in m, e.g. 2x2, got {words!r}.") from None
    if not (0.0 < width < np.inf and 0.0 < height < np.inf):
        raise InputError(f"--tile must be > 0 m, got {words!r}.")
    return width, height


def _config(overrides: list[str] | None, cell: float | None) -> SegmentationConfig:
    words = [*(overrides or ()), *([f"segmentation.cell={cell!r}"] if cell else [])]
    if cell is not None and not cell > 0.0:
        raise InputError(f"--cell must be > 0 m, got {cell!r}.")
    return load_scenario("blank", words).segmentation


def _check_grid(width: float, height: float, cell: float, most: float = 4e6) -> None:
    if min(width, height) < cell:
        raise InputError(
            f"--tile {width:g}x{height:g} is smaller than a cell, {cell:g} m."
        )
    if width * height / cell**2 > most:
        raise InputError(
            f"--tile {width:g}x{height:g} with cells of {cell:g} m has more than "
            f"{most:.0e} cells; take a larger --cell."
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
