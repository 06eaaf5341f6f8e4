"""A loop with due times on the monotonic clock, and how late it was."""

import logging
import os
import time
from collections import deque
from dataclasses import dataclass

import numpy as np

_LOGGER = logging.getLogger(__name__)
_PRIORITY = 60
_KEPT = 100_000


@dataclass(frozen=True)
class Lateness:
    """How late cycles began, s.

    Attributes:
        count: Cycles looked at.
        p50: Median.
        p99: 99th percentile.
        p999: 99.9th percentile.
        worst: Greatest.
    """

    count: int
    p50: float
    p99: float
    p999: float
    worst: float


def use_fifo(priority: int = _PRIORITY) -> bool:
    """Puts the calling thread under SCHED_FIFO, where allowed.

    Args:
        priority: 1 to 99.

    Returns:
        Whether it is; if not, a warning says so.
    """
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except (AttributeError, OSError) as error:
        _LOGGER.warning(
            "no SCHED_FIFO (%s): expect cycles that are 5 ms late on a busy machine.",
            error,
        )
        return False
    return True


class Ticker:
    """Due times, one a period; late ones are counted and skipped, never caught up."""

    def __init__(self, period: float) -> None:
        """Creates a ticker whose first tick is due one period from now.

        Args:
            period: Time between two ticks, s.
        """
        self.period = period
        self.due = time.monotonic() + period
        self.overruns = 0
        self._lateness: deque[float] = deque(maxlen=_KEPT)

    def remaining(self) -> float:
        """Time to the next tick, s; not negative."""
        return max(0.0, self.due - time.monotonic())

    def tick(self) -> tuple[float, int]:
        """Ends the wait for a tick that is due.

        Returns:
            When it was due, s, and how many ticks were skipped before it because their
            time had passed too.
        """
        late = time.monotonic() - self.due
        self._lateness.append(max(0.0, late))
        skipped = int(late // self.period) if late > 0.0 else 0
        self.overruns += skipped
        due = self.due + skipped * self.period
        self.due = due + self.period
        return due, skipped

    def lateness(self) -> Lateness:
        """Returns how late the last ticks were."""
        late = np.array(self._lateness or [0.0])
        p50, p99, p999 = (float(np.percentile(late, p)) for p in (50, 99, 99.9))
        return Lateness(len(self._lateness), p50, p99, p999, float(late.max()))
