"""Typed reading of abstract ports."""

from typing import TypeVar

from pydrake.systems.framework import Context, InputPort, OutputPort

from painter.errors import PortTypeError

T = TypeVar("T")


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
