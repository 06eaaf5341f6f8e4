"""A bus log record by record, filtered, with its figures."""

from collections.abc import Callable, Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from painter.canopen.analysis.decoder import Decoded, Decoder
from painter.canopen.analysis.kinds import Kind
from painter.canopen.analysis.log_summary import LogSummary
from painter.canopen.config.bus_config import BusConfig
from painter.canopen.wire.candump import LogRecord, read_lines
from painter.errors import InputError

Show = Callable[[LogRecord, Decoded, float], None]


@dataclass(frozen=True, kw_only=True)
class LogFilter:
    """Which frames of a log are shown.

    Attributes:
        changes: Whether frames that repeat what is known are left out.
        nodes: Names of nodes; empty = all.
        kinds: Sorts of frames; empty = all.
        since: Time after the log's start, s.
        until: Time after the log's start, s; None = its end.
    """

    changes: bool = False
    nodes: Collection[str] = ()
    kinds: Collection[Kind] = ()
    since: float = 0.0
    until: float | None = None

    def holds(self, time: float) -> bool:
        """Returns whether a time after the log's start, s, is within the interval."""
        return time >= self.since and (self.until is None or time <= self.until)

    def passes(self, decoded: Decoded) -> bool:
        """Returns whether a frame is shown."""
        if self.changes and not decoded.is_news:
            return False
        if self.nodes and decoded.node not in self.nodes:
            return False
        return not self.kinds or decoded.kind in self.kinds


def show_log(
    path: Path, bus: BusConfig, chosen: LogFilter, show: Show
) -> dict[str, Any]:
    """Decodes a log and shows the chosen frames.

    Args:
        path: Log in candump's format.
        bus: What is on the bus.
        chosen: Which frames are shown; its interval also bounds the figures.
        show: Called with each chosen record, its text and the time after the log's
            start, s.

    Returns:
        Figures of all frames within the interval, and `foreign`, the number of lines
        that hold no CANopen frame.

    Raises:
        InputError: There is no such log, it holds no CANopen frames, or a node is
            unknown.
    """
    decoder, figures = Decoder(bus), LogSummary(bus.bitrate)
    for node in chosen.nodes:
        if node not in decoder.node_names:
            raise InputError(
                f"--node {node!r}: known are {', '.join(decoder.node_names)}.",
                code="PNT-USE-006",
            )
    start, foreign = None, 0
    for record in read_lines(path):
        if record is None:
            foreign += 1
            continue
        start = record.time if start is None else start
        # Frames outside the interval too: they may change the PDO mapping.
        decoded = decoder.decode(record.frame)
        time = record.time - start
        if not chosen.holds(time):
            continue
        figures.add(record, decoded)
        if chosen.passes(decoded):
            show(record, decoded, time)
    if start is None:
        raise InputError(f"{path}: holds no CANopen frames.", code="PNT-USE-007")
    return figures.figures() | {"foreign": foreign}
