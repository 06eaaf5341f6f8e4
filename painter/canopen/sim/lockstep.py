"""Master and simulated drives in one thread and in simulated time; a `Bus`.

Time advances only in `wait_until`. So a whole cycle over CAN frames, and every fault in
it, repeats exactly.
"""

from collections import deque

import numpy as np

from painter.canopen.master.arm_bus import ArmBus
from painter.canopen.master.feedback import BusState
from painter.canopen.master.setpoints import Setpoint
from painter.canopen.process.bus_process import Report
from painter.canopen.process.sample_ring import Samples
from painter.canopen.sim.rack import STEP, Rack
from painter.errors import BusError
from perception.ground import FloatArray

_KEPT = 2048
_SWITCH_OFF_TIME = 5.0


class LockstepBus:
    """A master that is stepped together with its drives.

    Attributes:
        rack: The drives.
        master: The master; None once it was killed.
    """

    def __init__(self, rack: Rack) -> None:
        """Connects a master to the wire of a rack."""
        self.rack = rack
        self._bus = rack.bus
        self.master: ArmBus | None = ArmBus(rack.bus, rack.transport)
        self.master.measured = self._note
        self._steps = 0
        self._per_cycle = round(rack.bus.cycle / STEP)
        self._rows: deque[FloatArray] = deque(maxlen=_KEPT)

    def start(self) -> None:
        """Begins bring-up."""
        self._alive().start()

    def push(self, points: list[Setpoint]) -> None:
        """Hands setpoints to the master."""
        self._alive().push(points)

    def stop(self, reason: str) -> None:
        """Stops the arm."""
        self._alive().stop(reason)

    def acknowledge(self) -> None:
        """Begins again after a stop."""
        self._alive().acknowledge()

    def report(self) -> Report:
        """Returns the master's report."""
        return Report(self._alive().feedback())

    def samples(self, since: float) -> Samples:
        """Returns the samples after a time, s."""
        return Samples.after(np.array(self._rows).reshape(-1, 12), since)

    def now(self) -> float:
        """Returns the simulated time, s."""
        return self._steps * STEP

    def wait_until(self, when: float) -> None:
        """Advances time to `when`, s."""
        while self._steps * STEP < when - 1e-9:
            self._step()

    def kill(self) -> None:
        """Ends the master as killing its process would: nothing steps it any more."""
        self.master = None

    def close(self) -> None:
        """Switches the arm off."""
        if self.master is None:
            return
        self.master.shut_down()
        end = self.now() + _SWITCH_OFF_TIME
        while self.master.state != BusState.DOWN and self.now() < end:
            self._step()

    def _step(self) -> None:
        now = self.now()
        if self.master is not None:
            if self._steps % self._per_cycle == 0:
                self.master.cycle(now)
            else:
                self.master.poll(now)
        self._steps += 1
        self.rack.advance(self.now())

    def _alive(self) -> ArmBus:
        if self.master is None:
            raise BusError("the bus process has ended: killed.", code="PNT-BUS-022")
        return self.master

    def _note(self, time: float, q: FloatArray, v: FloatArray, trigger: float) -> None:
        self._rows.append(np.concatenate([[time], q, v, [trigger]]))
