"""Values of a simulated node's objects, with the checks of a real one."""

from collections.abc import Callable

from painter.canopen.config.device import DeviceDescription, ObjectInfo
from painter.canopen.protocol.od_types import Value, pack, size_of, unpack

# Signatures of 1010h and 1011h. Source: CiA 301 v4.2.0, 7.5.2.13 and 7.5.2.14.
SAVE = int.from_bytes(b"save", "little")
LOAD = int.from_bytes(b"load", "little")

Hook = Callable[[int, Value], None]


class SdoAbortError(Exception):
    """A node aborts an access; `code` is one of codes.SDO_ABORTS."""

    def __init__(self, code: int) -> None:
        """Creates it."""
        super().__init__(f"{code:08X}h")
        self.code = code


class ObjectStore:
    """The object dictionary of one simulated node."""

    def __init__(self, description: DeviceDescription) -> None:
        """Creates the store at its defaults."""
        self.description = description
        self._indices = {index for index, _ in description.objects}
        self._defaults: dict[tuple[int, int], Value] = {}
        for key, info in description.objects.items():
            fallback: Value = b"" if size_of(info.data_type) is None else 0
            self._defaults[key] = fallback if info.default is None else info.default
        self._saved: dict[tuple[int, int], Value] = {}
        self.values = dict(self._defaults)
        # Called after the checks, before the value is stored; may raise SdoAbortError.
        self.hooks: dict[int, Hook] = {}
        # Called with index, sub and value after a client's write.
        self.written: Callable[[int, int, Value], None] | None = None

    def power_on(self, *, communication_only: bool = False) -> None:
        """Loads the values after a reset: saved ones, else defaults."""
        for key, value in (self._defaults | self._saved).items():
            if not communication_only or 0x1000 <= key[0] < 0x2000:
                self.values[key] = value

    def fix(self, index: int, sub: int, value: Value) -> None:
        """Sets a value that survives resets, such as the identity."""
        if (index, sub) in self.values:
            self._defaults[index, sub] = value
            self.values[index, sub] = value

    def find(self, index: int, sub: int) -> ObjectInfo:
        """Returns an entry.

        Raises:
            SdoAbortError: There is no such object or sub-index.
        """
        info = self.description.find(index, sub)
        if info is None:
            code = 0x06090011 if index in self._indices else 0x06020000
            raise SdoAbortError(code)
        return info

    def find_writable(self, index: int, sub: int) -> ObjectInfo:
        """Returns an entry that a client may write.

        Raises:
            SdoAbortError: There is no such entry, or it is read only.
        """
        info = self.find(index, sub)
        if info.access not in ("rw", "wo"):
            raise SdoAbortError(0x06010002)
        return info

    def number(self, index: int, sub: int = 0, otherwise: int = 0) -> int:
        """Returns an integer value; `otherwise` if the node has no such object."""
        value = self.values.get((index, sub), otherwise)
        return int(value) if isinstance(value, int | float) else otherwise

    def set(self, index: int, sub: int, value: Value) -> None:
        """Sets a value from inside the node; ignores an object that it lacks."""
        if (index, sub) in self.values:
            self.values[index, sub] = value

    def read(self, index: int, sub: int) -> bytes:
        """Returns a value as an SDO client gets it.

        Raises:
            SdoAbortError: The object is missing or write only.
        """
        info = self.find(index, sub)
        if info.access == "wo":
            raise SdoAbortError(0x06010001)
        return pack(info.data_type, self.values[index, sub])

    def write(self, index: int, sub: int, data: bytes) -> None:
        """Takes a value from an SDO client.

        Raises:
            SdoAbortError: The object is missing or read only, length or value is out of
                its bounds, or the state of the node forbids the write.
        """
        info = self.find_writable(index, sub)
        size = size_of(info.data_type)
        if size is not None and len(data) != size:
            raise SdoAbortError(0x06070012 if len(data) > size else 0x06070013)
        value = unpack(info.data_type, data)
        self._check_bounds(info, value)
        if index == 0x1010 and sub:
            self._save(value)
            return
        if index == 0x1011 and sub:
            self._restore(value)
            return
        hook = self.hooks.get(index)
        if hook is not None:
            hook(sub, value)
        self.values[index, sub] = value
        if self.written is not None:
            self.written(index, sub, value)

    @staticmethod
    def _check_bounds(info: ObjectInfo, value: Value) -> None:
        if isinstance(value, bytes):
            return
        # Some files give 0 for both bounds of writable objects (6066h of EPOS4).
        if info.low == info.high and info.index != 0x1003:
            return
        if isinstance(info.high, int) and value > info.high:
            raise SdoAbortError(0x06090031)
        if isinstance(info.low, int) and value < info.low:
            raise SdoAbortError(0x06090032)

    def _save(self, value: Value) -> None:
        if value != SAVE:
            raise SdoAbortError(0x08000020)
        infos = self.description.objects
        self._saved = {
            key: value
            for key, value in self.values.items()
            if infos[key].access == "rw"
        }

    def _restore(self, value: Value) -> None:
        """Drops saved values; the next reset loads the defaults, as in CiA 301."""
        if value != LOAD:
            raise SdoAbortError(0x08000020)
        self._saved = {}
