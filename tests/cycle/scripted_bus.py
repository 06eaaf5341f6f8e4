"""A bus whose feedback a test writes down: no drives, no process."""

import numpy as np

from painter.canopen.config.units import AXES
from painter.canopen.master.feedback import (
    AxisStatus,
    BusState,
    Feedback,
    Statistics,
)
from painter.canopen.process.bus_process import Report
from painter.canopen.process.sample_ring import Samples

CYCLE = 0.005


def feedback(time=0.0, **changes) -> Feedback:
    """Feedback of an enabled arm at rest, with changes."""
    values = {
        "bus_state": BusState.ENABLED,
        "reason": "",
        "stopped_at": 0.0,
        "q": np.zeros(5),
        "v": np.zeros(5),
        "q_commanded": np.zeros(5),
        "trigger": 0.0,
        "axes": tuple(
            AxisStatus(name, "OPERATION ENABLED", 0, 0.0, 0x27) for name in AXES
        ),
        "is_chain_closed": True,
        "pressure": 0.0,
        "buffered": 0,
        "statistics": Statistics(),
    }
    return Feedback(time=time, **(values | changes))


class ScriptedBus:
    """Reports `at(time)`; its clock starts at `begin` and moves in `wait_until`."""

    def __init__(self, at, *, begin=100.0, end=101.0, lateness=None, is_fifo=True):
        self.at = at
        self.begin, self.end = begin, end
        self._now = begin
        self._lateness, self._is_fifo = lateness, is_fifo

    def start(self) -> None:
        pass

    def push(self, points) -> None:
        pass

    def stop(self, reason) -> None:
        pass

    def close(self) -> None:
        pass

    def report(self) -> Report:
        return Report(
            self.at(self._now), lateness=self._lateness, is_fifo=self._is_fifo
        )

    def samples(self, since: float) -> Samples:
        first = max(0, int(np.floor((since - self.begin) / CYCLE + 1e-6)) + 1)
        last = int(np.floor((self._now - self.begin) / CYCLE + 1e-6))
        rows = [self.at(self.begin + k * CYCLE) for k in range(first, last + 1)]
        return Samples(
            time=np.array([row.time for row in rows]),
            q=np.array([row.q for row in rows]).reshape(-1, 5),
            v=np.array([row.v for row in rows]).reshape(-1, 5),
            trigger=np.array([row.trigger for row in rows]),
        )

    def now(self) -> float:
        return self._now

    def wait_until(self, when: float) -> None:
        self._now = max(self._now, when)
