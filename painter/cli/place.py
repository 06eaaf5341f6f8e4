"""`painter place`: where the base stands to paint a tile or a wall."""

import json
import re
from typing import Annotated

import numpy as np
import typer

from painter.cli.common import (
    ExcludeOption,
    IncludeOption,
    JsonOption,
    OutOption,
    SetOption,
    operator_zones,
    output_folder,
    print_result,
)
from painter.config import load_scenario
from painter.errors import InputError
from painter.planning.arm.placement import propose_distance
from painter.planning.config import ZoneConfig
from painter.planning.strokes.facade import plan_base_positions
from painter.planning.strokes.spray_settings import SpraySettings
from painter.robot.reach_mapper import ReachMapper
from painter.scene.config import Scene
from painter.scene.load import load_scene

STATIONS_FILE = "stations.json"
_DISTANCES = np.round(np.arange(0.80, 1.46, 0.05), 3)  # m
_STEP = 0.1  # m, between the points of the tile that are looked at.


def place(
    out: OutOption,
    wall: Annotated[
        str | None,
        typer.Option(
            metavar="WxH",
            help="Width and height of the wall, m; default 2x2.",
            show_default=False,
        ),
    ] = None,
    scene: Annotated[
        str | None,
        typer.Option(
            help="Take the wall and its windows and doors from a scene: a name or a "
            "YAML file."
        ),
    ] = None,
    include: IncludeOption = None,
    exclude: ExcludeOption = None,
    scenario: Annotated[
        str,
        typer.Option(help="Robot, tip and settings: a named scenario or a YAML file."),
    ] = "blank",
    overrides: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Propose where the base stands to paint a wall, from what the arm reaches.

    A wall larger than a tile becomes a sequence of stations whose strokes blend. Writes
    stations.json: distance of the wall, and of each station base position, lift, tile
    and strokes.

    Raises:
        InputError: The wall is not given as two lengths, or too small to be divided; a
            zone is not on it.
    """
    job = load_scenario(scenario, overrides or ())
    if scene is not None and wall is not None:
        raise InputError(
            "--wall and --scene: only one of them can be given.", code="PNT-USE-033"
        )
    what = f"--wall {wall!r}" if scene is None else f"--scene {scene!r}"
    if scene is None:
        width, height = _size(wall or "2x2")
        zones: list[ZoneConfig] = []
    else:
        width, height, zones = _wall_of(load_scene(scene, job.random_seed))
    zones += operator_zones(include, exclude, width, height)
    mapper = ReachMapper(job)
    height = mapper.arm.shoulder_height
    spot = propose_distance(
        lambda distance: mapper.reach(
            distance=distance, shoulder_height=height, step=_STEP
        ),
        _DISTANCES.tolist(),
    )
    try:
        stations = plan_base_positions(
            width,
            height,
            SpraySettings(job.gun.tip, job.raster),
            tile=job.tile,
            zones=zones,
        )
    except ValueError as error:
        raise InputError(f"{what}: {error}", code="PNT-USE-034") from error
    document = {
        "units": "m, on the wall from its lower left corner; strokes in T",
        "distance": spot.distance,
        "stations": [
            {
                "base_x": station.base_x,
                "lift": station.lift,
                "tile": [station.left, station.bottom, station.width, station.height],
                "strokes": [
                    [*stroke.start_T.tolist(), *stroke.end_T.tolist(), stroke.flow]
                    for stroke in station.strokes
                ],
            }
            for station in stations
        ],
    }
    with output_folder(out) as folder:
        (folder / STATIONS_FILE).write_text(json.dumps(document, indent=1) + "\n")
    print_result(
        {
            "distance": spot.distance,
            "distance_range": [spot.nearest, spot.farthest],
            "spray_share": spot.spray_share,
            "scan_share": spot.scan_share,
            "stations": len(stations),
            "base_x": sorted({round(station.base_x, 3) for station in stations}),
            "lift": sorted({round(station.lift, 3) for station in stations}),
        },
        as_json=as_json,
    )


def _size(wall: str) -> tuple[float, float]:
    """Reads a wall's width and height, m, from the command line."""
    found = re.fullmatch(r"(\d+(?:\.\d+)?)x(\d+(?:\.\d+)?)", wall)
    if found is None or not min(map(float, found.groups())) > 0.0:
        raise InputError(
            f"--wall {wall!r}: expected WxH in metres, e.g. 10x6.", code="PNT-USE-035"
        )
    return float(found[1]), float(found[2])


def _wall_of(scene: Scene) -> tuple[float, float, list[ZoneConfig]]:
    """Returns a scene's wall: width and height, m, and its openings as zones."""
    wall = scene.wall
    zones = [
        ZoneConfig(
            corners=[
                [opening.x - wall.x, opening.y - wall.y],
                [
                    opening.x - wall.x + opening.width,
                    opening.y - wall.y + opening.height,
                ],
            ]
        )
        for opening in scene.openings
    ]
    return wall.width, wall.height, zones
