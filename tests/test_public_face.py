"""`import painter`: lazy, documented, and all that a notebook needs."""

import ast
import subprocess
import sys
from pathlib import Path

import nbformat
import pytest

import painter

ROOT = Path(__file__).parents[1]
HEAVY = {"pydrake", "open3d", "matplotlib", "scipy", "cv2", "can", "numpy", "yaml"}


def test_import_loads_nothing():
    code = f"import sys, painter; print(*({HEAVY!r} & sys.modules.keys()))"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == []


@pytest.mark.parametrize("name", painter.__all__)
def test_each_name_is_there_and_documented(name):
    value = getattr(painter, name)
    assert name in dir(painter)
    if name == "__version__":
        assert value.count(".") == 2
        return
    assert value.__doc__ and value.__doc__[0].isupper()
    if name[0].islower():
        assert f"`{name}`" in painter.__doc__


def test_other_names_are_attribute_errors():
    with pytest.raises(AttributeError, match="no attribute 'paint'"):
        painter.paint  # noqa: B018


def test_types_are_checked_as_the_names_are_found():
    """What mypy imports is what `__getattr__` imports."""
    tree = ast.parse(Path(painter.__file__).read_text())
    (block,) = (node for node in tree.body if isinstance(node, ast.If))
    typed = {
        alias.asname or alias.name: (node.module, alias.name)
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert typed.keys() == set(painter.__all__) - {"__version__"}
    for name, (module, attribute) in typed.items():
        assert getattr(painter, name) is getattr(sys.modules[module], attribute)


@pytest.mark.parametrize("path", sorted((ROOT / "notebooks").glob("*.ipynb")), ids=str)
def test_notebooks_import_painter_alone(path):
    cells = nbformat.read(path, as_version=4).cells
    source = "\n".join(cell.source for cell in cells if cell.cell_type == "code")
    modules = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            modules |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            modules.add(node.module)
    own = {"painter", "perception", "painter_models", "models"}
    assert {name for name in modules if name.partition(".")[0] in own} == {"painter"}
