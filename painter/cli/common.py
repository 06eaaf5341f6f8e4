"""What the commands share: options, results, progress and output folders."""

import importlib.metadata
import json
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from painter.errors import InputError
from painter.planning.config import ZoneConfig

ScenarioArgument = Annotated[
    str | None,
    typer.Argument(
        help="Name of a scenario, or the path of its YAML file; default cubes, or that "
        "of the run gone on with.",
        show_default=False,
    ),
]
SetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Set a scenario value in SI units, e.g. raster.speed=0.5; repeatable.",
    ),
]
OutOption = Annotated[
    Path, typer.Option("--out", metavar="DIR", help="Folder to write the result to.")
]
RateOption = Annotated[
    float,
    typer.Option(
        min=0.05,
        max=1.0,
        help="Seconds of the run's clock in a second: below 1, simulated drives, world "
        "and brain have more time; the same for `painter drives` and `painter deploy`.",
    ),
]
JsonOption = Annotated[
    bool, typer.Option("--json", help="Print the result as JSON alone on stdout.")
]


def versions(*more: str) -> dict[str, str]:
    """Returns the versions of the packages that a cycle's figures depend on.

    Args:
        more: Names of packages beside those that every cycle uses.
    """
    names = ("painter", "drake", *more, "numpy", "scipy", "open3d")
    return {name: importlib.metadata.version(name) for name in names}


def print_result(result: Mapping[str, Any], *, as_json: bool) -> None:
    """Prints what a command found.

    Args:
        result: Names and JSON values; numbers in SI units or with the unit in the name.
        as_json: One JSON object, else a line for each name.
    """
    if as_json:
        typer.echo(json.dumps(result, indent=2, allow_nan=False))
        return
    width = max(map(len, result), default=0)
    for name, value in result.items():
        text = f"{value:.4g}" if isinstance(value, float) else str(value)
        typer.echo(f"{name:<{width}}  {text}")


def print_summary(figures: dict, out: Path) -> None:
    """Prints the figures of a run that matter most."""
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
    print_result(summary | {"report": str(out / "report.html")}, as_json=False)


IncludeOption = Annotated[
    list[str] | None,
    typer.Option(
        "--include",
        metavar="X,Y,X,Y...",
        help="Paint only inside such zones: two opposite corners of a rectangle or the "
        "corners of a polygon, m from the lower left corner; repeatable.",
    ),
]
ExcludeOption = Annotated[
    list[str] | None,
    typer.Option(
        "--exclude",
        metavar="X,Y,X,Y...",
        help="Leave this zone clean; given as for --include; repeatable.",
    ),
]


def operator_zones(
    include: Sequence[str] | None,
    exclude: Sequence[str] | None,
    width: float,
    height: float,
) -> list[ZoneConfig]:
    """Reads the zones of --include and --exclude.

    Args:
        include: Words of --include.
        exclude: Words of --exclude.
        width: Of the tile or wall that they are on, m.
        height: Of the same, m.

    Raises:
        InputError: A zone is none, or not on the tile; names option, value and bound.
    """
    zones = []
    for kind, words in (("include", include), ("exclude", exclude)):
        for word in words or ():
            name = f"--{kind} {word!r}"
            zone = ZoneConfig(kind=kind, corners=mark_corners(f"--{kind}", word))
            try:
                zone.validate(name)
                zone.require_on(width, height, name)
            except ValueError as error:
                raise InputError(str(error), code="PNT-USE-009") from error
            zones.append(zone)
    return zones


def mark_corners(option: str, word: str) -> list[list[float]]:
    """Reads a mark on the tile from the command line.

    Args:
        option: Name of the option, for messages.
        word: "X,Y,X,Y...", m.

    Returns:
        Corners [x, y]: two opposite ones of a rectangle, or all of a polygon.

    Raises:
        InputError: It is not two or more pairs of numbers.
    """
    try:
        numbers = [float(text) for text in word.split(",")]
    except ValueError as error:
        raise InputError(f"{option} {word!r}: {error}.", code="PNT-USE-010") from error
    if len(numbers) < 4 or len(numbers) % 2:
        raise InputError(
            f"{option} {word!r}: expected two or more pairs X,Y, got {len(numbers)} "
            "numbers.",
            code="PNT-USE-011",
        )
    return [numbers[i : i + 2] for i in range(0, len(numbers), 2)]


@contextmanager
def progress(description: str) -> Iterator[Callable[[float, str], None]]:
    """Shows a progress bar on stderr while the block runs.

    Args:
        description: What is being done.

    Yields:
        A function `show(share, text)`: the share done, 0 to 1, and what is done now.
    """
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
    """Gives a folder to write to that takes its name only when all went well.

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
            f"--out {folder}: there is a file of that name.", code="PNT-USE-012"
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
