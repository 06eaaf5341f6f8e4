"""A simulated CiA 401 node: gun valve and flow, e-stop chain, pump pressure.

Source: CiA 401-1 v3.1.0, objects 6000h, 6200h, 6206h, 6207h, 6401h, 6411h, 6443h,
6444h.
"""

from painter.canopen.config.standard_objects import standard_io
from painter.canopen.sim.node import SimNode
from painter.canopen.sim.wire import Wire


class SimIo(SimNode):
    """Eight digital inputs and outputs, one analogue each.

    Attributes:
        history: (time s, outputs 6200h:1) at each change of the digital outputs.
        inputs: Digital inputs, 6000h:1.
        pressure: Analogue input, 6401h:1, counts.
    """

    def __init__(self, node_id: int, wire: Wire) -> None:
        """Creates the node with the e-stop chain closed and a pump at 100 counts."""
        super().__init__(node_id, standard_io(), wire)
        self.history: list[tuple[float, int]] = []
        self.inputs = 0xFF
        self.pressure = 100

    @property
    def outputs(self) -> int:
        """Digital outputs."""
        return self.store.number(0x6200, 1)

    @property
    def flow(self) -> int:
        """Analogue output."""
        return self.store.number(0x6411, 1)

    def refresh(self) -> None:
        """Copies the inputs to the store."""
        self.store.set(0x6000, 1, self.inputs)
        self.store.set(0x6401, 1, self.pressure)

    def on_reset(self) -> None:
        """Outputs are off after power-on."""
        self._note()

    def on_write(self, index: int, sub: int, value: object) -> None:
        """Records changes of the outputs."""
        self._note()

    def on_connection_lost(self) -> None:
        """Sets outputs to their error values if the error mode is on."""
        mode, safe = self.store.number(0x6206, 1), self.store.number(0x6207, 1)
        self.store.set(0x6200, 1, self.outputs & ~mode | safe & mode)
        if self.store.number(0x6443, 1) == 1:
            self.store.set(0x6411, 1, self.store.number(0x6444, 1))
        self._note()

    def _note(self) -> None:
        if not self.history or self.history[-1][1] != self.outputs:
            self.history.append((self.now, self.outputs))
