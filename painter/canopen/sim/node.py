"""A simulated CANopen node: NMT, heartbeats, SYNC, PDOs, SDO server, emergencies.

Source: CiA 301 v4.2.0; clauses are named at their code.
"""

from collections.abc import Callable

from painter.canopen.config.device import DeviceDescription
from painter.canopen.protocol.frames import (
    HEARTBEAT_BASE,
    NMT_ID,
    SDO_TO_CLIENT,
    SDO_TO_SERVER,
    SYNC_ID,
    Frame,
)
from painter.canopen.protocol.nmt import NmtCommand, NmtState
from painter.canopen.protocol.od_types import Value
from painter.canopen.sim.pdo import Pdo, PdoEngine
from painter.canopen.sim.sdo_server import SdoServer
from painter.canopen.sim.store import ObjectStore
from painter.canopen.sim.wire import Wire

HEARTBEAT_LOST = 0x8130
PDO_LENGTH = 0x8210
RPDO_TIMEOUT = 0x8250
BOOT_TIME = 0.02
# Timers count ticks of 1 ms: a deadline of N ms ends with the Nth tick.
_TICK = 0.001


class SimNode:
    """One node on a wire; subclasses are drives and I/O nodes.

    Attributes:
        node_id: 1 to 127.
        store: Its objects.
        pdos: Its process data.
        sdo: Its SDO server.
        nmt: Its NMT state.
        silent: Whether it sends and receives nothing; fault injection.
        tpdo_silent: Whether it sends no TPDOs; fault injection.
        now: Time of the last step or frame, s.
    """

    def __init__(
        self, node_id: int, description: DeviceDescription, wire: Wire
    ) -> None:
        """Creates a node that boots when it is stepped."""
        self.node_id = node_id
        self.store = ObjectStore(description)
        self.pdos = PdoEngine(self.store)
        self.sdo = SdoServer(self.store)
        self.store.written = lambda *written: self.on_write(*written)
        self.nmt = NmtState.INITIALISING
        self.silent = False
        self.tpdo_silent = False
        self.now = 0.0
        self._send: Callable[[Frame, float], None] = wire.attach(self.receive)
        self._boot_at = BOOT_TIME
        self._next_heartbeat = 0.0
        self._heard: dict[int, float] = {}
        self._latched: list[tuple[Pdo, bytes]] = []
        self._sync_count = 0
        self._next_event: dict[int, float] = {}
        # When each RPDO was received last, and which are overdue.
        self._came: dict[int, float] = {}
        self._overdue: set[int] = set()
        self._sent: dict[int, bytes] = {}

    # What subclasses override.

    def on_boot(self) -> None:
        """The node is initialised."""

    def on_reset(self) -> None:
        """The node was reset; the store has its power-on values."""

    def on_sync(self, now: float) -> None:
        """A SYNC was received and synchronous RPDOs are in the store."""

    def on_write(self, index: int, sub: int, value: Value) -> None:
        """An RPDO or SDO wrote an object."""

    def on_connection_lost(self) -> None:
        """The master's heartbeat or RPDO is overdue, or it stopped the node."""

    def refresh(self) -> None:
        """Values are about to be read: updates the store."""

    # The bus.

    def send(self, cob_id: int, data: bytes) -> None:
        """Sends a frame unless the node is silenced."""
        if not self.silent:
            self._send(Frame(cob_id, data), self.now)

    def receive(self, frame: Frame, now: float) -> None:
        """Takes a frame that ended at `now`."""
        self.now = max(self.now, now)
        if frame.is_error:
            return
        if frame.cob_id == NMT_ID:
            if len(frame.data) == 2 and frame.data[1] in (0, self.node_id):
                self._nmt_command(frame.data[0])
        elif self.nmt == NmtState.INITIALISING or self.silent:
            return
        elif frame.cob_id == SYNC_ID:
            self._sync()
        elif frame.cob_id == SDO_TO_SERVER + self.node_id:
            if self.nmt != NmtState.STOPPED:
                self._serve(frame.data)
        elif HEARTBEAT_BASE < frame.cob_id < HEARTBEAT_BASE + 128:
            self._heard[frame.cob_id - HEARTBEAT_BASE] = now
        elif self.nmt == NmtState.OPERATIONAL:
            self._take_rpdo(frame)

    def step(self, now: float) -> None:
        """Advances to `now`: boot, heartbeats, event timers."""
        self.now = max(self.now, now)
        if self.nmt == NmtState.INITIALISING:
            if self.now >= self._boot_at:
                self.nmt = NmtState.PRE_OPERATIONAL
                self.on_boot()
                self.send(HEARTBEAT_BASE + self.node_id, b"\0")
                self._next_heartbeat = self.now
            return
        period = self.store.number(0x1017) / 1e3
        if period and self.now >= self._next_heartbeat:
            self._next_heartbeat = self.now + period
            self.send(HEARTBEAT_BASE + self.node_id, bytes([self.nmt]))
        self._monitor_heartbeats()
        if self.nmt == NmtState.OPERATIONAL:
            self._monitor_rpdos()
            self._send_events()

    def reboot(self) -> None:
        """Resets the node, as a power cycle would."""
        self._nmt_command(NmtCommand.RESET_NODE)

    def emergency(self, code: int, register: int) -> None:
        """Sends an EMCY and stores it in 1001h and 1003h; code 0 ends the error."""
        self.store.set(0x1001, 0, register)
        if code:
            count = min(self.store.number(0x1003) + 1, 8)
            for sub in range(count, 1, -1):
                self.store.set(0x1003, sub, self.store.number(0x1003, sub - 1))
            self.store.set(0x1003, 1, code)
            self.store.set(0x1003, 0, count)
        data = code.to_bytes(2, "little") + bytes([register, 0, 0, 0, 0, 0])
        self.send(0x80 + self.node_id, data)

    def _nmt_command(self, command: int) -> None:
        if command in (NmtCommand.RESET_NODE, NmtCommand.RESET_COMMUNICATION):
            only = command == NmtCommand.RESET_COMMUNICATION
            self.store.power_on(communication_only=only)
            self.pdos.invalidate()
            self.sdo.reset()
            self._heard, self._latched, self._sent = {}, [], {}
            self._came, self._overdue = {}, set()
            self.nmt = NmtState.INITIALISING
            self._boot_at = self.now + BOOT_TIME
            if not only:
                self.on_reset()
            return
        states: dict[int, NmtState] = {
            NmtCommand.START: NmtState.OPERATIONAL,
            NmtCommand.STOP: NmtState.STOPPED,
            NmtCommand.ENTER_PRE_OPERATIONAL: NmtState.PRE_OPERATIONAL,
        }
        if self.nmt == NmtState.INITIALISING or command not in states:
            return
        was, self.nmt = self.nmt, states[command]
        if was == NmtState.OPERATIONAL != self.nmt:
            self.on_connection_lost()

    def _serve(self, request: bytes) -> None:
        self.refresh()
        answer = self.sdo.answer(request)
        if answer is not None:
            self.send(SDO_TO_CLIENT + self.node_id, answer)

    def _take_rpdo(self, frame: Frame) -> None:
        for pdo in self.pdos.received():
            if pdo.cob_id != frame.cob_id:
                continue
            if len(frame.data) < sum(size for _, _, size in pdo.objects):
                self.emergency(PDO_LENGTH, 0x11)
                continue
            self._came[pdo.number] = self.now
            if pdo.number in self._overdue:
                self._overdue.remove(pdo.number)
                self.emergency(0, 0)
            if pdo.transmission <= 240:
                self._latched.append((pdo, frame.data))
            else:
                self._apply(pdo, frame.data)

    def _apply(self, pdo: Pdo, data: bytes) -> None:
        for index, sub, value in self.pdos.split(pdo, data):
            self.store.set(index, sub, value)
            self.on_write(index, sub, value)

    def _sync(self) -> None:
        self._sync_count += 1
        if self.nmt != NmtState.OPERATIONAL:
            return
        latched, self._latched = self._latched, []
        for pdo, data in latched:
            self._apply(pdo, data)
        self.on_sync(self.now)
        self.refresh()
        for pdo in self.pdos.transmitted():
            every = max(1, pdo.transmission)
            if pdo.transmission <= 240 and self._sync_count % every == 0:
                self._transmit(pdo)

    def _send_events(self) -> None:
        events = [pdo for pdo in self.pdos.transmitted() if pdo.transmission >= 254]
        if events:
            self.refresh()
        for pdo in events:
            data = self.pdos.data(pdo)
            due = pdo.event_time and self.now >= self._next_event.get(pdo.number, 0.0)
            if due or data != self._sent.get(pdo.number):
                self._next_event[pdo.number] = self.now + pdo.event_time
                self._transmit(pdo)

    def _transmit(self, pdo: Pdo) -> None:
        if not self.tpdo_silent:
            data = self.pdos.data(pdo)
            self._sent[pdo.number] = data
            self.send(pdo.cob_id, data)

    def _monitor_rpdos(self) -> None:
        """RPDO deadlines, 140xh:5, clause 7.5.2.35; armed by the first RPDO."""
        for pdo in self.pdos.received():
            came = self._came.get(pdo.number)
            if came is None or not pdo.event_time or pdo.number in self._overdue:
                continue
            if self.now - came > pdo.event_time - _TICK:
                self._overdue.add(pdo.number)
                self.emergency(RPDO_TIMEOUT, 0x11)
                self.on_connection_lost()

    def _monitor_heartbeats(self) -> None:
        """Consumer heartbeat time, 1016h; armed by the first heartbeat heard."""
        for sub in range(1, self.store.number(0x1016) + 1):
            entry = self.store.number(0x1016, sub)
            producer, limit = entry >> 16 & 0x7F, (entry & 0xFFFF) / 1e3
            heard = self._heard.get(producer)
            if heard is not None and limit and self.now - heard > limit:
                del self._heard[producer]
                self.emergency(HEARTBEAT_LOST, 0x11)
                self.on_connection_lost()
                if (
                    self.store.number(0x1029, 1) == 0
                    and self.nmt == NmtState.OPERATIONAL
                ):
                    self.nmt = NmtState.PRE_OPERATIONAL
                elif self.store.number(0x1029, 1) == 2:
                    self.nmt = NmtState.STOPPED
