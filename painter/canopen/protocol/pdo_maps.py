"""PDO mappings, collected from SDO writes.

Source: CiA 301 v4.2.0, 7.5.2.35 to 7.5.2.38 (1400h, 1600h, 1800h, 1A00h).
"""

from dataclasses import dataclass

_OFF = 1 << 31


@dataclass(frozen=True)
class PdoMap:
    """One process data object.

    Attributes:
        node_id: Node that sends or receives it.
        is_received: Whether the node receives it (RPDO).
        objects: Index, sub-index and bytes of the mapped objects.
    """

    node_id: int
    is_received: bool
    objects: tuple[tuple[int, int, int], ...]

    @property
    def size(self) -> int:
        """Number of mapped bytes."""
        return sum(size for _, _, size in self.objects)


class PdoMaps:
    """All process data objects of a bus, by identifier."""

    def __init__(self) -> None:
        """Starts without mappings."""
        self._values: dict[tuple[int, int, int], int] = {}
        self._found: dict[int, PdoMap] | None = {}

    def write(self, node_id: int, index: int, sub: int, value: int) -> None:
        """Takes a write; ignores objects other than PDO parameters and mappings."""
        if 0x1400 <= index < 0x1C00:
            self._values[node_id, index, sub] = value
            self._found = None

    def find(self, cob_id: int) -> PdoMap | None:
        """Returns the PDO with an identifier, or None."""
        if self._found is None:
            self._found = dict(self._all())
        return self._found.get(cob_id)

    def _all(self) -> list[tuple[int, PdoMap]]:
        maps = []
        for (node_id, index, sub), cob_id in self._values.items():
            if sub != 1 or index & 0x200 or cob_id & _OFF:
                continue
            count = self._values.get((node_id, index + 0x200, 0), 0)
            entries = (
                self._values.get((node_id, index + 0x200, i + 1), 0)
                for i in range(count)
            )
            objects = tuple(
                (entry >> 16, entry >> 8 & 0xFF, (entry & 0xFF) // 8)
                for entry in entries
            )
            maps.append((cob_id & 0x7FF, PdoMap(node_id, index < 0x1800, objects)))
        return maps
