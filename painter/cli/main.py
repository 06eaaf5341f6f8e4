"""The `painter` command: finds the subcommand, maps errors to exit status."""

import importlib
import inspect
import json
import logging
import re
import sys
from collections.abc import Sequence
from typing import Annotated, Any

import typer
from typer.core import TyperGroup
from typer.main import get_command

from painter.cli.common import print_error
from painter.errors import PainterError
from perception.errors import PerceptionError

# Every command is the function of its name in the module of its name beside this one.
COMMANDS = {
    "simulate": "Simulate a whole paint cycle in Drake.",
    "segment": "Segment a recorded cloud or depth image.",
    "map": "Map a recorded RGB-D sequence: camera poses and one surface.",
    "calibrate": "Calibrate the camera's mount from pictures and joint positions.",
    "plan": "Plan the paint program of a segmented wall.",
    "place": "Propose base positions for painting a tile or a wall.",
    "deploy": "Paint with the robot, over its CAN bus.",
    "drives": "Run simulated CiA 402 drives on a CAN interface.",
    "canlog": "Show a log of the bus in CiA 402 terms.",
    "report": "Rebuild the report page of a run.",
}

EXIT_DONE = 0
EXIT_INPUT = 2
EXIT_INTERRUPTED = 130


class LazyGroup(TyperGroup):
    """Imports a command's module only when that command is called.

    A command whose dependencies are missing does not take the others with it.
    """

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[Any, Any, list[str]]:
        """Returns name, real command and remaining arguments."""
        name, _, rest = super().resolve_command(ctx, args)
        module = importlib.import_module(f"painter.cli.{name}")
        function = getattr(module, str(name))
        # The help is the docstring without what only a reader of the code needs.
        summary = re.split(r"\n\s*\n *(?:Args|Returns|Raises):", function.__doc__)[0]
        single = typer.Typer(add_completion=False, rich_markup_mode=None)
        single.command(name, help=inspect.cleandoc(summary))(function)
        return name, get_command(single), rest


app = typer.Typer(
    cls=LazyGroup,
    name="painter",
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _placeholder() -> None:
    """Stands for a command in the list of commands; `LazyGroup` replaces it."""


for _name, _summary in COMMANDS.items():
    app.command(_name, help=_summary)(_placeholder)


def _print_version(is_asked: bool) -> None:
    if is_asked:
        from importlib.metadata import version

        typer.echo(f"painter {version('painter')}")
        raise typer.Exit


@app.callback()
def _root(
    verbose: Annotated[
        bool,
        typer.Option("--verbose", "-v", help="Log progress and details to stderr."),
    ] = False,
    show_version: Annotated[
        bool,
        typer.Option(
            "--version",
            callback=_print_version,
            is_eager=True,
            help="Print the version and exit.",
        ),
    ] = False,
) -> None:
    """Scan a wall, find out what to paint, and paint it.

    Exit status: 0 done, 1 failed or aborted job, 2 wrong use or unusable input.
    """
    handler = logging.StreamHandler()
    # On the handler, because Drake sets its own logger to INFO when it is imported.
    handler.setLevel(logging.INFO if verbose else logging.WARNING)
    logging.basicConfig(
        level=logging.INFO,
        format="%(name)s: %(levelname)s: %(message)s",
        handlers=[handler],
    )


def run(arguments: Sequence[str]) -> int:
    """Runs the command line.

    Args:
        arguments: What follows `painter`; nothing asks for help.

    Returns:
        The exit status. Painter's own errors and wrong use are one line on stderr and,
        with --json, one JSON object on stdout; any other exception is a bug and passes
        through.
    """
    arguments = list(arguments) or ["--help"]
    try:
        status = app(arguments, prog_name="painter", standalone_mode=False)
    except typer.TyperException as error:
        message = error.format_message()
        return _fail(arguments, message, code="PNT-USE-055", status=EXIT_INPUT)
    except (PainterError, PerceptionError) as error:
        return _fail(arguments, str(error), code=error.code, status=error.exit_code)
    except (KeyboardInterrupt, typer.Abort):
        status = EXIT_INTERRUPTED
    if status == EXIT_INTERRUPTED:
        return _fail(arguments, "interrupted.", code="PNT-USE-056", status=status)
    return status if isinstance(status, int) else EXIT_DONE


def main() -> None:
    """Entry point of the `painter` program."""
    sys.exit(run(sys.argv[1:]))


def _fail(arguments: Sequence[str], message: str, *, code: str, status: int) -> int:
    """Prints an error and returns the exit status."""
    print_error(message, code)
    if "--json" in arguments:
        error = {
            "code": code,
            "message": " ".join(message.split()),
            "exit_status": status,
        }
        typer.echo(json.dumps({"error": error}, indent=2))
    return status
