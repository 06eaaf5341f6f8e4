"""`painter deploy`: the paint cycle on the robot, into a run folder."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from painter.cli import common
from painter.cli.common import fail_unless_done, print_run, progress, read_bus
from painter.errors import InputError

if TYPE_CHECKING:
    from painter.cycle.preflight import Check

CameraOption = Annotated[
    str | None,
    typer.Option(
        metavar="PATH",
        help="Rehearsal: read pictures from this socket of `painter drives "
        "--scenario`, through librealsense's software device. Deadlines of process "
        "data grow to 0.1 s, since this computer also simulates.  [default: camera]",
    ),
]
DryRunOption = Annotated[
    bool, typer.Option("--dry-run", help="Move, but keep the gun closed.")
]
SpeedOption = Annotated[
    float,
    typer.Option(
        min=0.05, max=1.0, help="Fraction of all speeds; below 1 needs --dry-run."
    ),
]
StepOption = Annotated[
    bool, typer.Option("--step", help="Ask for confirmation before each phase.")
]
LogBusOption = Annotated[
    bool,
    typer.Option("--log-bus", help="Log all CAN frames to bus.log (`painter canlog`)."),
]
AheadOption = Annotated[
    float,
    typer.Option(
        min=0.1,
        max=0.9,
        help="Time from a command to its execution, s. The arm keeps moving through "
        "stalls of this program that are shorter.",
    ),
]


def deploy(
    scenario: common.ScenarioArgument = None,
    out: common.RunFolder = Path("runs/deploy"),
    bus_file: common.Bus = None,
    interface: common.Interface = None,
    channel: common.Channel = None,
    camera: CameraOption = None,
    overrides: common.Set = None,
    resume: common.Resume = None,
    dry_run: DryRunOption = False,
    speed: SpeedOption = 1.0,
    step: StepOption = False,
    log_bus: LogBusOption = False,
    ahead: AheadOption = 0.4,
    rate: common.Rate = 1.0,
    as_json: common.Json = False,
) -> None:
    """Paint with the robot: check, look, scan, segment, plan, paint, report.

    Ctrl-C stops the arm under control and closes the gun. After any stop, --resume
    paints what is left.

    Raises:
        InputError: Options exclude each other or name files that cannot be read.
    """
    _check_options(speed, rate, dry_run=dry_run, camera=camera)
    from painter.config import load_scenario
    from painter.jobs.run_deployment import Deployment, DeployOptions
    from painter.jobs.run_simulation import check_other_folder
    from painter.run.figures.unfinished import rest_of_run
    from painter.run.folder.folder import SCENARIO, RunFolder

    remainder = None
    if resume is not None:
        check_other_folder(out, resume, scenario)
        remainder = rest_of_run(RunFolder.open(resume))
        scenario = str(resume / SCENARIO)
    job = load_scenario(scenario or "cubes", overrides or ())
    bus = read_bus(bus_file, interface, channel)
    how = DeployOptions(
        camera=camera, dry_run=dry_run, speed=speed, step=step,
        log_bus=log_bus, ahead=ahead, rate=rate,
    )  # fmt: skip
    with progress(f"Deploying {job.name}") as show:
        deployment = Deployment(
            job, bus, how, ask=_ask, report_check=_print_check, show=show
        )
        run = deployment.run(out, remainder)
    print_run(run.figures, out, as_json=as_json)
    fail_unless_done(run.figures)


def _check_options(
    speed: float, rate: float, *, dry_run: bool, camera: str | None
) -> None:
    if speed < 1.0 and not dry_run:
        raise InputError(
            f"--speed {speed:g}: needs --dry-run; the film would be "
            f"{1.0 / speed:.1f} times as thick.",
            code="PNT-USE-016",
        )
    if rate < 1.0 and camera is None:
        raise InputError(
            f"--rate {rate:g}: needs --camera, a rehearsal; a robot's clock runs at 1.",
            code="PNT-USE-017",
        )


def _print_check(check: "Check") -> None:
    mark = "ok  " if check.passed else "FAIL"
    typer.echo(f"{mark} {check.name}: {check.text}", err=True)


def _ask(question: str) -> bool:
    return bool(typer.confirm(question, default=True, err=True))
