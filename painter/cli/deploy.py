"""`painter deploy`: the paint cycle on the robot, into a run folder."""

import dataclasses
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Annotated

import typer

from painter.camera.frame_socket import FrameClient
from painter.camera.reader import CameraReader, camera_opener
from painter.canopen.config.bus_config import BusConfig
from painter.canopen.config.bus_file import load_bus
from painter.canopen.process.bus_process import BusProcess
from painter.canopen.process.realtime import set_niceness
from painter.canopen.process.robot_clock import RobotClock
from painter.cli.common import (
    JsonOption,
    RateOption,
    ScenarioArgument,
    SetOption,
    print_result,
    print_summary,
    progress,
    versions,
)
from painter.config import Scenario, dump_scenario, load_scenario
from painter.cycle.deploy import DeployCycle
from painter.cycle.preflight import preflight
from painter.cycle.step_by_step import StepByStep
from painter.cycle.write_run import event_watch, write_log
from painter.diagrams.hardware_station import RobotConnection
from painter.errors import BusError, FaultError, InputError, PainterError
from painter.resources import models_path
from painter.run.figures.unfinished import rest_of_run
from painter.run.folder.folder import SCENARIO, RunFolder
from painter.run.page.report import finish_run
from painter.systems.values import CycleStatus, FollowerStatus, Phase
from painter.timebase import TimeBase
from perception.depth_camera.depth import CameraIntrinsics

# Deadlines of process data in a rehearsal with simulated drives, s.
REHEARSAL_TIME = 0.1
INTERRUPTED = "interrupted by the operator."
BUS_LOG = "bus.log"
# Age at which pictures of simulated drives are handed on, s: rendering takes less.
PICTURE_LATENCY = 0.3
# An arm that moves waits for its setpoints; what renders pictures for it comes second.
_NICENESS = -18


def deploy(
    scenario: ScenarioArgument = None,
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="Run folder to write.")
    ] = Path("runs/deploy"),
    bus_file: Annotated[
        Path | None,
        typer.Option("--bus", metavar="FILE", help="Bus file.  [default: the robot's]"),
    ] = None,
    interface: Annotated[
        str | None,
        typer.Option(
            help="python-can interface (socketcan, slcan, udp_multicast ...), or local "
            "for a socket on this machine, instead of the bus file's."
        ),
    ] = None,
    channel: Annotated[
        str | None, typer.Option(help="Channel, e.g. can0, or the socket's path.")
    ] = None,
    camera: Annotated[
        str | None,
        typer.Option(
            metavar="PATH",
            help="Take pictures from this socket of `painter drives --scenario`, "
            "through librealsense's software device. Process data may then be "
            "late by 0.1 s: the computer also simulates.  [default: the camera]",
        ),
    ] = None,
    overrides: SetOption = None,
    resume: Annotated[
        Path | None,
        typer.Option(metavar="RUN", help="Go on with a run that was stopped."),
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Move, but keep the gun closed.")
    ] = False,
    speed: Annotated[
        float,
        typer.Option(
            min=0.05,
            max=1.0,
            help="Share of all speeds; below 1 with --dry-run alone.",
        ),
    ] = 1.0,
    step: Annotated[
        bool, typer.Option("--step", help="Wait for a word before each phase.")
    ] = False,
    log_bus: Annotated[
        bool, typer.Option("--log-bus", help="Log all CAN frames (`painter canlog`).")
    ] = False,
    ahead: Annotated[
        float,
        typer.Option(
            min=0.1,
            max=0.9,
            help="Time from a command to its execution, s: what may hold up the "
            "diagram without holding up the arm.",
        ),
    ] = 0.4,
    rate: RateOption = 1.0,
    as_json: JsonOption = False,
) -> None:
    """Paint with the robot: check, look, scan, segment, plan, paint, report.

    Ctrl-C stops the arm under control and closes the gun. After any stop the job goes
    on with --resume.

    Raises:
        InputError: The options do not go together or name nothing to be read.
        FaultError: The cycle did not come to DONE; the run folder says why.
    """
    if resume is not None and scenario is not None:
        raise InputError(
            f"{scenario}: the scenario is that of {resume}; give none.",
            code="PNT-USE-014",
        )
    if resume is not None and out.resolve() == resume.resolve():
        raise InputError(
            f"--out {out}: is the run to be gone on with; give another.",
            code="PNT-USE-015",
        )
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
    clock = TimeBase(rate)
    earlier = None if resume is None else RunFolder.open(resume)
    name = scenario or "cubes" if earlier is None else str(earlier.path / SCENARIO)
    job = slowed(load_scenario(name, overrides or ()), speed)
    remainder = None if earlier is None else rest_of_run(earlier)
    bus = load_bus(bus_file or models_path("bus", "painter.bus.yaml"))
    bus = dataclasses.replace(
        bus, interface=interface or bus.interface, channel=channel or bus.channel
    )
    bus = bus if camera is None else rehearsed(bus)
    folder = RunFolder.create(out, dump_scenario(job))
    start = time.perf_counter()
    set_niceness(_NICENESS)
    with ExitStack() as stack:
        stopper = stack.enter_context(interruptions())
        log = folder.path / BUS_LOG if log_bus else None
        process = stack.enter_context(BusProcess(bus, log=log, clock=clock))
        reader = stack.enter_context(_camera(job, camera, clock))
        try:
            _check(folder, job, bus, process, reader)
            connection = RobotConnection(
                bus=process,
                clock=RobotClock(ahead=ahead),
                cycle=bus.cycle,
                read_camera=reader.read,
                gun_off=dry_run,
            )
            folder.log(
                0.0,
                "started",
                versions=versions("python-can"),
                bus_time_s=process.now(),
                dry_run=dry_run,
                speed=speed,
                rate=rate,
            )
            show = stack.enter_context(progress(f"Deploying {job.name}"))
            tell = event_watch(folder, show)
            operator = StepByStep(
                every_phase=step, review=not job.cycle.unattended, ask=_ask
            )

            def watch(
                now: float, status: CycleStatus, follower: FollowerStatus
            ) -> str | None:
                tell(now, status, follower)
                return operator.command(status.phase)

            left = DeployCycle(
                job, connection, remainder=remainder, watch=watch, interruption=stopper
            )
            # What was found out at the end, such as the stroke to go on with.
            tell(left.end_time, left.status, FollowerStatus())
            _log_health(folder, left.end_time, process, reader)
        except PainterError as error:
            folder.mark_incomplete(f"{Phase.FAULT.value}: {error}", error.code)
            raise
    result, cause = left.status.phase, left.status.cause or None
    write_log(folder, job, left)
    figures = finish_run(
        folder,
        time=left.end_time,
        result=result.value,
        cause=cause,
        code=left.status.code or None,
        wall_clock=time.perf_counter() - start,
    )
    if as_json:
        print_result(figures, as_json=True)
    else:
        print_summary(figures, out)
    if result != Phase.DONE:
        raise FaultError(f"{result.value}: {cause}", code=left.status.code)


