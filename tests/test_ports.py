"""Every system's docstring block names exactly the ports that it declares."""

import importlib
import inspect
import pkgutil
import re
import textwrap

import pytest
import yaml
from pydrake.systems.framework import Diagram, LeafSystem

import painter.systems
from painter.camera.reader import Reading
from painter.config import load_scenario
from painter.cycle.true_wall import true_segmentation
from painter.diagrams.paint_cycle import MakePaintCycle
from painter.planning.program.remainder import Remainder
from painter.systems.stage import Stage
from painter.systems.value_system import ValueSystem
from tests.hil import Loop

MARK = ".. pydrake_system::"
# Bases that never stand in a diagram themselves.
BASES = {Stage, ValueSystem}


def declared_classes() -> list[type[LeafSystem]]:
    """All systems that painter.systems defines."""
    classes = []
    for info in pkgutil.walk_packages(painter.systems.__path__, "painter.systems."):
        module = importlib.import_module(info.name)
        classes += [
            value
            for value in vars(module).values()
            if inspect.isclass(value)
            and issubclass(value, LeafSystem)
            and value.__module__ == module.__name__
            and value not in BASES
        ]
    return classes


def leaves(diagram: Diagram) -> list[LeafSystem]:
    """All systems of a diagram and of those in it."""
    found = []
    for system in diagram.GetSystems():
        found += leaves(system) if isinstance(system, Diagram) else [system]
    return found


def documented(system: type[LeafSystem]) -> dict:
    """The docstring's port block as name, input_ports and output_ports."""
    text = inspect.getdoc(system) or ""
    assert MARK in text, f"{system.__name__} has no {MARK} block"
    lines = text.split(MARK)[1].splitlines()[1:]
    block = []
    for line in lines:
        if line and not line.startswith(" "):
            break
        block.append(line)
    return yaml.safe_load(textwrap.dedent("\n".join(block)))


@pytest.fixture(scope="module")
def cycles():
    """Keeps the diagrams alive as long as their systems are looked at."""
    job = load_scenario("blank")
    known = Remainder(segmentation=true_segmentation(job), strokes=())
    robot = Loop(job, world=False).bring_up().connection(read_camera=Reading)
    return (
        MakePaintCycle(job),
        MakePaintCycle(job, remainder=known),
        MakePaintCycle(job, connection=robot),
    )


@pytest.fixture(scope="module")
def instances(cycles):
    """The systems of whole paint cycles by class."""
    return {type(dut): dut for cycle in cycles for dut in leaves(cycle.diagram)}


@pytest.mark.parametrize("kind", declared_classes(), ids=lambda kind: kind.__name__)
def test_port_block_is_what_is_declared(kind, instances):
    assert kind in instances, f"{kind.__name__} is in no paint cycle"
    dut = instances[kind]
    block = documented(kind)
    inputs = [dut.get_input_port(i) for i in range(dut.num_input_ports())]
    outputs = [dut.get_output_port(i) for i in range(dut.num_output_ports())]
    assert block["name"] == kind.__name__
    assert block["input_ports"] == [port.get_name() for port in inputs]
    assert block["output_ports"] == [port.get_name() for port in outputs]


@pytest.mark.parametrize("kind", declared_classes(), ids=lambda kind: kind.__name__)
def test_every_port_is_explained(kind):
    block = documented(kind)
    _, _, text = (inspect.getdoc(kind) or "").partition("\nPorts:\n")
    heads = re.findall(r"^    (\S[^:\n]*):", text, re.MULTILINE)
    explained = {name.strip() for head in heads for name in head.split(",")}
    assert explained >= {*block["input_ports"], *block["output_ports"]}


def test_file_is_named_after_its_system():
    assert len(declared_classes()) > 15
    for kind in declared_classes():
        words = "".join(f"_{c.lower()}" if c.isupper() else c for c in kind.__name__)
        assert kind.__module__.rpartition(".")[2] == words.lstrip("_")
