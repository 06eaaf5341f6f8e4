"""The master's view of one node: boot-up, identity, heartbeat, emergencies."""

from collections import deque
from collections.abc import Callable, Generator, Iterable

from painter.canopen.config.bus_config import Identity, Timeouts
from painter.canopen.master.od_config import ConfigPlan, write_and_verify
from painter.canopen.protocol.codes import emcy_text
from painter.canopen.protocol.frames import (
    EMCY_BASE,
    HEARTBEAT_BASE,
    NMT_ID,
    SDO_TO_CLIENT,
    Frame,
)
from painter.canopen.protocol.nmt import NmtCommand, NmtState
from painter.canopen.protocol.sdo import SdoClient
from painter.errors import BusError

Script = Generator[None, None, None]

_SAVE = b"save"
_LOAD = b"load"
_STORE_TIME = 1.0
_IDENTITY = ("vendor", "product", "revision", "serial")


class NodeClient:
    """State of one node, and the services the master uses.

    Attributes:
        name: Axis name, or "io".
        node_id: 1 to 127.
        plan: What is written to it.
        sdo: Its SDO client.
        now: Clock of the bus at the last poll, s.
        is_configured: Whether it was configured since its last boot-up.
        heard: When its last heartbeat was received, s.
        nmt: State in the last heartbeat; None before the first.
        emcy: Code of the active emergency; 0 for none.
        history: Last emergencies: time, code.
        got_tpdo: Whether a TPDO was received since the flag was cleared.
        missed: SYNCs in a row without a TPDO.
        alarm: Event that must stop the arm; the bus takes it.
    """

    def __init__(
        self,
        name: str,
        node_id: int,
        send: Callable[[Frame], None],
        *,
        identity: Identity,
        timeouts: Timeouts,
        plan: ConfigPlan,
        profile: int,
        restore: bool = False,
        store: bool = False,
    ) -> None:
        """Creates the client of a node.

        Args:
            name: Axis name, or "io".
            node_id: 1 to 127.
            send: Sends a frame.
            identity: Expected values of 1018h.
            timeouts: Of the bus file.
            plan: What is written to it.
            profile: Device profile in the low half of 1000h, e.g. 402.
            restore: Whether defaults are restored (1011h) before it is configured.
            store: Whether it stores its configuration (1010h).
        """
        self.name = name
        self.node_id = node_id
        self.plan = plan
        self._send = send
        self._identity = identity
        self._timeouts = timeouts
        self._profile = profile
        self._restores, self._stores = restore, store
        self.sdo = SdoClient(
            name, node_id, send, timeout=timeouts.sdo, retries=timeouts.sdo_retries
        )
        self.now = 0.0
        self.is_configured = False
        self.heard = 0.0
        self.nmt: int | None = None
        self.emcy = 0
        self.history: deque[tuple[float, int]] = deque(maxlen=32)
        self.missed = 0
        self.got_tpdo = False
        self.alarm: str | None = None
        self._booted = False

    def take(self, frame: Frame, now: float) -> bool:
        """Takes a frame; returns False if it fits no service of the node."""
        self.now = now
        data = frame.data
        kind = frame.cob_id - self.node_id
        if kind == SDO_TO_CLIENT:
            return self.sdo.take(data, now)
        if kind == HEARTBEAT_BASE and len(data) == 1:
            self._take_heartbeat(data[0] & 0x7F)
        elif kind == EMCY_BASE and len(data) == 8:
            self._take_emergency(int.from_bytes(data[:2], "little"))
        else:
            return self.take_process_data(kind, data)
        return True

    def take_process_data(self, kind: int, data: bytes) -> bool:
        """Takes a TPDO; `kind` is its COB-ID without the node-ID.

        Returns:
            Whether the node sends such a TPDO, of this length.
        """
        return False

    def is_healthy(self, now: float) -> bool:
        """Whether it can restart after a stop without a new configuration."""
        recent = now - self.heard <= self._timeouts.heartbeat
        return self.is_configured and recent and self.nmt == NmtState.OPERATIONAL

    def poll(self, now: float) -> None:
        """Sets the clock and sends what is due."""
        self.now = now
        self.sdo.poll(now)

    def wait(
        self, condition: Callable[[], bool], timeout: float, failure: str
    ) -> Script:
        """Yields until a condition holds.

        Raises:
            BusError: It does not hold in time: "name: failure within timeout s".
        """
        start = self.now
        while not condition():
            if self.now - start > timeout:
                raise BusError(
                    f"{self.name}: {failure} within {timeout:g} s.", code="PNT-BUS-011"
                )
            yield

    def wait_operational(self) -> Script:
        """Yields until the node is operational and has sent a TPDO.

        Raises:
            BusError: It is not within the time-out of the boot-up.
        """
        yield from self.wait(
            lambda: self.got_tpdo and self.nmt == NmtState.OPERATIONAL,
            self._timeouts.boot,
            "not operational",
        )

    def bring_up(self) -> Script:
        """Resets the node, checks its identity, and configures it.

        Raises:
            BusError: A step failed; names node and step.
        """
        yield from self._reset()
        yield from self._check_identity()
        if self._restores:
            yield from self.sdo.transfer(0x1011, 1, _LOAD)
            yield from self._reset()
        yield from self.check_device()
        yield from write_and_verify(self.name, self.sdo, self.plan)
        if self._stores:
            yield from self.sdo.transfer(0x1010, 1, _SAVE)
            done = self.now + _STORE_TIME
            while self.now < done:
                yield
        self.emcy = 0
        self.alarm = None
        self.is_configured = True

    def check_device(self) -> Script:
        """Checks objects of the device; raises BusError for one that does not match."""
        yield from ()

    def read(self, index: int, sub: int = 0) -> Generator[None, None, int]:
        """Reads an unsigned number; raises SdoError."""
        data = yield from self.sdo.transfer(index, sub)
        return int.from_bytes(data, "little")

    def start(self) -> None:
        """Commands OPERATIONAL; a heartbeat confirms it."""
        self._send(Frame(NMT_ID, bytes([NmtCommand.START, self.node_id])))

    def fault_text(self) -> str:
        """Returns the active emergency as text."""
        return f"EMCY {self.emcy:04X}h, {emcy_text(self.emcy)}"

    def _reset(self) -> Script:
        self.is_configured = False
        self.nmt = None
        self.sdo.clear()
        self._booted = False
        self._send(Frame(NMT_ID, bytes([NmtCommand.RESET_NODE, self.node_id])))
        timeout = self._timeouts.boot
        yield from self.wait(lambda: self._booted, timeout, "no boot-up message")

    def _check_identity(self) -> Script:
        kind = yield from self.read(0x1000)
        if kind & 0xFFFF != self._profile:
            raise BusError(
                f"{self.name}: 1000h is {kind:08X}h, not a CiA {self._profile} device.",
                code="PNT-BUS-012",
            )
        for sub, field in enumerate(_IDENTITY, start=1):
            wanted = getattr(self._identity, field)
            if not wanted:
                continue
            found = yield from self.read(0x1018, sub)
            if found != wanted:
                raise BusError(
                    f"{self.name}: wrong device: {field} (1018h:{sub}) is {found:X}h, "
                    f"{wanted:X}h in the bus file.",
                    code="PNT-BUS-013",
                )

    def _take_heartbeat(self, state: int) -> None:
        self.heard = self.now
        self.nmt = state
        if state:
            return
        self._booted = True
        if self.is_configured:
            self.is_configured = False
            self.sdo.clear()
            self.alarm = f"{self.name}: unexpected boot-up."

    def _take_emergency(self, code: int) -> None:
        self.history.append((self.now, code))
        self.emcy = code
        if code:
            self.alarm = f"{self.name}: {self.fault_text()}."


def run_concurrently(scripts: Iterable[Script]) -> Script:
    """Runs scripts side by side until all have ended; the first error ends all."""
    running = list(scripts)
    while running:
        for script in list(running):
            try:
                next(script)
            except StopIteration:
                running.remove(script)
        if running:
            yield
