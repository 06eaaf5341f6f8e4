"""`painter drives`: simulated CiA 402 drives as a process of their own."""

import dataclasses
import re
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from painter.canopen.config.bus_file import load_bus
from painter.canopen.config.units import AXES
from painter.canopen.process.realtime import use_fifo
from painter.canopen.sim.rack import Fault
from painter.canopen.sim.server import RackServer
from painter.cli.common import JsonOption, RateOption, SetOption, print_result
from painter.errors import InputError
from painter.resources import models_path
from painter.timebase import TimeBase

if TYPE_CHECKING:
    from painter.rehearsal.hil_bench import HilBench

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
    scenario: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Let the motors move the arm of this scenario before its scene, with "
            "camera and paint.  [default: motors alone]",
        ),
    ] = None,
    overrides: SetOption = None,
    camera: Annotated[
        str,
        typer.Option(
            metavar="PATH",
            help="With --scenario: socket on which `painter deploy --camera` finds the "
            "camera's pictures.",
        ),
    ] = str(Path(tempfile.gettempdir()) / "painter-camera"),
    truth: Annotated[
        Path | None,
        typer.Option(
            metavar="RUN",
            help="With --scenario: when the drives are switched off, add the film and "
            "what is truly wall to this run of `painter deploy`.",
        ),
    ] = None,
    rate: RateOption = 1.0,
    duration: Annotated[
        float | None,
        typer.Option(min=0.0, help="Time to run, s.  [default: until interrupted]"),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Run simulated drives and the I/O node of a bus file on a CAN interface.

    They behave like real ones down to their faults, and take the time of a real bus.

    Raises:
        InputError: An option is wrong.
        PainterError: The simulated world has ended.
    """
    if scenario is None and (overrides or truth is not None):
        raise InputError(
            "--set and --truth: go with --scenario alone.", code="PNT-USE-020"
        )
    bus = load_bus(bus_file or models_path("bus", "painter.bus.yaml"))
    bus = dataclasses.replace(
        bus,
        interface=interface or bus.interface,
        channel=channel or bus.channel,
    )
    plan = sorted((_fault(word) for word in faults or ()), key=lambda item: item[0])
    bench = None if scenario is None else _bench(scenario, overrides or (), camera)
    server = RackServer(bus, None if bench is None else bench.load, TimeBase(rate))
    if bench is not None:
        bench.attach(server)
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
    if bench is not None:
        bench.finish(truth)
    figures: dict[str, object] = {
        "time_s": rack.now,
        "frames": rack.wire.frame_count,
        "bus_load": rack.wire.busy_time / rack.now if rack.now else 0.0,
        "slips": server.slips,
        "sync_late_s": server.sync_late,
    }
    figures |= {f"{name}_state": d.state.value for name, d in rack.drives.items()}
    print_result(figures, as_json=as_json)


def _bench(scenario: str, overrides: Sequence[str], camera: str) -> "HilBench":
    # Drake is imported only for drives that move an arm.
    from painter.config import load_scenario
    from painter.rehearsal.hil_bench import HilBench

    return HilBench(load_scenario(scenario, overrides), camera=camera)


def _fault(word: str) -> tuple[float, Fault, str]:
    match = _FAULT.fullmatch(word)
    if match is None:
        raise InputError(
            f"--fault {word!r}: expected NAME[@AXIS]:SECONDS.", code="PNT-USE-021"
        )
    name, axis = match["name"], match["axis"] or AXES[0]
    if name not in list(Fault):
        raise InputError(
            f"--fault {word!r}: known are {', '.join(Fault)}.", code="PNT-USE-022"
        )
    if axis not in AXES:
        raise InputError(
            f"--fault {word!r}: axes are {', '.join(AXES)}.", code="PNT-USE-023"
        )
    try:
        return float(match["time"]), Fault(name), axis
    except ValueError:
        raise InputError(
            f"--fault {word!r}: the time must be in s.", code="PNT-USE-024"
        ) from None
