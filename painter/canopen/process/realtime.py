"""A loop with due times on the monotonic clock, and how late it was."""

import ctypes
import gc
import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from painter.timebase import TimeBase

_LOGGER = logging.getLogger(__name__)
_PRIORITY = 60
# The loop is awake so long before a tick: what has come is read, then the clock is
# watched. It must cover waking up (0.05 to 0.15 ms) and the reading (0.1 to 0.2 ms);
# at 200 Hz it costs up to 10 % of a core.
LEAD = 0.0005
# Source: Linux, include/uapi/linux/mman.h and prctl.h.
_MCL_CURRENT_AND_FUTURE = 3
_PR_SET_TIMERSLACK = 29
# Source: Linux, Documentation/power/pm_qos_interface.rst: an int32 of microseconds,
# which counts for as long as the file is open.
_WAKE_UP_LATENCY = "/dev/cpu_dma_latency"
_KEPT = 12_000  # A minute at 200 Hz; sorting them takes less than a cycle.


@dataclass(frozen=True)
class Lateness:
    """How late cycles began, s by the machine's clock.

    Attributes:
        count: Cycles since the loop began; the rest is of the last minute.
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


@contextmanager
def stay_awake() -> Iterator[bool]:
    """Keeps idle processors from sleeping so deep that they wake up late.

    On a robot's computer that is its C-states, in a virtual machine the halt after
    which the host gives a core to others.

    Yields:
        Whether they are kept awake; if not, it is logged.
    """
    try:
        file = os.open(_WAKE_UP_LATENCY, os.O_WRONLY)
    except OSError as error:
        _LOGGER.info("processors may sleep: %s", error)
        yield False
        return
    try:
        os.write(file, (0).to_bytes(4, "little"))
        yield True
    finally:
        os.close(file)


def set_niceness(niceness: int) -> None:
    """Puts this process, and those it starts, before others; where allowed.

    Args:
        niceness: -20 to -1.
    """
    try:
        os.setpriority(os.PRIO_PROCESS, 0, niceness)
    except OSError as error:
        _LOGGER.info("no niceness of %d: %s", niceness, error)


class Ticker:
    """Due times, one a period; late ones are counted and skipped, never caught up."""

    def __init__(self, period: float, clock: TimeBase | None = None) -> None:
        """Creates a ticker whose first tick is due one period from now.

        Args:
            period: Time between two ticks, s.
            clock: Counts it; None = the machine's.
        """
        self.period = period
        self._clock = clock or TimeBase()
        self.overruns = 0
        self.begin()
        self._late = np.zeros(_KEPT)
        self._count = 0

    def begin(self) -> None:
        """Makes the next tick due one period from now."""
        self.due = self._clock.now() + self.period

    def remaining(self) -> float:
        """Time of the machine until `LEAD` before the next tick, s; not negative."""
        return max(0.0, self._clock.machine(self.due - self._clock.now()) - LEAD)

    def tick(self) -> tuple[float, int]:
        """Ends the wait for a tick that is due at once or in `LEAD`.

        Returns:
            When it was due, s, and how many ticks were skipped before it because their
            time had passed too.
        """
        late = self._clock.now() - self.due
        skipped = int(late // self.period) if late > 0.0 else 0
        self.overruns += skipped
        due = self.due + skipped * self.period
        self.due = due + self.period
        return due, skipped

    def wait_until_due(self) -> None:
        """Watches the clock until the last tick is due, and notes how late that is."""
        due = self.due - self.period
        while (late := self._clock.now() - due) < 0.0:
            pass
        self._late[self._count % _KEPT] = self._clock.machine(late)
        self._count += 1

    def lateness(self) -> Lateness:
        """Returns how late the last ticks were."""
        late = self._late[: max(1, min(self._count, _KEPT))]
        p50, p99, p999 = (float(p) for p in np.percentile(late, (50, 99, 99.9)))
        return Lateness(self._count, p50, p99, p999, float(late.max()))


def freeze_gc() -> None:
    """Leaves what was imported out of garbage collection, which takes 20 ms."""
    gc.collect()
    gc.freeze()


def lock_memory() -> bool:
    """Keeps this process's pages in memory and its timers sharp, where allowed.

    For a process of its own: all that it has and will have is locked.

    Returns:
        Whether the pages are locked; if not, it is logged.
    """
    libc = ctypes.CDLL(None, use_errno=True)
    libc.prctl(_PR_SET_TIMERSLACK, 1, 0, 0, 0)
    if libc.mlockall(_MCL_CURRENT_AND_FUTURE) == 0:
        return True
    _LOGGER.info("memory is not locked: %s", os.strerror(ctypes.get_errno()))
    return False
