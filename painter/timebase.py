"""The clock that bus, drives, camera and diagram of one run share."""

import time
from dataclasses import dataclass


@dataclass(frozen=True)
class TimeBase:
    """The machine's monotonic clock, or the same at a lower rate.

    On a robot the rate is 1. A rehearsal on a computer that is too small for drives,
    world and brain at once may give all of them more time by a lower one: the bus still
    runs at 200 Hz of this clock, and nothing but the computer is faster.

    Attributes:
        rate: Seconds of this clock in a second of the machine's.
    """

    rate: float = 1.0

    def __post_init__(self) -> None:
        if not 0.0 < self.rate <= 1.0:
            raise ValueError(f"rate must be > 0 and <= 1, got {self.rate!r}.")

    def now(self) -> float:
        """Returns the time, s; equal in all processes of a machine."""
        return self.rate * time.monotonic()

    def machine(self, duration: float) -> float:
        """Returns how long the machine takes for a duration of this clock, s."""
        return duration / self.rate

    def sleep(self, duration: float) -> None:
        """Waits for a duration of this clock, s; not at all if it is negative."""
        if duration > 0.0:
            time.sleep(self.machine(duration))
