"""Imports point one way (STYLE section 1); read from the source, nothing is run.

Each test lists all violations of one rule, so that a new file needs no new test.
"""

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FILES = sorted(
    path
    for top in ("painter", "perception", "models", "benchmarks")
    for path in (ROOT / top).rglob("*.py")
)
MOST_FILES = 15  # Directly in one folder; `painter/cli` has one a command.

PLANNING_VALUES = {
    "painter.planning.config",
    "painter.planning.spray_path",
    "painter.planning.tile",
    "painter.planning.zones",
}
SYSTEM_VALUES = {
    "painter.systems.cycle_state",
    "painter.systems.ports",
    "painter.systems.stage",
    "painter.systems.value_system",
    "painter.systems.values",
}

# Open to every room.
OPEN = {"perception.ground", "perception.settings"}

# The rooms from the ground up, and what each may import of this tree beside itself and
# `OPEN`; the longest matching name counts. A room that is listed lower never imports
# one that is listed higher.
ROOMS: dict[str, set[str]] = {
    "perception.coded_error": set(),
    "perception.ground": set(),
    "perception.settings": set(),
    "perception.errors": {"perception.coded_error"},
    "perception.config": set(),
    "perception.values": set(),
    "perception.depth_camera": {"perception.config", "perception.errors"},
    "perception.io": {
        "perception.depth_camera",
        "perception.errors",
        "perception.values",
    },
    "perception.paper_steps": {
        "perception.config",
        "perception.errors",
        "perception.values",
    },
    "perception.fine_steps": {
        "perception.config",
        "perception.errors",
        "perception.paper_steps",
        "perception.values",
    },
    "perception.segmentation": {
        "perception.config",
        "perception.fine_steps",
        "perception.paper_steps",
        "perception.values",
    },
    "perception.recorded": {
        "perception.config",
        "perception.errors",
        "perception.fine_steps",
        "perception.io",
        "perception.paper_steps",
        "perception.segmentation",
        "perception.values",
    },
    "perception.synthetic": {
        "perception.config",
        "perception.depth_camera",
        "perception.io",
        "perception.values",
    },
    "perception.mapping.config": set(),
    "perception.mapping.keyframes": {
        "perception.config",
        "perception.depth_camera",
        "perception.io",
        "perception.mapping.config",
        "perception.paper_steps",
    },
    "perception.mapping.pose_graph": {
        "perception.depth_camera",
        "perception.mapping.config",
        "perception.mapping.keyframes",
        "perception.paper_steps",
    },
    "perception.mapping.fusion": {
        "perception.config",
        "perception.depth_camera",
        "perception.io",
        "perception.mapping.config",
        "perception.mapping.keyframes",
        "perception.values",
    },
    "perception.mapping.calibration": {
        "perception.depth_camera",
        "perception.errors",
        "perception.io",
        "perception.mapping.config",
        "perception.mapping.keyframes",
        "perception.mapping.pose_graph",
    },
    "perception.mapping.sessions": {
        "perception.config",
        "perception.depth_camera",
        "perception.errors",
        "perception.io",
        "perception.mapping.config",
        "perception.mapping.fusion",
        "perception.mapping.keyframes",
        "perception.mapping.pose_graph",
        "perception.values",
    },
    "perception.mapping": set(),
    "perception": set(),
    "painter.errors": {"perception.coded_error"},
    "painter.timebase": set(),
    "painter.typed_yaml": set(),
    "painter.resources": {"painter_models"},
    "painter.named_yaml": {
        "painter.errors",
        "painter.resources",
        "painter.typed_yaml",
    },
    "painter.planning.config": set(),
    "painter.planning": PLANNING_VALUES,
    "painter.planning.arm": PLANNING_VALUES
    | {"painter.errors", "perception.config", "perception.depth_camera"},
    "painter.planning.clearance": PLANNING_VALUES
    | {"painter.errors", "perception.values"},
    "painter.planning.film": PLANNING_VALUES | {"perception.values"},
    "painter.planning.strokes": PLANNING_VALUES | {"painter.planning.film"},
    "painter.planning.motion": PLANNING_VALUES
    | {
        "painter.errors",
        "painter.planning.arm",
        "painter.planning.clearance",
        "perception.values",
    },
    "painter.planning.program": PLANNING_VALUES
    | {
        "painter.errors",
        "painter.planning.arm",
        "painter.planning.clearance",
        "painter.planning.film",
        "painter.planning.motion",
        "painter.planning.strokes",
        "perception.values",
    },
    "painter.planning.scan": PLANNING_VALUES
    | {
        "painter.errors",
        "painter.planning.arm",
        "painter.planning.clearance",
        "painter.planning.motion",
        "perception.fine_steps",
    },
    "painter.camera": {"painter.errors", "painter.timebase", "perception.depth_camera"},
    "painter.config": {
        "painter.camera.config",
        "painter.errors",
        "painter.planning.config",
        "painter.named_yaml",
        "painter.resources",
        "painter.typed_yaml",
        "perception.config",
        "perception.mapping.config",
    },
    "painter.scene": {
        "painter.errors",
        "painter.named_yaml",
        "painter.resources",
        "painter.typed_yaml",
    },
    "painter.canopen": set(),
    "painter.canopen.protocol": {"painter.errors"},
    "painter.canopen.config": {
        "painter.canopen.protocol",
        "painter.errors",
        "painter.typed_yaml",
    },
    "painter.canopen.wire": {
        "painter.canopen.config",
        "painter.canopen.protocol",
        "painter.errors",
        "painter.timebase",
    },
    "painter.canopen.master": {
        "painter.canopen.config",
        "painter.canopen.protocol",
        "painter.canopen.wire",
        "painter.errors",
    },
    "painter.canopen.process": {
        "painter.canopen.config",
        "painter.canopen.master",
        "painter.canopen.wire",
        "painter.errors",
        "painter.timebase",
    },
    "painter.canopen.analysis": {
        "painter.canopen.config",
        "painter.canopen.master",
        "painter.canopen.process",
        "painter.canopen.protocol",
        "painter.canopen.wire",
        "painter.errors",
    },
    "painter.canopen.sim": {
        "painter.canopen.config",
        "painter.canopen.master",
        "painter.canopen.process",
        "painter.canopen.protocol",
        "painter.canopen.wire",
        "painter.errors",
        "painter.timebase",
    },
    "painter.robot": {
        "painter.config",
        "painter.errors",
        "painter.planning",
        "painter.resources",
        "painter.scene",
    },
    "painter.systems": SYSTEM_VALUES
    | {"painter.errors", "painter.planning", "perception.errors", "perception.values"},
    "painter.systems.brain": SYSTEM_VALUES
    | {"painter.errors", "painter.planning", "perception"},
    "painter.systems.simulated": SYSTEM_VALUES
    | {
        "painter.errors",
        "painter.planning",
        "perception.config",
        "perception.depth_camera",
    },
    "painter.systems.hardware": SYSTEM_VALUES
    | {
        "painter.camera",
        "painter.canopen",
        "painter.errors",
        "painter.planning.arm.kinematics",
    },
    "painter.diagrams": {
        "painter.camera",
        "painter.canopen.process",
        "painter.config",
        "painter.errors",
        "painter.planning",
        "painter.robot",
        "painter.scene",
        "painter.systems",
        "perception.depth_camera",
        "perception.values",
    },
    "painter.run.folder": {
        "painter.errors",
        "painter.planning",
        "perception.errors",
        "perception.io",
        "perception.values",
    },
    "painter.run.figures": {
        "painter.errors",
        "painter.planning",
        "painter.run.folder",
        "perception.values",
    },
    "painter.run.pictures": {
        "painter.planning",
        "painter.run.figures",
        "painter.run.folder",
        "perception.paper_steps",
        "perception.values",
    },
    "painter.run.page": {
        "painter.planning",
        "painter.run.figures",
        "painter.run.folder",
        "painter.run.pictures",
        "perception",
    },
    "painter.run": {
        "painter.errors",
        "painter.planning",
        "painter.run.folder",
        "perception.values",
    },
    "painter.cycle": {
        "painter.camera",
        "painter.canopen",
        "painter.config",
        "painter.diagrams",
        "painter.errors",
        "painter.planning",
        "painter.robot",
        "painter.run",
        "painter.scene",
        "painter.systems",
        "perception.values",
    },
    "painter.rehearsal": {
        "painter.camera",
        "painter.canopen",
        "painter.config",
        "painter.cycle",
        "painter.diagrams",
        "painter.errors",
        "painter.planning",
        "painter.robot",
        "painter.run",
        "painter.scene",
        "painter.systems",
    },
    "painter.jobs": {
        "painter.camera",
        "painter.canopen",
        "painter.config",
        "painter.cycle",
        "painter.diagrams",
        "painter.errors",
        "painter.planning",
        "painter.rehearsal",
        "painter.robot",
        "painter.run",
        "painter.scene",
        "painter.systems",
        "painter.timebase",
        "perception",
    },
    # The public face stands above all but the commands.
    "painter": {
        "painter.config",
        "painter.cycle",
        "painter.diagrams",
        "painter.errors",
        "painter.jobs",
        "painter.resources",
        "painter.run",
        "painter.scene",
        "perception",
    },
    "painter.cli": {"painter", "perception"},
    "painter.__main__": {"painter.cli"},
    # Draws the robot with the robot's own model.
    "models": {"models", "painter_models", "painter.robot"},
    "benchmarks": {"benchmarks", "painter", "painter_models", "perception"},
}

