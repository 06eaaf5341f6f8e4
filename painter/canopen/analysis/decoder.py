"""Decodes frames of a log: NMT, SYNC, EMCY, PDOs, SDOs, heartbeats, error frames.

Source: CiA 301 v4.2.0, 7.2 (services) and 7.3.5 (pre-defined connection set); Linux,
include/uapi/linux/can/error.h (error frames).
"""

from dataclasses import dataclass

from painter.canopen.analysis.kinds import Kind
from painter.canopen.analysis.object_names import TEXTS, object_text
from painter.canopen.analysis.value_text import ValueFormatter
from painter.canopen.config.bus_config import BusConfig
from painter.canopen.master.arm_nodes import ArmNodes
from painter.canopen.master.drive_client import DriveClient
from painter.canopen.protocol.codes import abort_text, emcy_text
from painter.canopen.protocol.frames import (
    EMCY_BASE,
    HEARTBEAT_BASE,
    NMT_ID,
    SDO_TO_CLIENT,
    SDO_TO_SERVER,
    SYNC_ID,
    Frame,
)
from painter.canopen.protocol.pdo_maps import PdoMaps
from painter.canopen.protocol.sdo import address_of, expedited_data, segment_data

# Objects whose changes are news; positions always change.
_NEWS = frozenset({0x6000, 0x6040, 0x6041, 0x6060, 0x6061, 0x6200})


@dataclass(frozen=True)
class Decoded:
    """A decoded frame.

    Attributes:
        kind: Its kind.
        node: Name of the node that sends or receives it; empty for all nodes.
        text: Its content.
        is_news: Whether it is a command, a changed state, an answer to an SDO request,
            an emergency or an error; not repeated process data.
    """

    kind: Kind
    node: str
    text: str
    is_news: bool = True


