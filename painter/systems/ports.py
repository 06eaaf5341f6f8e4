"""Typed ports: declared, read and checked by name and Python type."""

from collections.abc import Mapping
from typing import Any, TypeVar

from pydrake.common.value import Value
from pydrake.systems.framework import (
    Context,
    InputPort,
    LeafSystem,
    OutputPort,
    PortDataType,
    System,
)

from painter.errors import PortTypeError

T = TypeVar("T")

Ports = Mapping[str, Any]
"""Ports by name: the size of a vector, or an example of an abstract port's value."""


def EvalAs(port: InputPort | OutputPort, context: Context, kind: type[T]) -> T:
    """Evaluates a port and checks the Python type that it carries.

    Drake cannot tell two Python types apart when ports are connected.

    Args:
        port: Port of the calling system (or of any, with that system's context).
        context: Context of the port's system.
        kind: Expected type.

    Returns:
        The value.

    Raises:
        PortTypeError: The value is of another type; names system and port.
    """
    value = port.Eval(context)
    if not isinstance(value, kind):
        name = port.get_system().GetSystemPathname()
        raise PortTypeError(
            f"{name}:{port.get_name()} carries {type(value).__name__}, "
            f"expected {kind.__name__}.",
            code="PNT-CYCLE-010",
        )
    return value


def DeclareInputs(system: LeafSystem, ports: Ports) -> dict[str, InputPort]:
    """Declares input ports on a system, in order, and returns them by name."""
    return {
        name: system.DeclareVectorInputPort(name, kind)
        if isinstance(kind, int)
        else system.DeclareAbstractInputPort(name, Value(kind))
        for name, kind in ports.items()
    }


def CheckPorts(
    owner: str, system: System, inputs: Ports, outputs: Ports, *, ignored: str = "\n"
) -> None:
    """Checks that a system has exactly the given ports.

    Args:
        owner: What the system is to be, for the message.
        system: The system.
        inputs: Its input ports.
        outputs: Its output ports.
        ignored: Outputs whose names begin so may be there as well.

    Raises:
        PortTypeError: A port is missing, unknown or of another kind, size or type; the
            message lists all of them and what is expected.
    """
    expected = {
        (side, name): _kind_name(example)
        for side, ports in (("input", inputs), ("output", outputs))
        for name, example in ports.items()
    }
    found = {
        key: kind
        for key, kind in _PortKinds(system).items()
        if key[0] == "input" or not key[1].startswith(ignored)
    }
    problems = [f"no {side} {name}" for side, name in expected.keys() - found.keys()]
    problems += [f"unknown {side} {name}" for side, name in found.keys() - expected]
    problems += [
        f"{key[0]} {key[1]} is {found[key]}, not {expected[key]}"
        for key in expected.keys() & found.keys()
        if found[key] != expected[key]
    ]
    if problems:
        contract = ", ".join(f"{key[0]} {key[1]}: {expected[key]}" for key in expected)
        raise PortTypeError(
            f"{owner} {type(system).__name__}: {'; '.join(sorted(problems))}. "
            f"Expected {contract}.",
            code="PNT-CYCLE-012",
        )


def _PortKinds(system: System) -> dict[tuple[str, str], str]:
    """Returns what each port carries, by side and name."""
    ports = [system.get_input_port(i) for i in range(system.num_input_ports())]
    ports += [system.get_output_port(i) for i in range(system.num_output_ports())]
    kinds = {}
    for port in ports:
        side = "input" if isinstance(port, InputPort) else "output"
        if port.get_data_type() == PortDataType.kVectorValued:
            kind = _kind_name(port.size())
        elif side == "input":
            kind = _kind_name(system.AllocateInputAbstract(port).get_value())
        else:
            kind = _kind_name(port.Allocate().get_value())
        kinds[side, port.get_name()] = kind
    return kinds


def _kind_name(example: Any) -> str:
    """Names a vector by its size, another value by its type."""
    if isinstance(example, int):
        return f"a vector of {example}"
    kind = type(example)
    return f"{kind.__module__}.{kind.__name__}"
