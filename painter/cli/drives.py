"""`painter drives`: simulated CiA 402 drives as a process of their own."""

import dataclasses
import re
from pathlib import Path
from typing import Annotated

import typer

from painter.canopen.bus_file import load_bus
from painter.canopen.realtime import use_fifo
from painter.canopen.sim.rack import Fault
from painter.canopen.sim.server import RackServer
from painter.canopen.units import AXES
from painter.cli.common import JsonOption, print_result
from painter.errors import InputError
from painter.resources import models_path

# Below the bus process, which is at 60: real drives wait for no other program.
_PRIORITY = 50
_FAULT = re.compile(r"(?P<name>\w+)(?:@(?P<axis>\w+))?:(?P<time>[0-9.]+)")


def drives(
    bus_file: Annotated[
        Path | None,
        typer.Argument(metavar="BUS", help="Bus file.  [default: the robot's]"),
    ] = None,
    interface: Annotated[
        str | None,
        typer.Option(
            help="python-can interface, or local for a socket on this machine, instead "
            "of the bus file's."
        ),
    ] = None,
    channel: Annotated[
        str | None, typer.Option(help="Channel, e.g. can0, or the socket's path.")
    ] = None,
    faults: Annotated[
        list[str] | None,
        typer.Option(
            "--fault",
            metavar="NAME[@AXIS]:SECONDS",
            help="Inject a fault at a time after start, e.g. emcy@elbow_pitch:12.5; "
            f"repeatable. Names: {', '.join(Fault)}.",
        ),
    ] = None,
    duration: Annotated[
        float | None,
        typer.Option(min=0.0, help="Time to run, s.  [default: until interrupted]"),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Run simulated drives and the I/O node of a bus file on a CAN interface.

    They behave like real ones down to their faults, and take the time of a real bus.
    """
    bus = load_bus(bus_file or models_path("bus", "painter.bus.yaml"))
    bus = dataclasses.replace(
        bus,
        interface=interface or bus.interface,
        channel=channel or bus.channel,
    )
    plan = sorted((_fault(word) for word in faults or ()), key=lambda item: item[0])
    server = RackServer(bus)
    use_fifo(_PRIORITY)
    typer.echo(f"drives are on {bus.interface} {bus.channel}", err=True)

    def is_done(now: float) -> bool:
        while plan and now >= plan[0][0]:
            _, fault, axis = plan.pop(0)
            server.rack.inject(fault, axis)
            typer.echo(f"{now:.3f} s: {fault} at {axis}", err=True)
        return duration is not None and now >= duration

    try:
        server.run(is_done)
    except KeyboardInterrupt:
        typer.echo("switched off", err=True)
    finally:
        server.close()
    rack = server.rack
    figures: dict[str, object] = {
        "time_s": rack.now,
        "frames": rack.wire.frame_count,
        "bus_load": rack.wire.busy_time / rack.now if rack.now else 0.0,
        "slips": server.slips,
    }
    figures |= {f"{name}_state": d.state.value for name, d in rack.drives.items()}
    print_result(figures, as_json=as_json)


def _fault(word: str) -> tuple[float, Fault, str]:
    match = _FAULT.fullmatch(word)
    if match is None:
        raise InputError(f"--fault {word!r}: expected NAME[@AXIS]:SECONDS.")
    name, axis = match["name"], match["axis"] or AXES[0]
    if name not in list(Fault):
        raise InputError(f"--fault {word!r}: known are {', '.join(Fault)}.")
    if axis not in AXES:
        raise InputError(f"--fault {word!r}: axes are {', '.join(AXES)}.")
    try:
        return float(match["time"]), Fault(name), axis
    except ValueError:
        raise InputError(f"--fault {word!r}: the time must be in s.") from None
