"""The command line's frame: list of commands, errors, exit codes, lazy imports."""

import subprocess
import sys
import types
from importlib.metadata import version

import pytest
import typer

from painter.cli import main
from painter.errors import FaultError, InputError, PainterError
from perception.errors import CloudReadError, NoWallError


@pytest.fixture
def command(monkeypatch):
    """Puts a function in the place of the module of `painter plan`."""

    def replace(function):
        module = types.SimpleNamespace(plan=function)
        monkeypatch.setitem(sys.modules, "painter.cli.plan", module)

    return replace


@pytest.mark.parametrize("words", [["--help"], ["-h"], []])
def test_help_lists_every_command_with_its_summary(words, capsys):
    assert main.run(words) == 0
    text = capsys.readouterr().out
    for name, summary in main.COMMANDS.items():
        assert name in text
        assert summary in text


def test_help_loads_neither_drake_nor_open3d():
    code = (
        "import sys; from painter.cli.main import run; run(['--help']);"
        "print(sorted({'pydrake', 'open3d', 'scipy', 'can'} & set(sys.modules)))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert done.stdout.splitlines()[-1] == "[]"


def test_version_is_the_installed_one(capsys):
    assert main.run(["--version"]) == 0
    assert capsys.readouterr().out == f"painter {version('painter')}\n"


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["simulat"], "simulat"),
        (["--frob"], "--frob"),
        (["plan", "--frob"], "--frob"),
        (["plan", "--speed", "fast"], "--speed"),
    ],
)
def test_wrong_use_is_one_line_and_exit_2(words, named, command, capsys):
    def plan(speed: float = 1.0) -> None:
        """Plan."""

    command(plan)
    assert main.run(words) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("painter: error: ")
    assert err.count("\n") == 1
    assert named in err


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (InputError("cloud.ply: no such file.", code="PNT-TEST-001"), 2),
        (CloudReadError("cloud.ply: truncated.", code="PNT-TEST-001"), 2),
        (NoWallError("no wall.", code="PNT-TEST-001"), 1),
        (FaultError("drive 2.", code="PNT-TEST-001"), 1),
        (PainterError("over\ntwo lines", code="PNT-TEST-001"), 1),
    ],
)
def test_errors_of_painters_own_are_one_line(error, code, command, capsys):
    def plan() -> None:
        """Plan."""
        raise error

    command(plan)
    assert main.run(["plan"]) == code
    text = " ".join(str(error).split())
    assert capsys.readouterr().err == f"painter: error: {text} [PNT-TEST-001]\n"


def test_a_bug_is_not_hidden(command):
    def plan() -> None:
        """Plan."""
        raise ZeroDivisionError

    command(plan)
    with pytest.raises(ZeroDivisionError):
        main.run(["plan"])


def test_interrupt_is_130(command, capsys):
    def plan() -> None:
        """Plan."""
        raise KeyboardInterrupt

    command(plan)
    assert main.run(["plan"]) == 130
    assert capsys.readouterr().err == "painter: error: interrupted.\n"


def test_a_command_may_set_the_exit_status(command):
    def plan() -> None:
        """Plan."""
        raise typer.Exit(1)

    command(plan)
    assert main.run(["plan"]) == 1


def test_a_commands_help_leaves_out_the_docstrings_sections(command, capsys):
    def plan(speed: float = 0.6) -> None:
        """Plan strokes.

        Over the wall alone.

        Args:
            speed: Not for the help.
        """

    command(plan)
    assert main.run(["plan", "--help"]) == 0
    text = capsys.readouterr().out
    assert "Plan strokes." in text
    assert "Over the wall alone." in text
    assert "Args" not in text
    assert "0.6" in text
