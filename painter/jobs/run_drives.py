"""Simulated drives on a CAN interface, until they are switched off."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from painter.canopen.config.bus_config import BusConfig
from painter.canopen.process.realtime import use_fifo
from painter.canopen.sim.faults import Fault
from painter.canopen.sim.server import RackServer
from painter.timebase import TimeBase

if TYPE_CHECKING:
    from painter.rehearsal.hil_bench import HilBench

# Below the bus process, which is at 60: real drives wait for no other program.
_PRIORITY = 50


@dataclass(frozen=True)
class PlannedFault:
    """A fault to inject: when, s after the start, which, and on which axis."""

    time: float
    fault: Fault
    axis: str


def run_drives(
    bus: BusConfig,
    *,
    faults: Sequence[PlannedFault] = (),
    bench: "HilBench | None" = None,
    truth: Path | None = None,
    rate: float = 1.0,
    duration: float | None = None,
    tell: Callable[[str], None],
) -> dict[str, Any]:
    """Runs simulated drives and the I/O node of a bus until interrupted.

    Args:
        bus: Nodes and interface.
        faults: To be injected.
        bench: What the motors move and what stands around it; None = motors alone.
        truth: Run folder to which `bench` adds film and truth at the end.
        rate: Speed of the clock against real time.
        duration: Time to run, s; None = until Ctrl-C.
        tell: Called with what happens, one line each.

    Returns:
        Time (s), frames, bus load, timing and the state of each drive.

    Raises:
        BusError: The interface cannot be opened.
        PainterError: The simulated world has ended.
    """
    plan = sorted(faults, key=lambda item: item.time)
    server = RackServer(bus, None if bench is None else bench.load, TimeBase(rate))
    rack = server.rack
    if bench is not None:
        bench.attach(server)
    use_fifo(_PRIORITY)
    tell(f"drives are on {bus.interface} {bus.channel}")

    def is_done(now: float) -> bool:
        while plan and now >= plan[0].time:
            due = plan.pop(0)
            rack.inject(due.fault, due.axis)
            tell(f"{now:.3f} s: {due.fault} at {due.axis}")
        return duration is not None and now >= duration

    try:
        server.run(is_done)
    except KeyboardInterrupt:
        tell("switched off")
    finally:
        server.close()
    if bench is not None:
        bench.finish(truth)
    return {
        "time_s": rack.now,
        "frames": rack.wire.frame_count,
        "bus_load": rack.wire.busy_time / rack.now if rack.now else 0.0,
        "slips": server.slips,
        "sync_late_s": server.sync_late,
    } | {f"{name}_state": drive.state.value for name, drive in rack.drives.items()}
