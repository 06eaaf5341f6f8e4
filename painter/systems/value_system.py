"""Base of the systems whose state is one frozen value."""

from collections.abc import Callable
from typing import Any

from pydrake.common.value import Value
from pydrake.systems.framework import (
    BasicVector,
    Context,
    EventStatus,
    LeafSystem,
    State,
)


class ValueSystem(LeafSystem):
    """A system whose state is one frozen value, replaced as a whole.

    .. pydrake_system::

        name: ValueSystem
        input_ports:
        - (the subclass's own)
        output_ports:
        - (the subclass's own)

    Ports:
        None of its own.
    """

    def DeclareValue(self, initial: Any) -> None:
        """Declares the state; to be called once, before its outputs are declared."""
        self._initial = initial
        self._value_index = self.DeclareAbstractState(Value(initial))
        self.value_tickets = {self.abstract_state_ticket(self._value_index)}

    def GetValue(self, context: Context) -> Any:
        """Returns the present state."""
        return context.get_abstract_state(int(self._value_index)).get_value()

    def SetValue(self, state: State, value: Any) -> EventStatus:
        """Replaces the state in an update event."""
        state.get_mutable_abstract_state(int(self._value_index)).set_value(value)
        return EventStatus.Succeeded()

    def DeclareValueOutput(self, name: str, of: Callable[[Any], Any]) -> None:
        """Declares an abstract output port that is a function of the state alone."""

        def calc(context: Context, output: Value) -> None:
            output.set_value(of(self.GetValue(context)))

        self.DeclareAbstractOutputPort(
            name, lambda: Value(of(self._initial)), calc, self.value_tickets
        )

    def DeclareValueVector(
        self, name: str, size: int, of: Callable[[Any], Any]
    ) -> None:
        """Declares a vector output port, (size,), of the state alone."""

        def calc(context: Context, output: BasicVector) -> None:
            output.SetFromVector(of(self.GetValue(context)))

        self.DeclareVectorOutputPort(name, size, calc, self.value_tickets)
