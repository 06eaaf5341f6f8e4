"""`painter place`: base positions from which a tile or a wall can be painted."""

import json
import re
from typing import Annotated

import typer

from painter.cli import common
from painter.cli.common import output_folder, parse_zones, print_result
from painter.errors import InputError

STATIONS_FILE = "stations.json"

WallOption = Annotated[
    str | None,
    typer.Option(
        metavar="WxH",
        help="Width and height of the wall, m.  [default: 2x2]",
        show_default=False,
    ),
]
SceneOption = Annotated[
    str | None,
    typer.Option(
        help="Use the wall of this scene, with its windows and doors: a name or a YAML "
        "file."
    ),
]


def place(
    out: common.Out,
    wall: WallOption = None,
    scene: SceneOption = None,
    include: common.Include = None,
    exclude: common.Exclude = None,
    scenario: common.Scenario = "blank",
    overrides: common.Set = None,
    as_json: common.Json = False,
) -> None:
    """Propose base positions for a wall, from the arm's reach.

    A wall larger than a tile is divided into tiles whose strokes blend. Writes
    stations.json: the distance of the wall and, for each base position, its place along
    the wall, lift, tile and strokes.

    Raises:
        InputError: Options exclude each other or are malformed; the wall is too small
            to be divided; a zone is not on it.
    """
    if scene is not None and wall is not None:
        raise InputError(
            "--wall and --scene: give only one of them.", code="PNT-USE-033"
        )
    width, height = _parse_size(wall or "2x2")
    from painter.config import load_scenario
    from painter.jobs.propose_base import propose_base
    from painter.planning.config import ZoneConfig
    from painter.scene.load import load_scene

    job = load_scenario(scenario, overrides or ())
    zones = []
    if scene is not None:
        drawn = load_scene(scene, job.random_seed)
        width, height = drawn.wall.width, drawn.wall.height
        zones = [ZoneConfig(corners=box) for box in drawn.opening_boxes()]
    zones += parse_zones(include, exclude, width, height)
    proposal = propose_base(job, width, height, zones)
    with output_folder(out) as folder:
        text = json.dumps(proposal.document(), indent=1)
        (folder / STATIONS_FILE).write_text(text + "\n")
    print_result(proposal.figures(), as_json=as_json)


def _parse_size(wall: str) -> tuple[float, float]:
    """Reads a wall's width and height, m."""
    found = re.fullmatch(r"(\d+(?:\.\d+)?)x(\d+(?:\.\d+)?)", wall)
    if found is None or not min(map(float, found.groups())) > 0.0:
        raise InputError(
            f"--wall {wall!r}: expected WxH in metres, e.g. 10x6.", code="PNT-USE-035"
        )
    return float(found[1]), float(found[2])