def rehearsed(bus: BusConfig) -> BusConfig:
    """Returns a bus whose deadlines forgive what a computer holds processes up.

    Robot and drives, which wait for nobody, are then two more programs on a computer
    that knows no deadlines: it may hold up either for some 10 ms at any time.
    """
    return dataclasses.replace(
        bus,
        timeouts=dataclasses.replace(
            bus.timeouts,
            tpdo=max(bus.timeouts.tpdo, REHEARSAL_TIME),
            rpdo_cycles=max(
                bus.timeouts.rpdo_cycles, round(REHEARSAL_TIME / bus.cycle)
            ),
        ),
        io=dataclasses.replace(bus.io, deadline=max(bus.io.deadline, REHEARSAL_TIME)),
    )


def slowed(job: Scenario, speed: float) -> Scenario:
    """Returns a job in which everything moves at a share of its speed.

    Args:
        job: The job.
        speed: Share, above 0 to 1.
    """
    if speed == 1.0:
        return job
    return dataclasses.replace(
        job,
        scan=dataclasses.replace(job.scan, speed=job.scan.speed * speed),
        raster=dataclasses.replace(job.raster, speed=job.raster.speed * speed),
        motion=dataclasses.replace(
            job.motion, limit_share=job.motion.limit_share * speed
        ),
    )


@contextmanager
def interruptions() -> Iterator[Callable[[], str | None]]:
    """Lets Ctrl-C be asked for instead of ending what runs.

    Yields:
        A function that returns why to stop, once Ctrl-C was pressed, or None.
    """
    pressed: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, frame: pressed.append(number))
    try:
        yield lambda: INTERRUPTED if pressed else None
    finally:
        signal.signal(signal.SIGINT, before)


def _camera(job: Scenario, path: str | None, clock: TimeBase) -> CameraReader:
    """Returns the camera's reader, of the device or of `painter drives`' pictures."""
    config, stereo = job.wall_camera.driver, job.wall_camera.stereo
    source = None
    if path is not None:
        source = FrameClient(path, latency=PICTURE_LATENCY, clock=clock)
        # Pictures come as seldom as the scenario's rate says, and may be rendered late.
        config = dataclasses.replace(
            config, latency=PICTURE_LATENCY, max_age=1.0, silence=3.0
        )
    wanted = CameraIntrinsics.from_stereo(stereo)
    opener = camera_opener(config, wanted, baseline=stereo.baseline, source=source)
    return CameraReader(opener, config, clock)


def _check(
    folder: RunFolder,
    job: Scenario,
    bus: BusConfig,
    process: BusProcess,
    reader: CameraReader,
) -> None:
    """Runs the checks, prints and logs each; raises BusError where one fails."""
    for check in preflight(job, bus, process, reader.read, folder.path):
        mark = "ok  " if check.passed else "FAIL"
        typer.echo(f"{mark} {check.name}: {check.text}", err=True)
        result = {"passed": check.passed, "text": check.text}
        folder.log(0.0, "check", check=check.name, **result)
        if not check.passed:
            raise BusError(
                f"pre-flight check {check.name}: {check.text.rstrip('.')}.",
                code="PNT-USE-019",
            )


def _log_health(
    folder: RunFolder, time: float, process: BusProcess, reader: CameraReader
) -> None:
    """Logs how bus and camera fared."""
    health = reader.read().health
    folder.log(time, "camera", **dataclasses.asdict(health))
    with suppress(BusError):
        report = process.report()
        if report is not None:
            late = report.lateness
            data = dataclasses.asdict(report.feedback.statistics)
            data |= {} if late is None else {"late": dataclasses.asdict(late)}
            folder.log(time, "bus", is_fifo=report.is_fifo, **data)


def _ask(question: str) -> bool:
    return bool(typer.confirm(question, default=True, err=True))