# What each room may import of Drake; rooms that are not named may import any module.
PLANNING_DRAKE = {
    "pydrake.common",
    "pydrake.geometry",
    "pydrake.math",
    "pydrake.multibody",
    "pydrake.planning",
    "pydrake.solvers",
    "pydrake.trajectories",
}
PYDRAKE: dict[str, set[str]] = {
    "perception": {"pydrake.math", "pydrake.trajectories"},
    "perception.ground": set(),
    "perception.settings": set(),
    "painter.planning": PLANNING_DRAKE,
    "painter.camera": set(),
    "painter.canopen": set(),
    "painter.errors": set(),
    "painter.timebase": set(),
    "painter.named_yaml": set(),
    "painter.typed_yaml": set(),
}

# The bus and the cameras belong to the robot's side: simulation runs without them.
HARDWARE_PACKAGES = {"can", "canopen", "pyrealsense2"}
HARDWARE_ROOMS = {
    "painter.camera.realsense",
    "painter.camera.software",
    "painter.canopen",
    "painter.systems.hardware",
    "perception.io.bag_frames",
    "perception.io.bags",
    "benchmarks",
}
IN_TREE = ("painter", "perception", "painter_models", "models", "benchmarks")


def module_name(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(part for part in parts if part != "__init__")


def is_within(module: str, prefixes: set[str]) -> bool:
    return any(module == p or module.startswith(f"{p}.") for p in prefixes)


def room_of(module: str, table: dict[str, set[str]]) -> str | None:
    matching = [prefix for prefix in table if is_within(module, {prefix})]
    return max(matching, key=len) if matching else None


def imports(tree: ast.Module) -> Iterator[str]:
    """Yields full names that a file imports; `from a import b` counts as a.b."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def is_allowed(module: str, name: str) -> bool:
    """Returns whether `module` may import `name`."""
    top = name.partition(".")[0]
    if top in IN_TREE:
        room = room_of(module, ROOMS)
        assert room is not None, f"{module} is in no room of the table"
        # Files of one room may meet, but for systems: they meet in a diagram.
        own = room_of(name, ROOMS) == room and not is_within(room, {"painter.systems"})
        allowed = ROOMS[room] | OPEN
        return own or is_within(name, allowed)
    if top == "pydrake":
        room = room_of(module, PYDRAKE)
        allowed = room is None or is_within(name, PYDRAKE[room])
        return allowed and not is_within(name, {"pydrake.all"})
    if top in HARDWARE_PACKAGES:
        return is_within(module, HARDWARE_ROOMS)
    return True


def parsed() -> Iterator[tuple[str, ast.Module]]:
    for path in FILES:
        yield module_name(path), ast.parse(path.read_text(), str(path))


def test_imports_point_one_way():
    bad = [
        f"{module} imports {name}"
        for module, tree in parsed()
        for name in imports(tree)
        if not is_allowed(module, name)
    ]
    assert bad == []


def test_rooms_are_listed_from_the_ground_up():
    order = list(ROOMS)
    bad = [
        f"{room} may import {name}, which stands above it"
        for number, room in enumerate(order)
        for name in ROOMS[room]
        if name in order and order.index(name) > number and not is_within(name, {room})
    ]
    assert bad == []


def test_imports_are_absolute_and_only_commands_print():
    bad = []
    for module, tree in parsed():
        may_print = is_within(module, {"painter.cli", "benchmarks", "models.generate"})
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and node.level:
                bad.append(f"{module}:{node.lineno} imports relatively")
            if is_print(node) and not may_print:
                bad.append(f"{module}:{node.lineno} prints")
    assert bad == []


def is_print(node: ast.AST) -> bool:
    return (
        isinstance(node, ast.Call)
        and isinstance(node.func, ast.Name)
        and node.func.id == "print"
    )


def test_no_room_is_crowded_and_each_says_its_rule():
    bad = []
    for folder in sorted({path.parent for path in FILES}):
        name = folder.relative_to(ROOT).as_posix()
        files = [path for path in FILES if path.parent == folder]
        if len(files) > MOST_FILES and name != "painter/cli":
            bad.append(f"{name} holds {len(files)} files")
        init = folder / "__init__.py"
        if not init.exists() or not ast.get_docstring(ast.parse(init.read_text())):
            bad.append(f"{name}/__init__.py does not say what lives there")
    assert bad == []


@pytest.mark.parametrize(
    ("module", "name"),
    [
        ("perception.ground", "pydrake.math.RigidTransform"),
        ("perception.settings", "perception.config.MapConfig"),
        ("perception.paper_steps.planes", "perception.fine_steps.steps.find_steps"),
        ("perception.paper_steps.planes", "painter.errors.PainterError"),
        ("perception.paper_steps.planes", "pydrake.systems.framework.LeafSystem"),
        ("perception.io.clouds", "perception.recorded.wall_choice.choose_wall"),
        ("painter.planning.strokes.raster", "pydrake.systems.framework.LeafSystem"),
        ("painter.planning.strokes.raster", "painter.systems.values.Phase"),
        ("painter.planning.strokes.raster", "painter.config.Scenario"),
        ("painter.planning.film.film_model", "painter.planning.strokes.raster.lines"),
        ("painter.planning.tile", "painter.planning.arm.kinematics.ArmKinematics"),
        ("painter.systems.simulated.paint_film", "painter.systems.brain.paint_cycle.A"),
        ("painter.systems.simulated.paint_film", "painter.systems.simulated.gun_pose"),
        ("painter.systems.simulated.paint_film", "painter.config.Scenario"),
        ("painter.systems.simulated.paint_film", "can"),
        ("painter.diagrams.station", "painter.run.folder.folder.RunFolder"),
        ("painter.diagrams.station", "painter.cycle.simulate.SimulateCycle"),
        ("painter.diagrams.station", "pydrake.all.LeafSystem"),
        ("painter.run.folder.folder", "painter.diagrams.station.MakeStation"),
        ("painter.run.figures.figures", "painter.run.page.report.finish_run"),
        ("painter.cycle.write_run", "painter.cli.common.progress"),
        ("painter.canopen.config.units", "pydrake.math.RigidTransform"),
        ("painter.canopen.protocol.sdo", "painter.canopen.master.arm_bus.ArmBus"),
        ("painter.errors", "perception.errors.PerceptionError"),
        ("models.generate.looks", "painter.config.Scenario"),
    ],
)
def test_the_rules_catch(module, name):
    assert not is_allowed(module, name)


def test_the_paint_cycle_loads_without_bus_and_camera_packages():
    blocked = "".join(f"sys.modules[{name!r}] = None; " for name in HARDWARE_PACKAGES)
    code = f"import sys; {blocked}import painter.diagrams.paint_cycle"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_tests_bind_no_private_names():
    tuple_names = {"_replace", "_asdict", "_fields", "_make"}  # Of named tuples.
    bad = []
    for path in sorted((ROOT / "tests").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            names = []
            if isinstance(node, ast.ImportFrom):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.Attribute):
                own = isinstance(node.value, ast.Name) and node.value.id in (
                    "self",
                    "cls",
                )
                names = [] if own else [node.attr]
            bad += [
                f"{path.relative_to(ROOT)}:{node.lineno} binds {name}"
                for name in names
                if name[0] == "_" and name[:2] != "__" and name not in tuple_names
            ]
    assert bad == []
