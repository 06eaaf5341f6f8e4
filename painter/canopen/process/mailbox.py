"""Newest value between two processes, without locks: shared memory, two slots.

One process writes, one reads. The writer fills the slot that is not current, then
increments the sequence number; the reader copies the current slot and checks that the
number is unchanged. Neither waits for the other or depends on its survival.

Source: Lameter, "Effective synchronization on Linux/NUMA systems", 2005 (sequence
locks); x86-64 and CPython keep the order of the stores used here, and a checksum
detects a torn copy on other processors.
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
    """One value that a writer replaces and a reader reads."""

    def __init__(self, size: int = 16384, *, name: str | None = None) -> None:
        """Creates a mailbox, or opens one by name.

        Args:
            size: Maximum number of bytes of a pickled value.
            name: Of an existing mailbox; None creates one.
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
        """Number of values put so far."""
        return int(_HEAD.unpack_from(self._buffer, 0)[0])

    def put(self, value: Any) -> None:
        """Replaces the value.

        Raises:
            ValueError: The pickled value is too long.
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
        """Returns the sequence number and the newest value.

        None before the first value, or if it was replaced during each try.
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
        """Closes the memory; the owner also removes it."""
        del self._buffer
        self._memory.close()
        if self._is_owner:
            self._memory.unlink()

    def _slot(self, sequence: int) -> int:
        return _HEAD.size + (sequence % 2) * (_SLOT.size + self._size)
