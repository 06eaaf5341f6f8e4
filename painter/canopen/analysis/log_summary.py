"""Figures of a log: frames, bus load, SYNC jitter, errors."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from painter.canopen.analysis.decoder import Decoded
from painter.canopen.analysis.kinds import Kind
from painter.canopen.protocol.frames import SYNC_ID, frame_time
from painter.canopen.wire.candump import LogRecord


class LogSummary:
    """Counts the frames of a log."""

    def __init__(self, bitrate: int) -> None:
        """Creates an empty summary.

        Args:
            bitrate: Bits a second, for the bus load.
        """
        self._bitrate = bitrate
        self._kinds: Counter[str] = Counter()
        self._nodes: Counter[str] = Counter()
        self._busy: Counter[int] = Counter()  # Nanoseconds by second of the log.
        self._syncs: list[float] = []
        self._events: list[str] = []
        self._first: float | None = None
        self._last = 0.0

    def add(self, record: LogRecord, decoded: Decoded) -> None:
        """Counts a frame."""
        frame = record.frame
        if self._first is None:
            self._first = record.time
        self._last = max(self._last, record.time)
        self._kinds[decoded.kind] += 1
        if frame.is_error:
            self._events.append(_event(record, decoded))
            return
        if decoded.node:
            self._nodes[decoded.node] += 1
        took = frame_time(len(frame.data), self._bitrate)
        self._busy[int(record.time - self._first)] += round(1e9 * took)
        if frame.cob_id == SYNC_ID:
            self._syncs.append(record.time)
        is_abort = decoded.kind == Kind.SDO and "aborted" in decoded.text
        if decoded.kind == Kind.EMCY or is_abort:
            self._events.append(_event(record, decoded))

    def figures(self) -> dict[str, object]:
        """Returns the figures; times in s, shares 0 to 1."""
        start = self._first or 0.0
        duration = self._last - start
        total = sum(self._busy.values()) * 1e-9
        # The last second is incomplete.
        whole = [busy for second, busy in self._busy.items() if second + 1 <= duration]
        return {
            "frames": sum(self._kinds.values()),
            "duration_s": duration,
            "bus_load": total / duration if duration > 0.0 else 0.0,
            "bus_load_busiest_second": max(whole, default=0) * 1e-9,
            **_sync_figures(self._syncs),
            "kinds": dict(sorted(self._kinds.items())),
            "nodes": dict(sorted(self._nodes.items())),
            "errors": self._events,
        }


def _sync_figures(times: Sequence[float]) -> dict[str, object]:
    if len(times) < 2:
        return {"syncs": len(times)}
    gaps = np.diff(times)
    period = float(np.median(gaps))
    off = np.abs(gaps - period)
    return {
        "syncs": len(times),
        "sync_period_s": period,
        "sync_period_error_p99_s": float(np.percentile(off, 99)),
        "sync_gap_worst_s": float(gaps.max()),
    }


def _event(record: LogRecord, decoded: Decoded) -> str:
    return f"{record.time:.6f} {decoded.node} {decoded.kind} {decoded.text}"
