"""Our candump reader and writer against python-can's: time a frame, and what is kept.

Run `python -m benchmarks.speed.candump`; docs/decisions/candump.md holds the figures.
"""

import io
import random
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import can

from painter.canopen.protocol.frames import Frame
from painter.canopen.wire.candump import LogRecord, format_record, read_lines

FRAMES = 200_000
ROUNDS = 5
# One line for each property that our logs rely on.
LINES = (
    "(1.000000) can0 20000040#0000000000000000 R",
    "(1.000000) can0 080#",
    "(1.000000) can0 800#00",
    "(1.000000) can0 123#0",
    "(1.000000) can0 123#000000000000000000",
    "(nan) can0 123#00",
)


def main() -> None:
    """Prints microseconds a frame and what python-can makes of special lines."""
    draw = random.Random(1)
    ids = (0x080, 0x181, 0x201, 0x581)
    records = [
        LogRecord(
            1.7e9 + 1e-4 * i,
            Frame(draw.choice(ids), draw.randbytes(draw.randrange(9))),
            bool(i % 2),
        )
        for i in range(FRAMES)
    ]
    with tempfile.TemporaryDirectory() as folder:
        ours, theirs = Path(folder, "ours.log"), Path(folder, "theirs.log")
        print(f"write, ours        {best(lambda: write_ours(ours, records)):6.2f} us")
        print(f"write, python-can  {best(lambda: write_theirs(theirs, records)):6.2f}")
        print(f"read, ours         {best(lambda: list(read_lines(ours))):6.2f}")
        print(f"read, python-can   {best(lambda: read_theirs(ours)):6.2f}")
        print(f"same text: {ours.read_text() == theirs.read_text()}")
    for line in LINES:
        print(f"{line}\n  -> {next(iter(can.CanutilsLogReader(io.StringIO(line))))!r}")


def best(job: Callable[[], object]) -> float:
    """Shortest processor time of some rounds, us a frame."""
    times = []
    for _ in range(ROUNDS):
        start = time.process_time()
        job()
        times.append(time.process_time() - start)
    return 1e6 * min(times) / FRAMES


def write_ours(path: Path, records: list[LogRecord]) -> None:
    """Writes as the bus process does."""
    with path.open("w") as log:
        for record in records:
            log.write(format_record(record, "can0") + "\n")


def write_theirs(path: Path, records: list[LogRecord]) -> None:
    """Writes by python-can."""
    with can.CanutilsLogWriter(path, channel="can0") as writer:
        for record in records:
            writer.on_message_received(
                can.Message(
                    timestamp=record.time,
                    arbitration_id=record.frame.cob_id,
                    data=record.frame.data,
                    is_extended_id=False,
                    is_rx=not record.is_sent,
                )
            )


def read_theirs(path: Path) -> list[LogRecord]:
    """Reads by python-can, as records."""
    with can.CanutilsLogReader(path) as reader:
        return [
            LogRecord(m.timestamp, Frame(m.arbitration_id, bytes(m.data)), not m.is_rx)
            for m in reader
        ]


if __name__ == "__main__":
    main()
