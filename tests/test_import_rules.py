"""Imports point one way (STYLE section 1); read from the source, nothing is run."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FILES = sorted(
    path for top in ("painter", "perception") for path in (ROOT / top).rglob("*.py")
)

# What each part may import of this tree; the longest matching name counts.
IN_TREE = {
    "perception": {"perception"},
    "painter": set(),
    "painter.resources": {"painter_models"},
    "painter.timebase": set(),
    "painter.camera": {
        "painter.camera",
        "painter.errors",
        "painter.timebase",
        "perception",
    },
    "painter.config": {
        "painter.camera.config",
        "painter.errors",
        "painter.planning.config",
        "painter.resources",
        "perception.config",
        "perception.mapping.config",
    },
    "painter.planning": {"painter.errors", "painter.planning", "perception"},
    "painter.canopen": {"painter.canopen", "painter.errors", "painter.timebase"},
    "painter.scene": {
        "painter.errors",
        "painter.resources",
        "painter.scene",
        "perception.values",
    },
    "painter.systems": {
        "painter.camera",
        "painter.canopen",
        "painter.errors",
        "painter.planning",
        "painter.systems.ports",
        "painter.systems.stage",
        "painter.systems.values",
        "perception",
    },
    "painter.diagrams": {
        "painter.camera",
        "painter.canopen",
        "painter.config",
        "painter.diagrams",
        "painter.errors",
        "painter.planning",
        "painter.resources",
        "painter.scene",
        "painter.systems",
        "perception",
    },
    "painter.run": {
        "painter.config",
        "painter.errors",
        "painter.planning",
        "painter.resources",
        "painter.run",
        "perception",
    },
    "painter.cli": {"painter", "perception"},
}

# What each part may import of Drake; parts that are not named may import any module.
PYDRAKE = {
    "perception": {"pydrake.math", "pydrake.trajectories"},
    "painter.planning": {
        "pydrake.common",
        "pydrake.geometry",
        "pydrake.math",
        "pydrake.planning",
        "pydrake.trajectories",
    },
    "painter.camera": set(),
    "painter.canopen": set(),
    "painter.errors": set(),
}

# The bus and the cameras belong to the robot's side: simulation runs without them.
HARDWARE_PACKAGES = {"can", "canopen", "pyrealsense2"}
HARDWARE_MODULES = {
    "painter.camera.realsense",
    "painter.camera.software",
    "painter.canopen",
    "painter.systems.canopen_arm",
    "painter.systems.canopen_gun",
    "perception.bag_io",
    "perception.mapping.bag",
}


def module_name(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(part for part in parts if part != "__init__")


def is_within(module: str, prefixes: set[str]) -> bool:
    return any(module == p or module.startswith(f"{p}.") for p in prefixes)


def rule_for(module: str, table: dict[str, set[str]]) -> set[str] | None:
    matching = [prefix for prefix in table if is_within(module, {prefix})]
    return table[max(matching, key=len)] if matching else None


def imports(path: Path) -> list[str]:
    """Full names that a file imports; `from a import b` counts as a.b."""
    names = []
    for node in ast.walk(ast.parse(path.read_text(), str(path))):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names += [f"{node.module}.{alias.name}" for alias in node.names]
    return names


def violations(module: str, names: list[str]) -> list[str]:
    """Those of `names` that `module` may not import."""
    in_tree = rule_for(module, IN_TREE) or set()
    pydrake = rule_for(module, PYDRAKE)
    bad = []
    for name in names:
        top = name.partition(".")[0]
        if top in ("painter", "perception", "painter_models"):
            allowed = is_within(name, in_tree)
        elif top == "pydrake":
            allowed = pydrake is None or is_within(name, pydrake)
            allowed = allowed and not is_within(name, {"pydrake.all"})
        elif top in HARDWARE_PACKAGES:
            allowed = is_within(module, HARDWARE_MODULES)
        else:
            allowed = True
        if not allowed:
            bad.append(name)
    return bad


@pytest.mark.parametrize("path", FILES, ids=module_name)
def test_imports_point_one_way(path):
    assert violations(module_name(path), imports(path)) == []


@pytest.mark.parametrize("path", FILES, ids=module_name)
def test_imports_in_the_tree_are_absolute(path):
    nodes = ast.walk(ast.parse(path.read_text()))
    assert not any(isinstance(node, ast.ImportFrom) and node.level for node in nodes)


@pytest.mark.parametrize("path", FILES, ids=module_name)
def test_only_commands_print(path):
    if is_within(module_name(path), {"painter.cli"}):
        return
    calls = [n.func for n in ast.walk(ast.parse(path.read_text())) if is_call(n)]
    assert not any(isinstance(f, ast.Name) and f.id == "print" for f in calls)


def is_call(node: ast.AST) -> bool:
    return isinstance(node, ast.Call)


@pytest.mark.parametrize(
    ("module", "name"),
    [
        ("perception.planes", "painter.errors.PainterError"),
        ("perception.planes", "pydrake.systems.framework.LeafSystem"),
        ("painter.planning.raster", "pydrake.systems.framework.LeafSystem"),
        ("painter.planning.raster", "painter.systems.values.Phase"),
        ("painter.planning.raster", "painter.config.Scenario"),
        ("painter.systems.paint_film", "painter.systems.gun_pose.GunPose"),
        ("painter.systems.paint_film", "painter.config.Scenario"),
        ("painter.systems.paint_film", "can"),
        ("painter.diagrams.station", "painter.run.folder.RunFolder"),
        ("painter.diagrams.station", "pydrake.all.LeafSystem"),
        ("painter.run.folder", "painter.diagrams.station.MakeStation"),
        ("painter.canopen.units", "pydrake.math.RigidTransform"),
        ("painter.errors", "perception.errors.PerceptionError"),
    ],
)
def test_the_rules_catch(module, name):
    assert violations(module, [name]) == [name]


def test_every_top_package_is_under_a_rule():
    assert all(rule_for(module_name(path), IN_TREE) is not None for path in FILES)


def test_the_paint_cycle_loads_without_bus_and_camera_packages():
    blocked = "".join(f"sys.modules[{name!r}] = None; " for name in HARDWARE_PACKAGES)
    code = f"import sys; {blocked}import painter.diagrams.paint_cycle"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
