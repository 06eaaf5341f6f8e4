"""The master's view of the I/O node: the gun, the e-stop chain, the pump."""

import math
from collections.abc import Callable

from painter.canopen.config.bus_config import BusConfig
from painter.canopen.config.standard_objects import standard_io
from painter.canopen.master.node_client import NodeClient
from painter.canopen.master.od_config import plan_io
from painter.canopen.protocol.frames import RPDO_BASES, TPDO_BASES, Frame


class IoClient(NodeClient):
    """The I/O node as the master sees it.

    Attributes:
        trigger: Commanded share of nominal flow, 0 to 1; 0 closes the valve.
        inputs: Last digital inputs; None before the first.
        pressure: Last pump pressure, Pa.
        repeat_at: When the outputs are sent again, s.
    """

    def __init__(self, bus: BusConfig, send: Callable[[Frame], None]) -> None:
        """Creates the client of the bus file's I/O node."""
        super().__init__(
            "io",
            bus.io.node_id,
            send,
            identity=bus.io.identity,
            timeouts=bus.timeouts,
            plan=plan_io(bus, standard_io()),
            profile=401,
        )
        self._config = bus.io
        self._half_cycle = bus.cycle / 2.0
        self.repeat_at = math.inf
        self.trigger = 0.0
        self.inputs: int | None = None
        self.pressure = 0.0

    @property
    def is_chain_closed(self) -> bool:
        """Whether the e-stop chain is closed; False before the first TPDO."""
        return bool((self.inputs or 0) >> self._config.estop_bit & 1)

    def take_process_data(self, kind: int, data: bytes) -> bool:
        """Takes TPDO1 (6000h:1, 6401h:1)."""
        if kind != TPDO_BASES[0] or len(data) != 3:
            return False
        self.inputs = data[0]
        counts = int.from_bytes(data[1:3], "little", signed=True)
        self.pressure = counts * self._config.pressure_scale
        self.got_tpdo = True
        return True

    def poll(self, now: float) -> None:
        """Sets the clock; repeats the outputs half a cycle after they were sent."""
        super().poll(now)
        if now >= self.repeat_at:
            self.repeat_at = math.inf
            self._send(self.rpdo())

    def send_outputs(self) -> None:
        """Sends valve and flow now, and again half a cycle later.

        The node closes the gun by itself when it receives nothing for a cycle. With one
        frame a cycle, a frame that is slightly late would trip that deadline.
        """
        if self.is_configured:
            self._send(self.rpdo())
            self.repeat_at = self.now + self._half_cycle

    def rpdo(self) -> Frame:
        """Returns the frame with valve and flow."""
        valve = (1 << self._config.valve_bit) if self.trigger > 0.0 else 0
        flow = round(self.trigger * self._config.flow_full_scale)
        data = bytes([valve]) + flow.to_bytes(2, "little", signed=True)
        return Frame(RPDO_BASES[0] + self.node_id, data)

    def stop_reason(self) -> str | None:
        """Returns why the inputs must stop the arm, or None."""
        if not self.is_chain_closed:
            return "e-stop: the chain is open."
        if self.trigger > 0.0 and self.pressure < self._config.pressure_low:
            return (
                f"io: pump pressure is {self.pressure:g} Pa, must be >= "
                f"{self._config.pressure_low:g} Pa."
            )
        return None
