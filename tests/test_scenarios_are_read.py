"""Some code reads every setting of a scenario, by the type checker's own word.

The fields are taken out of the configs in a shadow copy; then mypy names each place
that reads one, with its class. A common name in another class cannot pass for it.
"""

import ast
import dataclasses
import inspect
import re
import subprocess
import sys
from pathlib import Path
from typing import get_args

import pytest

from painter.config import Scenario

ROOT = Path(__file__).parents[1]


def configs(kind):
    """A config and all configs in it."""
    yield kind
    for field in dataclasses.fields(kind):
        part = (get_args(field.type) or (field.type,))[0]
        if dataclasses.is_dataclass(part):
            yield from configs(part)


def is_leaf(field):
    return not dataclasses.is_dataclass((get_args(field.type) or (field.type,))[0])


def without_fields(path, leaves):
    """The source of a module whose configs have lost these fields."""
    tree = ast.parse(path.read_text())
    for node in tree.body:
        if isinstance(node, ast.ClassDef) and node.name in leaves:
            node.body = [
                item
                for item in node.body
                if not isinstance(item, ast.AnnAssign)
                or item.target.id not in leaves[node.name]
            ] or [ast.Pass()]
    return ast.unparse(tree)


@pytest.mark.timeout(1800)
def test_some_code_reads_every_setting(tmp_path):
    leaves = {
        kind.__name__: {f.name for f in dataclasses.fields(kind) if is_leaf(f)}
        for kind in configs(Scenario)
    }
    paths = {Path(inspect.getfile(kind)) for kind in configs(Scenario)}
    words = [sys.executable, "-m", "mypy", "--cache-dir", str(tmp_path / "cache")]
    for number, path in enumerate(sorted(paths)):
        shadow = tmp_path / f"{number}.py"
        shadow.write_text(without_fields(path, leaves))
        words += ["--shadow-file", path.relative_to(ROOT).as_posix(), str(shadow)]
    done = subprocess.run(
        [*words, "painter", "perception"], cwd=ROOT, capture_output=True, text=True
    )
    own = {path.relative_to(ROOT).as_posix() for path in paths}
    read = {
        (kind, name)
        for file, kind, name in re.findall(
            r'^(\S+?):\d+: error: "(\w+)" has no attribute "(\w+)"', done.stdout, re.M
        )
        if file not in own
    }
    wanted = {(kind, name) for kind, names in leaves.items() for name in names}
    assert len(wanted) > 100
    control = ("TipConfig", "nobody_reads_this")
    assert sorted((wanted | {control}) - read) == [control]
