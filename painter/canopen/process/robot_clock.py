"""Time of the diagram against the clock of the bus."""

import math
from typing import Protocol

from painter.canopen.master.setpoints import Setpoint
from painter.canopen.process.bus_process import Report
from painter.canopen.process.sample_ring import Samples


class Bus(Protocol):
    """The diagram's interface to the bus, in another process or in simulated time."""

    def start(self) -> None:
        """Commands bring-up; the report shows its progress."""

    def push(self, points: list[Setpoint]) -> None:
        """Sends setpoints; raises BusError if the bus has ended."""

    def stop(self, reason: str) -> None:
        """Commands a controlled stop; the gun closes at once."""

    def report(self) -> Report | None:
        """Returns the newest report; raises BusError if the bus has ended."""

    def samples(self, since: float) -> Samples:
        """Returns samples after a time, s on the clock of the bus."""

    def now(self) -> float:
        """Returns the clock of the bus, s."""

    def wait_until(self, when: float) -> None:
        """Waits until a time, s, of the clock of the bus."""

    def close(self) -> None:
        """Switches the arm off."""


class RobotClock:
    """Maps the diagram's time to the clock of the bus, which drives all else.

    Both run at the same rate. The diagram runs slightly late, so that the measurements
    of its present have already arrived; its commands are executed slightly later, so
    that a computation that delays the diagram does not delay the arm. While the arm is
    at rest the diagram's clock may be stopped: a segmentation of two seconds then takes
    no motion time.

    Attributes:
        lag: Delay of the diagram behind the clock, s, when nothing delays it further.
        ahead: From a command's time in the diagram to its execution, s.
    """

    def __init__(self, *, lag: float = 0.02, ahead: float = 0.3) -> None:
        """Creates a clock that has not started.

        Args:
            lag: See the class, s.
            ahead: See the class, s.

        Raises:
            ValueError: `ahead` is not above `lag`, or not below 1 s.
        """
        if not 0.0 < lag < ahead < 1.0:
            raise ValueError(
                "lag must be > 0 s and ahead above it and below 1 s, "
                f"got {lag!r} and {ahead!r}."
            )
        self.lag, self.ahead = lag, ahead
        self._offsets = [(0.0, 0.0)]

    @property
    def stops(self) -> list[tuple[float, float]]:
        """Times of the diagram, s, and the bus clock's offset from then on, s."""
        return list(self._offsets)

    def start(self, now: float) -> None:
        """Starts the diagram's time at `now`, s on the clock of the bus."""
        self._offsets = [(0.0, now)]

    def bus_time(self, time: float) -> float:
        """Returns the clock of the bus, s, at the diagram's present time, s."""
        return time + self._offsets[-1][1]

    def diagram_time(self, bus_time: float) -> float:
        """Returns the diagram's time, s, at a time on the clock of the bus, s.

        All times at which the diagram's clock was stopped map to one time.
        """
        after = math.inf
        for start, offset in reversed(self._offsets):
            if bus_time - offset >= start:
                break
            after = start
        return min(bus_time - offset, after)

    def picture_time(self, bus_time: float) -> float:
        """Returns `diagram_time`, s; NaN if that clock was stopped then.

        The arm still executed commands then, so the diagram has no pose for it.
        """
        time = self.diagram_time(bus_time)
        offsets = (offset for start, offset in reversed(self._offsets) if start <= time)
        return (
            time if any(abs(time + o - bus_time) < 1e-6 for o in offsets) else math.nan
        )

    def due(self, time: float) -> float:
        """Returns when the diagram may reach a time, s; s by the bus's clock."""
        return self.bus_time(time) + self.lag

    def execution(self, time: float) -> float:
        """Returns when a command of a time, s, is executed, s by the bus's clock."""
        return self.bus_time(time) + self.ahead

    def hold(self, time: float, now: float) -> float:
        """Stops the diagram's clock for the time by which it is behind; returns it, s.

        Args:
            time: Of the diagram, s.
            now: By the clock of the bus, s.
        """
        behind = now - self.due(time)
        if behind > 0.0:
            self._offsets.append((time, self._offsets[-1][1] + behind))
        return max(behind, 0.0)
