"""The SDO server of a simulated node: expedited and segmented transfers.

Source: CiA 301 v4.2.0, 7.2.4.3. Block transfer, optional there, is rejected.
"""

from painter.canopen.protocol.sdo import address_of, expedited_data, head, segment_data
from painter.canopen.sim.store import ObjectStore, SdoAbortError

_UNKNOWN_COMMAND = 0x05040001
_TOGGLE = 0x05030000
_TOO_LONG = 0x06070012
_MOST_BYTES = 4096


class SdoServer:
    """Answers one client.

    Attributes:
        aborts: Abort codes of accesses to fail, by (index, sub); fault injection.
    """

    def __init__(self, store: ObjectStore) -> None:
        """Creates the server of a store."""
        self._store = store
        self._key = (0, 0)
        self._upload: bytes | None = None
        self._download: bytes | None = None
        self._toggle = 0
        self.aborts: dict[tuple[int, int], int] = {}

    def reset(self) -> None:
        """Drops a transfer that is under way."""
        self._upload = self._download = None
        self._toggle = 0

    def answer(self, request: bytes) -> bytes | None:
        """Returns the answer to a request of eight bytes; None if it needs none."""
        if len(request) != 8:
            return None
        command = request[0] >> 5
        if command == 4:  # The client aborts.
            self.reset()
            return None
        if command in (1, 2):
            self._key = address_of(request)
        try:
            if command == 1:
                return self._start_download(request)
            if command == 0:
                return self._continue_download(request)
            if command == 2:
                return self._start_upload()
            if command == 3:
                return self._continue_upload(request)
            raise SdoAbortError(_UNKNOWN_COMMAND)
        except SdoAbortError as error:
            self.reset()
            return head(0x80, *self._key) + error.code.to_bytes(4, "little")

    def _check_injected(self) -> None:
        if self._key in self.aborts:
            raise SdoAbortError(self.aborts[self._key])

    def _start_download(self, request: bytes) -> bytes:
        self.reset()
        self._check_injected()
        if request[0] & 0x02:
            self._store.write(*self._key, expedited_data(request))
        else:
            self._store.find_writable(*self._key)
            self._download = b""
        return head(0x60, *self._key) + bytes(4)

    def _continue_download(self, request: bytes) -> bytes:
        if self._download is None:
            raise SdoAbortError(_UNKNOWN_COMMAND)
        self._check_toggle(request)
        self._download += segment_data(request)
        if len(self._download) > _MOST_BYTES:
            raise SdoAbortError(_TOO_LONG)
        answer = bytes([0x20 | (request[0] & 0x10)]) + bytes(7)
        if request[0] & 0x01:
            data, self._download = self._download, None
            self._store.write(*self._key, data)
        return answer

    def _start_upload(self) -> bytes:
        self.reset()
        self._check_injected()
        data = self._store.read(*self._key)
        if 1 <= len(data) <= 4:
            command = 0x43 | (4 - len(data)) << 2
            return head(command, *self._key) + data.ljust(4, b"\0")
        self._upload = data
        return head(0x41, *self._key) + len(data).to_bytes(4, "little")

    def _continue_upload(self, request: bytes) -> bytes:
        if self._upload is None:
            raise SdoAbortError(_UNKNOWN_COMMAND)
        self._check_toggle(request)
        part, rest = self._upload[:7], self._upload[7:]
        self._upload = rest or None
        last = 0 if rest else 1
        command = (request[0] & 0x10) | (7 - len(part)) << 1 | last
        return bytes([command]) + part.ljust(7, b"\0")

    def _check_toggle(self, request: bytes) -> None:
        if request[0] >> 4 & 1 != self._toggle:
            raise SdoAbortError(_TOGGLE)
        self._toggle ^= 1
