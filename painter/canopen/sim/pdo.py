"""Process data of a simulated node: mapping rules, encoding, decoding.

Source: CiA 301 v4.2.0, 7.5.2.35 to 7.5.2.38 (parameters and mapping of PDOs).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

from painter.canopen.protocol.od_types import Value, pack, size_of, unpack
from painter.canopen.sim.store import ObjectStore, SdoAbortError

_INVALID = 1 << 31
_CANNOT_MAP = 0x06040041
_TOO_LONG = 0x06040042
_BAD_VALUE = 0x06090030
_BAD_STATE = 0x08000022


@dataclass(frozen=True)
class Pdo:
    """One valid PDO.

    Attributes:
        number: 0 for the first.
        cob_id: Its identifier.
        transmission: Type: 0 to 240 with SYNC, 254 and 255 event-driven.
        event_time: Event timer, s; 0 for none.
        objects: (index, sub) and size in bytes, in order.
    """

    number: int
    cob_id: int
    transmission: int
    event_time: float
    objects: tuple[tuple[int, int, int], ...]


class PdoEngine:
    """PDOs of one store; rejects what a real node rejects."""

    def __init__(self, store: ObjectStore) -> None:
        """Creates the engine and hooks its rules into the store."""
        self._store = store
        self._cache: dict[int, list[Pdo]] = {}
        for parameters, maps in ((0x1400, 0x1600), (0x1800, 0x1A00)):
            for number in self._numbers(parameters):
                store.hooks[parameters + number] = partial(
                    self._check_parameter, parameters + number
                )
                store.hooks[maps + number] = partial(
                    self._check_mapping, parameters + number, maps + number
                )

    def invalidate(self) -> None:
        """Drops cached PDOs; call it after changes that were no SDO write."""
        self._cache = {}

    def received(self) -> list[Pdo]:
        """Returns the valid RPDOs."""
        return self._active(0x1400, 0x1600)

    def transmitted(self) -> list[Pdo]:
        """Returns the valid TPDOs."""
        return self._active(0x1800, 0x1A00)

    def data(self, pdo: Pdo) -> bytes:
        """Encodes the objects of a TPDO."""
        store = self._store
        return b"".join(
            pack(store.find(index, sub).data_type, store.values[index, sub])
            for index, sub, _ in pdo.objects
        )

    def split(self, pdo: Pdo, data: bytes) -> Iterator[tuple[int, int, Value]]:
        """Yields index, sub and value of an RPDO's objects."""
        start = 0
        for index, sub, size in pdo.objects:
            kind = self._store.find(index, sub).data_type
            yield index, sub, unpack(kind, data[start : start + size])
            start += size

    def _numbers(self, parameters: int) -> list[int]:
        return [n for n in range(4) if self._store.description.find(parameters + n, 1)]

    def _active(self, parameters: int, maps: int) -> list[Pdo]:
        if parameters not in self._cache:
            found = []
            for n in self._numbers(parameters):
                cob_id = self._store.number(parameters + n, 1)
                count = self._store.number(maps + n, 0)
                if cob_id & _INVALID or not count:
                    continue
                entries = [self._store.number(maps + n, i + 1) for i in range(count)]
                found.append(
                    Pdo(
                        number=n,
                        cob_id=cob_id & 0x7FF,
                        transmission=self._store.number(parameters + n, 2),
                        event_time=self._store.number(parameters + n, 5) / 1e3,
                        objects=tuple(
                            (e >> 16, e >> 8 & 0xFF, (e & 0xFF) // 8) for e in entries
                        ),
                    )
                )
            self._cache[parameters] = found
        return self._cache[parameters]

    def _check_parameter(self, index: int, sub: int, value: Value) -> None:
        assert isinstance(value, int)
        current = self._store.number(index, 1)
        if sub == 1 and not (current | value) & _INVALID and current != value:
            raise SdoAbortError(_BAD_VALUE)  # Must be off to change the identifier.
        if sub == 2 and 240 < value < 252:
            raise SdoAbortError(_BAD_VALUE)
        self._cache = {}

    def _check_mapping(self, parameters: int, index: int, sub: int, v: Value) -> None:
        assert isinstance(v, int)
        if not self._store.number(parameters, 1) & _INVALID:
            raise SdoAbortError(_BAD_STATE)  # The PDO must be off.
        if sub == 0:
            entries = [self._store.number(index, i + 1) for i in range(v)]
            if sum(e & 0xFF for e in entries) > 64:
                raise SdoAbortError(_TOO_LONG)
            for entry in entries:
                self._check_entry(entry)
        else:
            if self._store.number(index, 0):
                raise SdoAbortError(_BAD_STATE)  # The count must be 0.
            if v:
                self._check_entry(v)
        self._cache = {}

    def _check_entry(self, entry: int) -> None:
        info = self._store.description.find(entry >> 16, entry >> 8 & 0xFF)
        if info is None:
            raise SdoAbortError(0x06020000)
        size = size_of(info.data_type)
        if not info.mappable or size is None or entry & 0xFF != 8 * size:
            raise SdoAbortError(_CANNOT_MAP)