class Decoder:
    """Decodes frames in the order of a log; its SDO writes may change PDO maps."""

    def __init__(self, bus: BusConfig) -> None:
        """Starts with the nodes of a bus file and the PDO maps that the master writes.

        Raises:
            InputError: The EDS of a drive does not allow its configuration.
        """
        clients = ArmNodes(bus, lambda frame: None).all
        self._names = {client.node_id: client.name for client in clients}
        self._names[bus.master_id] = "master"
        self._words = {
            client.node_id: ValueFormatter(
                bus, client.units if isinstance(client, DriveClient) else None
            )
            for client in clients
        }
        self._maps = PdoMaps()
        for client in clients:
            for entry in client.plan.entries:
                self._write(client.node_id, entry.index, entry.sub, entry.value)
        # Last values of the objects whose changes are news; NMT states at index 0.
        self._last: dict[tuple[int, int], int] = {}
        self._requests: dict[int, tuple[int, int, bytes]] = {}

    @property
    def node_names(self) -> list[str]:
        """Names of the nodes in decoded frames."""
        return list(self._names.values())

    def decode(self, frame: Frame) -> Decoded:
        """Returns a decoded frame."""
        cob_id, data = frame.cob_id, frame.data
        if frame.is_error:
            return Decoded(Kind.ERROR, "", _error_text(cob_id))
        if cob_id == NMT_ID and len(data) == 2:
            command = TEXTS["nmt_commands"].get(data[0], f"command {data[0]}")
            node = self._name(data[1]) if data[1] else ""
            return Decoded(Kind.NMT, node, command)
        if cob_id == SYNC_ID:
            return Decoded(Kind.SYNC, "", data.hex(), is_news=False)
        node_id, service = cob_id & 0x7F, cob_id & ~0x7F
        name = self._name(node_id)
        if service == EMCY_BASE and len(data) == 8:
            code = int.from_bytes(data[:2], "little")
            text = f"{code:04X}h {emcy_text(code)}, error register {data[2]:02X}h"
            return Decoded(Kind.EMCY, name, text)
        if service == HEARTBEAT_BASE and len(data) == 1:
            state = data[0] & 0x7F
            is_news = state == 0 or self._has_changed(node_id, 0, state)
            text = TEXTS["nmt_states"].get(state, f"state {state}")
            return Decoded(Kind.HEARTBEAT, name, text, is_news)
        if service == SDO_TO_SERVER and len(data) == 8:
            return self._request(node_id, data)
        if service == SDO_TO_CLIENT and len(data) == 8:
            return self._answer(node_id, data)
        pdo = self._pdo(cob_id, data)
        return pdo or Decoded(Kind.OTHER, "", f"{cob_id:03X}h {data.hex(' ')}")

    def _pdo(self, cob_id: int, data: bytes) -> Decoded | None:
        pdo = self._maps.find(cob_id)
        if pdo is None:
            return None
        kind = Kind.RPDO if pdo.is_received else Kind.TPDO
        name = self._name(pdo.node_id)
        if len(data) < pdo.size:
            text = f"{len(data)} bytes, {pdo.size} are mapped: {data.hex(' ')}"
            return Decoded(kind, name, text)
        parts, start, is_news = [], 0, False
        words = self._words[pdo.node_id]
        for index, sub, size in pdo.objects:
            value = data[start : start + size]
            start += size
            if index == 0x6060:
                words.mode = value[0]
            if index in _NEWS:
                number = int.from_bytes(value, "little")
                is_news |= self._has_changed(pdo.node_id, index, number)
            name_text = object_text(index, sub).partition(" ")[2] or f"{index:04X}h"
            parts.append(f"{name_text} {words.text(index, sub, value)}")
        return Decoded(kind, name, "; ".join(parts), is_news)

    def _request(self, node_id: int, data: bytes) -> Decoded:
        name, command = self._name(node_id), data[0] >> 5
        index, sub = address_of(data)
        if command == 4:
            code = int.from_bytes(data[4:], "little")
            text = f"{object_text(index, sub)}: aborted by the master, {_abort(code)}"
            return Decoded(Kind.SDO, name, text)
        if command not in (1, 2):
            return Decoded(Kind.SDO, name, "segment", is_news=False)
        payload = expedited_data(data) if command == 1 else b""
        self._requests[node_id] = (index, sub, payload)
        verb = "write" if command == 1 else "read"
        text = f"{verb} {object_text(index, sub)}"
        return Decoded(Kind.SDO, name, text, is_news=False)

    def _answer(self, node_id: int, data: bytes) -> Decoded:
        name, command = self._name(node_id), data[0] >> 5
        index, sub = address_of(data)
        if command == 4:
            code = int.from_bytes(data[4:], "little")
            text = f"{object_text(index, sub)}: aborted, {_abort(code)}"
            return Decoded(Kind.SDO, name, text)
        if command == 3:
            asked = self._requests.get(node_id)
            if asked is None or asked[:2] != (index, sub):
                return Decoded(Kind.SDO, name, f"{object_text(index, sub)} written")
            shown = self._shown(node_id, index, sub, asked[2])
            value = int.from_bytes(asked[2], "little")
            self._write(node_id, index, sub, value)
            return Decoded(Kind.SDO, name, f"{object_text(index, sub)} := {shown}")
        if command == 2 and data[0] & 0x02:
            shown = self._shown(node_id, index, sub, expedited_data(data))
            return Decoded(Kind.SDO, name, f"{object_text(index, sub)} = {shown}")
        if command == 2:
            length = int.from_bytes(data[4:], "little")
            text = f"{object_text(index, sub)}: {length} bytes follow"
            return Decoded(Kind.SDO, name, text)
        if command == 0:
            return Decoded(Kind.SDO, name, f"segment {segment_data(data)!r}")
        return Decoded(Kind.SDO, name, "segment", is_news=False)

    def _write(self, node_id: int, index: int, sub: int, value: int) -> None:
        self._maps.write(node_id, index, sub, value)
        if index == 0x6060:
            self._words[node_id].mode = value

    def _shown(self, node_id: int, index: int, sub: int, data: bytes) -> str:
        words = self._words.get(node_id)
        return data.hex(" ") if words is None else words.text(index, sub, data)

    def _has_changed(self, node_id: int, index: int, value: int) -> bool:
        key = (node_id, index)
        is_new = self._last.get(key) != value
        self._last[key] = value
        return is_new

    def _name(self, node_id: int) -> str:
        return self._names.get(node_id, f"node {node_id}")


def _abort(code: int) -> str:
    return f"{code:08X}h {abort_text(code)}"


def _error_text(bits: int) -> str:
    texts = [text for bit, text in TEXTS["error_frames"].items() if bits & bit]
    return ", ".join(texts) or f"class {bits:X}h"
