"""The last seconds of measured joint states, shared by processes without locks.

One process writes a row each cycle, others read any stretch that is still held. A
reader that was delayed by a second still gets all states in between.
"""

from dataclasses import dataclass
from multiprocessing.shared_memory import SharedMemory

import numpy as np

from perception.ground import FloatArray

_WIDTH = 12  # Time, q (5), v (5), trigger.
_ROWS = 2048  # 10 s at 200 Hz.


@dataclass(frozen=True)
class Samples:
    """Joint states measured at some SYNCs.

    Attributes:
        time: (n,) s on the clock of the bus, when the SYNC was due; increasing.
        q: (n, 5) rad.
        v: (n, 5) rad/s.
        trigger: (n,) as commanded to the gun, 0 to 1.
    """

    time: FloatArray
    q: FloatArray
    v: FloatArray
    trigger: FloatArray

    @classmethod
    def after(cls, rows: FloatArray, time: float) -> "Samples":
        """Returns samples after a time, s, of rows (n, 12): time, q, v, trigger."""
        rows = rows[np.searchsorted(rows[:, 0], time, side="right") :]
        return cls(rows[:, 0], rows[:, 1:6], rows[:, 6:11], rows[:, 11])

    def at(self, time: float) -> tuple[FloatArray, FloatArray]:
        """Returns q and v at a time, s: linear between samples, constant beyond them.

        Raises:
            ValueError: There are no samples.
        """
        if not self.time.size:
            raise ValueError("there are no samples.")
        after = int(np.searchsorted(self.time, time, side="right"))
        if after == 0 or after == self.time.size:
            end = min(after, self.time.size - 1)
            return self.q[end], self.v[end]
        before = after - 1
        share = (time - self.time[before]) / (self.time[after] - self.time[before])
        q = self.q[before] + share * (self.q[after] - self.q[before])
        v = self.v[before] + share * (self.v[after] - self.v[before])
        return q, v


class SampleRing:
    """Rows in shared memory; one writer, any number of readers."""

    def __init__(self, *, name: str | None = None) -> None:
        """Creates a ring, or opens one by name."""
        self._is_owner = name is None
        size = 8 * (1 + _ROWS * _WIDTH)
        self._memory = SharedMemory(name=name, create=self._is_owner, size=size)
        self._count = np.ndarray((1,), np.int64, self._memory.buf)
        self._rows = np.ndarray((_ROWS, _WIDTH), np.float64, self._memory.buf, 8)
        if self._is_owner:
            self._count[0] = 0

    @property
    def name(self) -> str:
        """Name by which another process opens it."""
        return self._memory.name

    def put(self, time: float, q: FloatArray, v: FloatArray, trigger: float) -> None:
        """Adds a row in place of the oldest one."""
        count = int(self._count[0])
        self._rows[count % _ROWS] = np.concatenate([[time], q, v, [trigger]])
        self._count[0] = count + 1

    def since(self, time: float) -> Samples:
        """Returns the samples after a time, s, that are still held."""
        count = int(self._count[0])
        # Leaves out the row that may be written now, and one more.
        first = max(0, count - _ROWS + 2)
        while True:
            rows = self._rows[np.arange(first, count) % _ROWS]
            overrun = int(self._count[0]) - _ROWS + 2 - first
            if overrun <= 0:
                break
            first += overrun
        return Samples.after(rows, time)

    def close(self) -> None:
        """Closes the memory; the owner also removes it."""
        del self._count, self._rows
        self._memory.close()
        if self._is_owner:
            self._memory.unlink()
