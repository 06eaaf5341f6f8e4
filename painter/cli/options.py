"""Options and arguments that several commands share."""

from pathlib import Path
from typing import Annotated

import typer

from painter.resources import named_scenarios


def complete_scenario(incomplete: str) -> list[str]:
    """Returns the named scenarios that begin with what was typed."""
    return [name for name in named_scenarios() if name.startswith(incomplete)]


ScenarioArgument = Annotated[
    str | None,
    typer.Argument(
        metavar="SCENARIO",
        help="Named scenario or path of a scenario's YAML file.  [default: cubes, or "
        "the scenario of the run that is resumed or touched up]",
        show_default=False,
        autocompletion=complete_scenario,
    ),
]
Scenario = Annotated[
    str,
    typer.Option(
        metavar="SCENARIO",
        help="Scenario that describes the robot, tip and settings: a name or a YAML "
        "file.",
        autocompletion=complete_scenario,
    ),
]
Set = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Override a scenario value, in SI units, e.g. raster.speed=0.5; "
        "repeatable.",
    ),
]
Out = Annotated[
    Path, typer.Option("--out", metavar="DIR", help="Folder for the result.")
]
RunFolder = Annotated[
    Path, typer.Option("--out", metavar="DIR", help="Run folder to write.")
]
Resume = Annotated[
    Path | None,
    typer.Option(
        metavar="RUN", help="Resume a stopped run: paint the strokes that are left."
    ),
]
Bus = Annotated[
    Path | None,
    typer.Option("--bus", metavar="FILE", help="Bus file.  [default: the robot's]"),
]
Interface = Annotated[
    str | None,
    typer.Option(
        help="python-can interface (socketcan, slcan, udp_multicast ...), or `local` "
        "for a socket on this machine; overrides the bus file."
    ),
]
Channel = Annotated[
    str | None,
    typer.Option(
        help="CAN channel, e.g. can0, or path of the socket; overrides the bus file."
    ),
]
Rate = Annotated[
    float,
    typer.Option(
        min=0.05,
        max=1.0,
        help="Speed of the run's clock against real time. Below 1, drives, world and "
        "planning have more time to compute. `painter drives` and `painter deploy` "
        "must use the same value.",
    ),
]
Include = Annotated[
    list[str] | None,
    typer.Option(
        "--include",
        metavar="X,Y,X,Y...",
        help="Paint only inside this zone: two opposite corners of a rectangle, or all "
        "corners of a polygon, m from the lower left corner; repeatable.",
    ),
]
Exclude = Annotated[
    list[str] | None,
    typer.Option(
        "--exclude",
        metavar="X,Y,X,Y...",
        help="Do not paint inside this zone; same form as --include; repeatable.",
    ),
]
Json = Annotated[
    bool,
    typer.Option("--json", help="Print only the result, as JSON, on stdout."),
]
