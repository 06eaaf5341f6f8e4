"""`--help` and a TAB load nothing heavy; no timer: what was imported tells."""

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

import painter.cli
from painter.cli.main import COMMANDS
from painter.resources import named_scenarios

HEAVY = ("pydrake", "open3d", "matplotlib", "scipy", "cv2", "canopen", "can", "numpy")
FOLDER = Path(painter.cli.__file__).parent
LONGEST = 60  # Lines of a function, with its signature.


def python(code, **environment):
    """Runs code in a process of its own; returns stdout and the heavy modules."""
    last = f"print('heavy:', *({set(HEAVY)} & sys.modules.keys()), file=sys.stderr)"
    code = f"import atexit, sys\natexit.register(lambda: {last})\n{code}"
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | environment,
    )
    return done.stdout, done.stderr.splitlines()[-1].split()[1:]


@pytest.mark.parametrize("name", COMMANDS)
def test_help_of_a_command_loads_nothing_heavy(name):
    code = f"from painter.cli.main import run; run([{name!r}, '--help'])"
    out, heavy = python(code)
    assert f"Usage: painter {name} " in out
    assert heavy == []


@pytest.mark.parametrize(
    ("typed", "expected"),
    [
        ("painter s", {"simulate", "segment"}),
        ("painter simulate te", {"terrace"}),
        ("painter deploy ", set(named_scenarios())),
        ("painter plan wall.npz --scenario c", {"cubes"}),
        ("painter drives --scen", {"--scenario"}),
    ],
)
def test_a_tab_in_bash_completes_and_loads_nothing_heavy(typed, expected):
    out, heavy = python(
        "from painter.cli.main import main; main()",
        _PAINTER_COMPLETE="complete_bash",
        COMP_WORDS=typed,
        COMP_CWORD=str(len(typed.split(" ")) - 1),
    )
    assert set(out.split()) == expected
    assert heavy == []


def test_a_tab_in_zsh_completes_and_loads_nothing_heavy():
    out, heavy = python(
        "from painter.cli.main import main; main()",
        _PAINTER_COMPLETE="complete_zsh",
        _TYPER_COMPLETE_ARGS="painter simulate te",
    )
    assert '"terrace"' in out
    assert heavy == []


def test_python_m_painter_is_the_command():
    done = subprocess.run(
        [sys.executable, "-m", "painter", "--version"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.startswith("painter ")


def test_every_file_is_a_command_and_every_function_is_short():
    files = {path.stem: path for path in FOLDER.glob("*.py")}
    assert files.keys() == COMMANDS.keys() | {"__init__", "main", "common"}
    long = [
        f"{path.name}: {node.name} has {node.end_lineno - node.lineno + 1} lines"
        for path in files.values()
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.FunctionDef)
        and node.end_lineno - node.lineno >= LONGEST
    ]
    assert long == []
