"""SDO client: a queue of requests to one node's objects that never blocks.

One request of a node is on the bus at a time. `poll` sends it, and again after the
time-out; `take` gets the answers. Late answers to an abandoned request are recognised
by their index and dropped: python-canopen takes one for success of the next write.

Source: CiA 301 v4.2.0, 7.2.4.3.
"""

import functools
from collections import deque
from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import Any

from painter.canopen.protocol.codes import abort_text
from painter.canopen.protocol.frames import SDO_TO_SERVER, Frame
from painter.errors import BusError

_ABORT = 0x80
_TIMED_OUT = 0x05040000


def address_of(data: bytes) -> tuple[int, int]:
    """Returns index and sub-index in the eight bytes of a request or answer."""
    return int.from_bytes(data[1:3], "little"), data[3]


def head(command: int, index: int, sub: int) -> bytes:
    """Returns the first four bytes of a request or answer."""
    return bytes([command]) + index.to_bytes(2, "little") + bytes([sub])


def expedited_data(data: bytes) -> bytes:
    """Returns the value in an expedited download request or upload answer."""
    size = 4 - (data[0] >> 2 & 3) if data[0] & 0x01 else 4
    return data[4 : 4 + size]


def segment_data(data: bytes) -> bytes:
    """Returns the part of a value in a segment."""
    return data[1 : 8 - (data[0] >> 1 & 7)]


class SdoError(BusError):
    """The node aborted a request or did not answer it.

    Attributes:
        abort_code: SDO abort code.
    """

    def __init__(self, message: str, *, code: str, abort_code: int) -> None:
        """Creates it."""
        super().__init__(message, code=code)
        self.abort_code = abort_code

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickles the error with both codes."""
        make = functools.partial(type(self), code=self.code, abort_code=self.abort_code)
        return make, self.args


@dataclass
class SdoRequest:
    """One read or write.

    Attributes:
        index: Object.
        sub: Sub-index.
        data: What to write; None to read.
        result: What was read.
        error: Why it failed; None if it did not.
        is_done: Whether it has been answered or has failed.
    """

    index: int
    sub: int
    data: bytes | None = None
    result: bytes = b""
    error: SdoError | None = None
    is_done: bool = False


class SdoClient:
    """SDO client of one node.

    Attributes:
        retry_count: Requests that were sent again.
    """

    def __init__(
        self,
        name: str,
        node_id: int,
        send: Callable[[Frame], None],
        *,
        timeout: float,
        retries: int,
    ) -> None:
        """Creates an idle client.

        Args:
            name: The node's name, for messages.
            node_id: 1 to 127.
            send: Sends a frame.
            timeout: Longest time for an answer, s.
            retries: How often an unanswered request is sent again.
        """
        self._name = name
        self._cob_id = SDO_TO_SERVER + node_id
        self._send = send
        self._timeout = timeout
        self._retries = retries
        self._queue: deque[SdoRequest] = deque()
        self._current: SdoRequest | None = None
        self._due = 0.0
        self._tries = 0
        self._toggle = 0
        self._is_segmented = False
        self.retry_count = 0

    def submit(self, index: int, sub: int, data: bytes | None = None) -> SdoRequest:
        """Appends a request to the queue.

        Args:
            index: Object.
            sub: Sub-index.
            data: One to four bytes to write; None to read.

        Returns:
            The request; `is_done` is set later.

        Raises:
            ValueError: `data` has more than four bytes, or none.
        """
        if data is not None and not 1 <= len(data) <= 4:
            raise ValueError(f"can write 1 to 4 bytes, got {len(data)}.")
        request = SdoRequest(index, sub, data)
        self._queue.append(request)
        return request

    def transfer(
        self, index: int, sub: int, data: bytes | None = None
    ) -> Generator[None, None, bytes]:
        """Submits a request and yields until it is done; returns what was read.

        Raises:
            SdoError: The node aborted it or did not answer.
        """
        request = self.submit(index, sub, data)
        while not request.is_done:
            yield
        if request.error is not None:
            raise request.error
        return request.result

    def clear(self) -> None:
        """Fails all requests, e.g. before the node is reset."""
        for request in (self._current, *self._queue):
            if request is not None:
                self._fail(request, _TIMED_OUT)
        self._queue.clear()
        self._current = None

    def poll(self, now: float) -> None:
        """Sends what is due."""
        if self._current is not None and now >= self._due:
            self._send_abort()
            if self._tries > self._retries:
                self._fail(self._current, _TIMED_OUT)
                self._current = None
            else:
                self.retry_count += 1
                self._start(now)
        if self._current is None and self._queue:
            self._current = self._queue.popleft()
            self._tries = 0
            self._start(now)

    def take(self, data: bytes, now: float) -> bool:
        """Takes an answer; returns False if it answers no pending request."""
        request = self._current
        if request is None or len(data) != 8:
            return False
        is_answer = self._take_answer(request, data, now)
        self.poll(now)
        return is_answer

    def _take_answer(self, request: SdoRequest, data: bytes, now: float) -> bool:
        command = data[0] >> 5
        is_ours = address_of(data) == (request.index, request.sub)
        if command == 4 and is_ours:
            self._fail(request, int.from_bytes(data[4:8], "little"))
            self._current = None
        elif self._is_segmented:
            if command != 0 or data[0] >> 4 & 1 != self._toggle:
                return False
            request.result += segment_data(data)
            self._toggle ^= 1
            if data[0] & 0x01:
                self._finish(request)
            else:
                self._ask_segment(now)
        elif command == 3 and is_ours and request.data is not None:
            self._finish(request)
        elif command == 2 and is_ours and request.data is None:
            if data[0] & 0x02:
                request.result = expedited_data(data)
                self._finish(request)
            else:
                self._is_segmented, self._toggle = True, 0
                self._ask_segment(now)
        else:
            return False
        return True

    def _start(self, now: float) -> None:
        request = self._current
        assert request is not None
        self._tries += 1
        self._is_segmented = False
        request.result = b""
        data = request.data
        command = 0x40 if data is None else 0x23 | (4 - len(data)) << 2
        frame = head(command, request.index, request.sub) + (data or b"")
        self._due = now + self._timeout
        self._send(Frame(self._cob_id, frame.ljust(8, b"\0")))

    def _ask_segment(self, now: float) -> None:
        self._due = now + self._timeout
        self._send(Frame(self._cob_id, bytes([0x60 | self._toggle << 4]) + bytes(7)))

    def _send_abort(self) -> None:
        request = self._current
        assert request is not None
        code = _TIMED_OUT.to_bytes(4, "little")
        self._send(Frame(self._cob_id, head(_ABORT, request.index, request.sub) + code))

    def _finish(self, request: SdoRequest) -> None:
        request.is_done = True
        self._current = None

    def _fail(self, request: SdoRequest, code: int) -> None:
        what = "read" if request.data is None else "write"
        request.error = SdoError(
            f"{self._name}: SDO {what} of {request.index:04X}h:{request.sub} failed: "
            f"{abort_text(code)} ({code:08X}h).",
            code="PNT-BUS-039",
            abort_code=code,
        )
        request.is_done = True
