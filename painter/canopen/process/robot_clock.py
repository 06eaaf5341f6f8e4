"""The diagram's time and the bus's clock."""

import math
from typing import Protocol

from painter.canopen.master.setpoints import Setpoint
from painter.canopen.process.bus_process import Report
from painter.canopen.process.sample_ring import Samples


class Bus(Protocol):
    """The bus as the diagram sees it: in another process, or in simulated time."""

    def start(self) -> None:
        """Asks for bring-up; the report tells how it goes."""

    def push(self, points: list[Setpoint]) -> None:
        """Sends setpoints; raises BusError if nobody takes them any more."""

    def stop(self, reason: str) -> None:
        """Asks for a controlled stop; the gun closes at once."""

    def report(self) -> Report | None:
        """Returns the newest report; raises BusError if the bus has ended."""

    def samples(self, since: float) -> Samples:
        """Returns what was measured after a time, s on the bus's clock."""

    def now(self) -> float:
        """Returns the bus's clock, s."""

    def wait_until(self, when: float) -> None:
        """Waits for a time, s, of the bus's clock."""

    def close(self) -> None:
        """Switches the arm off."""


class RobotClock:
    """Maps the diagram's time to the bus's clock, on which everything else runs.

    Both run at the same rate. The diagram is a little late on purpose, so that what was
    measured at its present is there already; and its commands are carried out a little
    later, so that no computation, which holds the diagram up, holds up the arm. While
    the arm stands the diagram's clock may be stopped: a segmentation of two seconds
    takes none of the robot's time.

    Attributes:
        lag: By how much the diagram is behind the clock when nothing holds it up, s.
        ahead: From a command's time in the diagram to its execution, s.
    """

    def __init__(self, *, lag: float = 0.02, ahead: float = 0.3) -> None:
        """Creates a clock that does not run yet.

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
        """Times of the diagram, s, and the bus's clock less the diagram's from then."""
        return list(self._offsets)

    def start(self, now: float) -> None:
        """Lets the diagram's time 0 be now, s on the bus's clock."""
        self._offsets = [(0.0, now)]

    def bus_time(self, time: float) -> float:
        """Returns the bus's clock, s, at a time, s, of the diagram's present."""
        return time + self._offsets[-1][1]

    def diagram_time(self, bus_time: float) -> float:
        """Returns the diagram's time, s, of a moment on the bus's clock, s.

        All moments at which the diagram's clock stood still are one time of it.
        """
        after = math.inf
        for start, offset in reversed(self._offsets):
            if bus_time - offset >= start:
                break
            after = start
        return min(bus_time - offset, after)

    def picture_time(self, bus_time: float) -> float:
        """Returns `diagram_time`, s; NaN for a moment at which that clock stood still.

        The arm still carried out commands then: it was nowhere that the diagram knows.
        """
        time = self.diagram_time(bus_time)
        offsets = (offset for start, offset in reversed(self._offsets) if start <= time)
        return (
            time if any(abs(time + o - bus_time) < 1e-6 for o in offsets) else math.nan
        )

    def due(self, time: float) -> float:
        """Returns when the diagram may come to a time, s, on the bus's clock, s."""
        return self.bus_time(time) + self.lag

    def execution(self, time: float) -> float:
        """Returns when a command of a time, s, is carried out, s, by the bus's."""
        return self.bus_time(time) + self.ahead

    def hold(self, time: float, now: float) -> float:
        """Stops the diagram's clock for as long as it is behind; returns that, s.

        Args:
            time: Of the diagram, s.
            now: On the bus's clock, s.
        """
        behind = now - self.due(time)
        if behind > 0.0:
            self._offsets.append((time, self._offsets[-1][1] + behind))
        return max(behind, 0.0)
