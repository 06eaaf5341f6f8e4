"""The common clock of bus, drives, camera and diagram in a run."""

import time
from dataclasses import dataclass


@dataclass(frozen=True)
class TimeBase:
    """The machine's monotonic clock, or the same at a lower rate.

    On a robot the rate is 1. A rehearsal on a computer that is too slow for drives,
    world and brain at once may run at a lower rate: all of them get more time, and the
    bus still runs at 200 Hz of this clock.

    Attributes:
        rate: Seconds of this clock per second of the machine's.
    """

    rate: float = 1.0

    def __post_init__(self) -> None:
        if not 0.0 < self.rate <= 1.0:
            raise ValueError(f"rate must be > 0 and <= 1, got {self.rate!r}.")

    def now(self) -> float:
        """Returns the time, s; the same in all processes of a machine."""
        return self.rate * time.monotonic()

    def machine(self, duration: float) -> float:
        """Returns the machine time of a duration of this clock, s."""
        return duration / self.rate

    def sleep(self, duration: float) -> None:
        """Waits for a duration of this clock, s; returns at once if it is negative."""
        if duration > 0.0:
            time.sleep(self.machine(duration))
