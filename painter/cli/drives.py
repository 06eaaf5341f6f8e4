"""`painter drives`: simulated CiA 402 drives as a process of their own."""

import re
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from painter.canopen.sim.faults import Fault
from painter.cli import common
from painter.cli.common import print_result, read_bus
from painter.errors import InputError

if TYPE_CHECKING:
    from painter.jobs.run_drives import PlannedFault
    from painter.rehearsal.hil_bench import HilBench

CAMERA_SOCKET = str(Path(tempfile.gettempdir()) / "painter-camera")
_FAULT = re.compile(r"(?P<name>\w+)(?:@(?P<axis>\w+))?:(?P<time>[0-9.]+)")

BusArgument = Annotated[
    Path | None,
    typer.Argument(metavar="BUS", help="Bus file.  [default: the robot's]"),
]
FaultOption = Annotated[
    list[str] | None,
    typer.Option(
        "--fault",
        metavar="NAME[@AXIS]:SECONDS",
        help="Inject a fault this long after the start, e.g. emcy@elbow_pitch:12.5; "
        f"repeatable. Names: {', '.join(Fault)}.",
    ),
]
WorldOption = Annotated[
    str | None,
    typer.Option(
        "--scenario",
        metavar="NAME",
        help="Simulate the arm on the motors and the scene of this scenario, with "
        "camera and paint.  [default: motors only]",
        autocompletion=common.complete_scenario,
    ),
]
CameraOption = Annotated[
    str,
    typer.Option(
        metavar="PATH",
        help="With --scenario: socket that serves the camera's pictures to `painter "
        "deploy --camera`.",
    ),
]
TruthOption = Annotated[
    Path | None,
    typer.Option(
        metavar="RUN",
        help="With --scenario: at the end, add the film and the true mask to this run "
        "of `painter deploy`.",
    ),
]
DurationOption = Annotated[
    float | None,
    typer.Option(min=0.0, help="Time to run, s.  [default: until interrupted]"),
]


def drives(
    bus_file: BusArgument = None,
    interface: common.Interface = None,
    channel: common.Channel = None,
    faults: FaultOption = None,
    scenario: WorldOption = None,
    overrides: common.Set = None,
    camera: CameraOption = CAMERA_SOCKET,
    truth: TruthOption = None,
    rate: common.Rate = 1.0,
    duration: DurationOption = None,
    as_json: common.Json = False,
) -> None:
    """Run simulated drives and the I/O node of a bus file on a CAN interface.

    They behave like real drives, faults included, with the timing of a real bus.

    Raises:
        InputError: An option is wrong.
        PainterError: The simulated world has ended.
    """
    if scenario is None and (overrides or truth is not None):
        raise InputError("--set and --truth: need --scenario.", code="PNT-USE-020")
    from painter.jobs.run_drives import run_drives

    bus = read_bus(bus_file, interface, channel)
    plan = [_parse_fault(argument) for argument in faults or ()]
    figures = run_drives(
        bus,
        faults=plan,
        bench=None if scenario is None else _bench(scenario, overrides or (), camera),
        truth=truth,
        rate=rate,
        duration=duration,
        tell=lambda line: typer.echo(line, err=True),
    )
    print_result(figures, as_json=as_json)


def _bench(scenario: str, overrides: Sequence[str], camera: str) -> "HilBench":
    # Drake is imported only for drives that move an arm.
    from painter.config import load_scenario
    from painter.rehearsal.hil_bench import HilBench

    return HilBench(load_scenario(scenario, overrides), camera=camera)


def _parse_fault(argument: str) -> "PlannedFault":
    from painter.canopen.config.units import AXES
    from painter.jobs.run_drives import PlannedFault

    match = _FAULT.fullmatch(argument)
    if match is None:
        raise InputError(
            f"--fault {argument!r}: expected NAME[@AXIS]:SECONDS.", code="PNT-USE-021"
        )
    name, axis = match["name"], match["axis"] or AXES[0]
    if name not in list(Fault):
        raise InputError(
            f"--fault {argument!r}: known are {', '.join(Fault)}.", code="PNT-USE-022"
        )
    if axis not in AXES:
        raise InputError(
            f"--fault {argument!r}: axes are {', '.join(AXES)}.", code="PNT-USE-023"
        )
    try:
        return PlannedFault(float(match["time"]), Fault(name), axis)
    except ValueError:
        raise InputError(
            f"--fault {argument!r}: the time must be in s.", code="PNT-USE-024"
        ) from None
