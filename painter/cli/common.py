"""What the commands share: options, results, errors, progress and output folders."""

import dataclasses
import json
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from painter.errors import InputError
from painter.resources import models_path, named_scenarios
from perception.settings import problems

if TYPE_CHECKING:
    from painter.canopen.config.bus_config import BusConfig
    from painter.planning.config import ZoneConfig


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


def print_result(
    result: Mapping[str, Any], *, as_json: bool, short: Mapping[str, Any] | None = None
) -> None:
    """Prints what a command found.

    Args:
        result: Names and JSON values; numbers in SI units or with the unit in the name.
        as_json: One JSON object, else a line for each name.
        short: What is printed as lines in place of `result`; None = all of it.
    """
    if as_json:
        typer.echo(json.dumps(result, indent=2, allow_nan=False))
        return
    shown = result if short is None else short
    width = max(map(len, shown), default=0)
    for name, value in shown.items():
        text = f"{value:.4g}" if isinstance(value, float) else str(value)
        typer.echo(f"{name:<{width}}  {text}")


def print_run(figures: Mapping[str, Any], out: Path, *, as_json: bool) -> None:
    """Prints the figures of a run, all of them as JSON or else those that matter most.

    Args:
        figures: The content of report.json.
        out: The run folder.
        as_json: Whether all of them are printed, as one JSON object.
    """
    names = (
        "result",
        "motion_time_s",
        "mask_iou",
        "coverage",
        "thickness_cv_interior",
        "overspray",
        "keepout_paint",
        "collisions",
    )
    summary = {name: figures[name] for name in names if figures.get(name) is not None}
    summary |= {
        name: figures["timing"][name] for name in ("cycle_time_s", "wall_clock_s")
    }
    summary["report"] = str(out / "report.html")
    print_result(figures, as_json=as_json, short=summary)


def print_error(message: str, code: str) -> None:
    """Prints the one line on stderr with which a command fails."""
    line = " ".join(message.split())
    label = typer.style("error:", fg=typer.colors.RED, bold=True)
    typer.echo(f"painter: {label} {line} [{code}]", err=True)


def fail_unless_done(figures: Mapping[str, Any]) -> None:
    """Ends a command whose printed figures are of a run that did not reach DONE.

    The cause is one line on stderr; on stdout there are the figures already.
    """
    if figures["result"] != "DONE":
        cause = figures["cause"] or "no cause is known."
        print_error(f"{figures['result']}: {cause}", figures["code"] or "PNT-USE-050")
        raise typer.Exit(1)


def read_bus(
    file: Path | None, interface: str | None = None, channel: str | None = None
) -> "BusConfig":
    """Reads a bus file.

    Args:
        file: The bus file; None = the robot's.
        interface: Overrides the file's.
        channel: Overrides the file's.

    Raises:
        InputError: The file cannot be read; names key, value and bound.
    """
    from painter.canopen.config.bus_file import load_bus

    bus = load_bus(file or models_path("bus", "painter.bus.yaml"))
    return dataclasses.replace(
        bus, interface=interface or bus.interface, channel=channel or bus.channel
    )


def parse_zones(
    include: Sequence[str] | None,
    exclude: Sequence[str] | None,
    width: float,
    height: float,
) -> "list[ZoneConfig]":
    """Reads the zones of --include and --exclude.

    Args:
        include: Arguments of --include.
        exclude: Arguments of --exclude.
        width: Of the tile or wall that they are on, m.
        height: Of the same, m.

    Raises:
        InputError: A zone is malformed or not on the tile; names option, value, bound.
    """
    from painter.planning.config import ZoneConfig

    zones = []
    for kind, arguments in (("include", include), ("exclude", exclude)):
        for argument in arguments or ():
            name = f"--{kind} {argument!r}"
            zone = ZoneConfig(kind=kind, corners=parse_corners(f"--{kind}", argument))
            wrong = list(problems(zone, name)) or [
                f"{name}.{field} must be {bound}, got {value!r}."
                for field, bound, value in zone.beyond(width, height)
            ]
            if wrong:
                raise InputError(wrong[0], code="PNT-USE-009")
            zones.append(zone)
    return zones


def parse_corners(option: str, argument: str) -> list[list[float]]:
    """Reads the corners of an area on the tile.

    Args:
        option: Name of the option, for messages.
        argument: "X,Y,X,Y...", m.

    Returns:
        Corners [x, y]: two opposite ones of a rectangle, or all of a polygon.

    Raises:
        InputError: It is not two or more pairs of numbers.
    """
    try:
        numbers = [float(text) for text in argument.split(",")]
    except ValueError as error:
        raise InputError(
            f"{option} {argument!r}: {error}.", code="PNT-USE-010"
        ) from error
    if len(numbers) < 4 or len(numbers) % 2:
        raise InputError(
            f"{option} {argument!r}: expected two or more pairs X,Y, got "
            f"{len(numbers)} numbers.",
            code="PNT-USE-011",
        )
    return [numbers[i : i + 2] for i in range(0, len(numbers), 2)]


@contextmanager
def progress(description: str) -> Iterator[Callable[[float, str], None]]:
    """Shows a progress bar on stderr while the block runs.

    Args:
        description: The work.

    Yields:
        A function `show(share, text)`: share of the work done, 0 to 1, and the step
        that begins.
    """
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeElapsedColumn(),
        TextColumn("{task.fields[text]}"),
    )
    # On anything but a terminal a bar is noise in a log.
    console = Console(stderr=True)
    with Progress(*columns, console=console, disable=not console.is_terminal) as bar:
        task = bar.add_task(description, total=1.0, text="")
        yield lambda share, text: bar.update(task, completed=share, text=text)


@contextmanager
def output_folder(folder: Path) -> Iterator[Path]:
    """Gives a folder to write to that takes its name only when the block succeeds.

    The block writes to a hidden folder beside `folder`. When it ends without an
    exception, the files move to `folder`, where they replace files of the same names;
    otherwise they are removed and `folder` is as it was.

    Args:
        folder: Where the result is to be; parents are made.

    Yields:
        The folder to write to.

    Raises:
        InputError: `folder` is a file or cannot be made.
    """
    if folder.exists() and not folder.is_dir():
        raise InputError(
            f"--out {folder}: is a file; give a folder.", code="PNT-USE-012"
        )
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        draft = Path(tempfile.mkdtemp(prefix=f".{folder.name}.", dir=folder.parent))
    except OSError as error:
        raise InputError(
            f"--out {folder}: {error.strerror}.", code="PNT-USE-013"
        ) from error
    try:
        yield draft
        folder.mkdir(exist_ok=True)
        for path in sorted(draft.iterdir()):
            path.replace(folder / path.name)
    finally:
        shutil.rmtree(draft)
