"""Newest value between two processes, without waiting: shared memory, two slots.

One process writes, one reads. The writer fills the slot the reader is not told of and
then raises the sequence number; the reader copies and looks whether the number is still
the same. Neither waits for the other, and a process that dies leaves the other whole.

Source: Lameter, "Effective synchronization on Linux/NUMA systems", 2005 (sequence
locks); x86-64 and CPython keep the order of the stores used here, and a checksum tells
a torn copy where a processor does not.
"""

import pickle
import struct
import zlib
from multiprocessing.shared_memory import SharedMemory
from typing import Any

_HEAD = struct.Struct("<Q")
_SLOT = struct.Struct("<QII")
_TRIES = 4


class Mailbox:
    """One value that a writer replaces and a reader looks at."""

    def __init__(self, size: int = 16384, *, name: str | None = None) -> None:
        """Creates a mailbox, or opens one by name.

        Args:
            size: Most bytes of a pickled value.
            name: Name of an existing one; None creates it.
        """
        self._size = size
        self._is_owner = name is None
        total = _HEAD.size + 2 * (_SLOT.size + size)
        self._memory = SharedMemory(name=name, create=self._is_owner, size=total)
        assert self._memory.buf is not None
        self._buffer = self._memory.buf
        if self._is_owner:
            self._buffer[: _HEAD.size] = bytes(_HEAD.size)

    @property
    def name(self) -> str:
        """Name by which the other process opens it."""
        return self._memory.name

    @property
    def sequence(self) -> int:
        """How many values were put."""
        return int(_HEAD.unpack_from(self._buffer, 0)[0])

    def put(self, value: Any) -> None:
        """Replaces the value.

        Raises:
            ValueError: It is too long.
        """
        data = pickle.dumps(value, protocol=pickle.HIGHEST_PROTOCOL)
        if len(data) > self._size:
            raise ValueError(f"mailbox holds {self._size} bytes, got {len(data)}.")
        sequence = self.sequence + 1
        start = self._slot(sequence)
        _SLOT.pack_into(self._buffer, start, sequence, len(data), zlib.crc32(data))
        start += _SLOT.size
        self._buffer[start : start + len(data)] = data
        _HEAD.pack_into(self._buffer, 0, sequence)

    def get(self) -> tuple[int, Any] | None:
        """Returns the newest value and its number.

        None before the first value, and where it was replaced during each try.
        """
        for _ in range(_TRIES):
            sequence = self.sequence
            if sequence == 0:
                return None
            start = self._slot(sequence)
            number, length, check = _SLOT.unpack_from(self._buffer, start)
            start += _SLOT.size
            data = bytes(self._buffer[start : start + min(length, self._size)])
            if number == sequence and zlib.crc32(data) == check:
                return sequence, pickle.loads(data)
        return None

    def close(self) -> None:
        """Lets go; the owner also removes it."""
        del self._buffer
        self._memory.close()
        if self._is_owner:
            self._memory.unlink()

    def _slot(self, sequence: int) -> int:
        return _HEAD.size + (sequence % 2) * (_SLOT.size + self._size)
