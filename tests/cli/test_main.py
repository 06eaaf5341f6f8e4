"""The command line's frame: list of commands, errors, exit status."""

import json
import sys
import types
from importlib.metadata import version

import pytest
import typer

from painter.cli import common, main
from painter.cli.common import fail_unless_done, print_result
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


def test_with_json_an_error_is_one_object_on_stdout(command, capsys):
    def plan(as_json: common.Json = False) -> None:
        """Plan."""
        raise InputError("cloud.ply: no\nsuch file.", code="PNT-TEST-001")

    command(plan)
    assert main.run(["plan", "--json"]) == 2
    out, err = capsys.readouterr()
    assert json.loads(out) == {
        "error": {
            "code": "PNT-TEST-001",
            "message": "cloud.ply: no such file.",
            "exit_status": 2,
        }
    }
    assert err == "painter: error: cloud.ply: no such file. [PNT-TEST-001]\n"


@pytest.mark.parametrize(
    ("words", "status", "code"),
    [
        (["plan", "--json", "--frob"], 2, "PNT-USE-055"),
        (["plan", "--json"], 130, "PNT-USE-056"),
    ],
)
def test_with_json_wrong_use_and_interrupts_have_codes_too(
    words, status, code, command, capsys
):
    def plan(as_json: common.Json = False) -> None:
        """Plan."""
        raise KeyboardInterrupt

    command(plan)
    assert main.run(words) == status
    out, err = capsys.readouterr()
    error = json.loads(out)["error"]
    assert (error["code"], error["exit_status"]) == (code, status)
    assert err == f"painter: error: {error['message']} [{code}]\n"


def test_a_job_that_failed_prints_its_figures_and_no_second_object(command, capsys):
    figures = {"result": "FAULT", "cause": "drive 2.", "code": "PNT-TEST-001"}

    def plan(as_json: common.Json = False) -> None:
        """Plan."""
        print_result(figures, as_json=as_json)
        fail_unless_done(figures)

    command(plan)
    assert main.run(["plan", "--json"]) == 1
    out, err = capsys.readouterr()
    assert json.loads(out) == figures
    assert err == "painter: error: FAULT: drive 2. [PNT-TEST-001]\n"


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
    assert capsys.readouterr().err == "painter: error: interrupted. [PNT-USE-056]\n"


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
