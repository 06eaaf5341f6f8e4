"""What the bus measured over a cycle, in the robot's time."""

import numpy as np

from painter.canopen.process.robot_clock import Bus, RobotClock
from painter.canopen.process.sample_ring import Samples
from perception.ground import FloatArray


class Recorder:
    """Collects the bus's samples while a cycle runs."""

    def __init__(self, bus: Bus) -> None:
        """Starts with what is measured from now on."""
        self._bus = bus
        self._parts: list[Samples] = []
        self.last = bus.now()
        """Time of the last sample, s on the bus's clock."""

    def take(self) -> None:
        """Takes the new samples."""
        new = self._bus.samples(self.last)
        if new.time.size:
            self._parts.append(new)
            self.last = float(new.time[-1])

    def samples(self) -> Samples:
        """Returns all samples."""
        parts = self._parts or [self._bus.samples(self.last)]
        return Samples(
            time=np.concatenate([part.time for part in parts]),
            q=np.concatenate([part.q for part in parts]),
            v=np.concatenate([part.v for part in parts]),
            trigger=np.concatenate([part.trigger for part in parts]),
        )


def robot_times(bus_times: FloatArray, clock: RobotClock) -> FloatArray:
    """Returns the robot's times, s, of times on the bus's clock.

    Args:
        bus_times: (n,) s, increasing.
        clock: Of the cycle.

    Returns:
        (n,) s; NaN while the robot's clock stood still, and before it ran.
    """
    times = np.full(bus_times.shape, np.nan)
    starts = np.array([start for start, _ in clock.stops])
    for k, (start, offset) in enumerate(clock.stops):
        end = starts[k + 1] if k + 1 < starts.size else np.inf
        here = bus_times - offset
        inside = (here >= start) & (here < end)
        times[inside] = here[inside]
    return times


def executions(times: FloatArray, clock: RobotClock) -> FloatArray:
    """Returns when commands of the diagram's times (n,), s, are executed, s."""
    starts, offsets = np.array(clock.stops).T
    index = np.searchsorted(starts, times, side="right") - 1
    return times + offsets[np.maximum(index, 0)] + clock.ahead
