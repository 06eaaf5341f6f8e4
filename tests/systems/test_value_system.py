"""A system whose state is one value: its outputs follow the state alone."""

from dataclasses import dataclass

import numpy as np
from pydrake.systems.analysis import Simulator

from painter.systems.value_system import ValueSystem
from perception.ground import FrozenValue


@dataclass(frozen=True, eq=False)
class Count(FrozenValue):
    """How often the system was updated."""

    number: int = 0


class Counter(ValueSystem):
    """Counts its updates, one a second from t = 0 on."""

    def __init__(self):
        super().__init__()
        self.DeclareValue(Count(5))
        self.DeclareValueOutput("count", lambda count: count)
        self.DeclareValueVector("twice", 2, lambda count: 2 * [count.number])
        self.DeclarePeriodicUnrestrictedUpdateEvent(1.0, 0.0, self._Update)

    def _Update(self, context, state):
        count = self.GetValue(context)
        return self.SetValue(state, count.replace(number=count.number + 1))


def test_outputs_follow_the_state():
    dut = Counter()
    simulator = Simulator(dut)
    context = simulator.get_context()
    found = []
    for time in (0.5, 1.5, 2.5):
        simulator.AdvanceTo(time)
        found.append(dut.GetOutputPort("count").Eval(context).number)
        twice = dut.GetOutputPort("twice").Eval(context)
        np.testing.assert_array_equal(twice, [found[-1], found[-1]])
    assert found == [6, 7, 8]  # Updates at 0, 1 and 2 s.


def test_two_contexts_hold_states_of_their_own():
    dut = Counter()
    first, second = dut.CreateDefaultContext(), Simulator(dut)
    second.AdvanceTo(0.5)
    assert dut.GetOutputPort("count").Eval(first).number == 5
    assert dut.GetOutputPort("count").Eval(second.get_context()).number == 6
    # The example from which Drake makes the port's value.
    assert isinstance(dut.GetOutputPort("count").Allocate().get_value(), Count)
