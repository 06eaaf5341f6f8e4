"""Real-time loop: due times on the monotonic clock, lateness, priorities."""

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
# The loop wakes up this long before a tick, s: it reads what was received, then spins
# on the clock. It must cover waking up (0.05 to 0.15 ms) and reading (0.1 to 0.2 ms);
# at 200 Hz it costs up to 10 % of a core.
LEAD = 0.0005
# Source: Linux, include/uapi/linux/mman.h and prctl.h.
_MCL_CURRENT_AND_FUTURE = 3
_PR_SET_TIMERSLACK = 29
# Source: Linux, Documentation/power/pm_qos_interface.rst: an int32 of microseconds that
# holds while the file is open.
WAKE_UP_LATENCY = "/dev/cpu_dma_latency"
_KEPT = 12_000  # A minute at 200 Hz; sorting them takes less than a cycle.


@dataclass(frozen=True)
class Lateness:
    """How late cycles began, s by the machine's clock, in the last minute.

    Attributes:
        count: Cycles since the loop began.
        p50: Median.
        p99: 99th percentile.
        p999: 99.9th percentile.
        worst: Maximum.
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
        Whether it is; if not, logs a warning.
    """
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except (AttributeError, OSError) as error:
        _LOGGER.warning(
            "no SCHED_FIFO (%s): cycles may be 5 ms late on a busy machine.",
            error,
        )
        return False
    return True


@contextmanager
def stay_awake() -> Iterator[bool]:
    """Keeps idle processors out of sleep states that take long to wake up from.

    These are the C-states of a robot's computer; in a virtual machine, the halt after
    which the host gives the core away.

    Yields:
        Whether that is allowed; if not, it is logged.
    """
    try:
        file = os.open(WAKE_UP_LATENCY, os.O_WRONLY)
    except OSError as error:
        _LOGGER.info("idle processors may sleep: %s", error)
        yield False
        return
    try:
        os.write(file, (0).to_bytes(4, "little"))
        yield True
    finally:
        os.close(file)


def set_niceness(niceness: int) -> None:
    """Raises the priority of this process and its children, where allowed.

    Args:
        niceness: -20 to -1.
    """
    try:
        os.setpriority(os.PRIO_PROCESS, 0, niceness)
    except OSError as error:
        _LOGGER.info("no niceness of %d: %s", niceness, error)


class Ticker:
    """Due times, one a period; missed ones are counted and skipped, never caught up.

    Attributes:
        period: Time between two ticks, s.
        due: When the next tick is due, s.
        overruns: Ticks skipped so far.
    """

    def __init__(self, period: float, clock: TimeBase | None = None) -> None:
        """Creates a ticker whose first tick is due one period from now.

        Args:
            period: Time between two ticks, s.
            clock: Of the run; None = the machine's.
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
        """Machine time until `LEAD` before the next tick, s; not negative."""
        return max(0.0, self._clock.machine(self.due - self._clock.now()) - LEAD)

    def tick(self) -> tuple[float, int]:
        """Takes the next tick, which is due now or within `LEAD`.

        Returns:
            When it is due, s, and how many ticks before it were missed.
        """
        late = self._clock.now() - self.due
        skipped = int(late // self.period) if late > 0.0 else 0
        self.overruns += skipped
        due = self.due + skipped * self.period
        self.due = due + self.period
        return due, skipped

    def wait_until_due(self) -> None:
        """Spins until the taken tick is due, and records the lateness."""
        due = self.due - self.period
        while (late := self._clock.now() - due) < 0.0:
            pass
        self._late[self._count % _KEPT] = self._clock.machine(late)
        self._count += 1

    def lateness(self) -> Lateness:
        """Returns the lateness of the last ticks."""
        late = self._late[: max(1, min(self._count, _KEPT))]
        p50, p99, p999 = (float(p) for p in np.percentile(late, (50, 99, 99.9)))
        return Lateness(self._count, p50, p99, p999, float(late.max()))


def freeze_gc() -> None:
    """Excludes all present objects from garbage collection, which took 20 ms."""
    gc.collect()
    gc.freeze()


def lock_memory() -> bool:
    """Locks the pages of this process and sets its timer slack to 1 ns, where allowed.

    Only for a process of its own: locks all present and future pages.

    Returns:
        Whether the pages are locked; if not, it is logged.
    """
    libc = ctypes.CDLL(None, use_errno=True)
    libc.prctl(_PR_SET_TIMERSLACK, 1, 0, 0, 0)
    if libc.mlockall(_MCL_CURRENT_AND_FUTURE) == 0:
        return True
    _LOGGER.info("memory is not locked: %s", os.strerror(ctypes.get_errno()))
    return False
