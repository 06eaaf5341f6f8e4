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
            message lists them and all that are expected.
    """
    expected = {
        f"{side} {name}": _kind_name(example)
        for side, ports in (("input", inputs), ("output", outputs))
        for name, example in ports.items()
    }
    found = {
        port: kind
        for port, kind in _PortKinds(system).items()
        if not port.startswith(f"output {ignored}")
    }
    if found != expected:
        lacking, excess = (
            ", ".join(f"{port} ({kind})" for port, kind in sorted(items)) or "none"
            for items in (
                expected.items() - found.items(),
                found.items() - expected.items(),
            )
        )
        contract = ", ".join(f"{port} ({kind})" for port, kind in expected.items())
        raise PortTypeError(
            f"{owner} {type(system).__name__}: missing ports: {lacking}; wrong ports: "
            f"{excess}. Expected are {contract}.",
            code="PNT-CYCLE-012",
        )


def _PortKinds(system: System) -> dict[str, str]:
    """Returns what each port carries, by "input NAME" or "output NAME"."""
    ports = [system.get_input_port(i) for i in range(system.num_input_ports())]
    ports += [system.get_output_port(i) for i in range(system.num_output_ports())]
    kinds = {}
    for port in ports:
        is_input = isinstance(port, InputPort)
        if port.get_data_type() == PortDataType.kVectorValued:
            example: Any = port.size()
        elif is_input:
            example = system.AllocateInputAbstract(port).get_value()
        else:
            example = port.Allocate().get_value()
        side = "input" if is_input else "output"
        kinds[f"{side} {port.get_name()}"] = _kind_name(example)
    return kinds


def _kind_name(example: Any) -> str:
    """Names a vector by its size, another value by its type."""
    if isinstance(example, int):
        return f"vector of {example}"
    return f"{type(example).__module__}.{type(example).__name__}"
