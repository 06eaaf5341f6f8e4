"""The paint cycle on the robot, from pre-flight checks to a run folder."""

import dataclasses
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from painter.camera.frame_socket import FrameClient
from painter.camera.reader import CameraReader, camera_opener
from painter.canopen.config.bus_config import BusConfig
from painter.canopen.process.bus_process import BusProcess
from painter.canopen.process.realtime import set_niceness
from painter.canopen.process.robot_clock import RobotClock
from painter.config import Scenario, dump_scenario
from painter.cycle.cycle_log import CycleLog
from painter.cycle.deploy import DeployCycle
from painter.cycle.preflight import Check, preflight
from painter.cycle.step_by_step import StepByStep
from painter.cycle.write_run import end_run, event_watch, write_log
from painter.diagrams.hardware_station import RobotConnection
from painter.errors import BusError, PainterError
from painter.jobs.run_simulation import versions
from painter.planning.program.remainder import Remainder
from painter.run.folder.folder import RunFolder
from painter.run.run import Run
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


@dataclasses.dataclass(frozen=True, kw_only=True)
class DeployOptions:
    """How a cycle is run on the robot.

    Attributes:
        camera: Socket of the pictures of `painter drives`; None = the camera.
        dry_run: Whether the gun stays closed.
        speed: Share of all speeds, above 0 to 1; goes with `dry_run`.
        step: Whether the operator confirms each phase.
        log_bus: Whether all CAN frames are logged.
        ahead: Time from a command to its execution, s.
        rate: Speed of the run's clock against real time.
    """

    camera: str | None = None
    dry_run: bool = False
    speed: float = 1.0
    step: bool = False
    log_bus: bool = False
    ahead: float = 0.4
    rate: float = 1.0


class Deployment:
    """One paint cycle on the robot."""

    def __init__(
        self,
        job: Scenario,
        bus: BusConfig,
        options: DeployOptions,
        *,
        ask: Callable[[str], bool],
        report_check: Callable[[Check], None],
        show: Callable[[float, str], None],
    ) -> None:
        """Creates it; nothing is connected yet.

        Args:
            job: The job, at full speed.
            bus: What is on the bus.
            options: How it is run.
            ask: Asks the operator a question; False aborts.
            report_check: Called with each pre-flight check.
            show: Called with the share of the cycle that is done, 0 to 1, and its
                phase.
        """
        self._job = slowed(job, options.speed)
        self._bus = bus if options.camera is None else rehearsed(bus)
        self._options = options
        self._ask, self._report_check, self._show = ask, report_check, show

    def run(self, out: Path, remainder: Remainder | None) -> Run:
        """Runs the cycle and writes the run folder.

        Args:
            out: The run folder.
            remainder: What an earlier run left to paint; None = scan and paint all.

        Returns:
            The run, also if it ended in FAULT or ABORTED.

        Raises:
            PainterError: A pre-flight check failed, or bus or camera ended the cycle;
                the folder is marked incomplete.
        """
        folder = RunFolder.create(out, dump_scenario(self._job))
        start = time.perf_counter()
        set_niceness(_NICENESS)
        with ExitStack() as stack:
            interruption = stack.enter_context(interruptions())
            try:
                log = self._cycle(stack, folder, remainder, interruption)
            except PainterError as error:
                folder.mark_incomplete(f"{Phase.FAULT.value}: {error}", error.code)
                raise
        write_log(folder, self._job, log)
        return end_run(folder, log, start=start)

    def _cycle(
        self,
        stack: ExitStack,
        folder: RunFolder,
        remainder: Remainder | None,
        interruption: Callable[[], str | None],
    ) -> CycleLog:
        options, clock = self._options, TimeBase(self._options.rate)
        log_path = folder.path / BUS_LOG if options.log_bus else None
        process = stack.enter_context(BusProcess(self._bus, log=log_path, clock=clock))
        reader = stack.enter_context(_camera(self._job, options.camera, clock))
        self._preflight(folder, process, reader)
        connection = RobotConnection(
            bus=process,
            clock=RobotClock(ahead=options.ahead),
            cycle=self._bus.cycle,
            read_camera=reader.read,
            gun_off=options.dry_run,
        )
        folder.log(
            0.0,
            "started",
            versions=versions("python-can"),
            bus_time_s=process.now(),
            dry_run=options.dry_run,
            speed=options.speed,
            rate=options.rate,
        )
        tell = event_watch(folder, self._show)
        operator = StepByStep(
            every_phase=options.step,
            review=not self._job.cycle.unattended,
            ask=self._ask,
        )

        def watch(
            now: float, status: CycleStatus, follower: FollowerStatus
        ) -> str | None:
            tell(now, status, follower)
            return operator.command(status.phase)

        log = DeployCycle(
            self._job,
            connection,
            remainder=remainder,
            watch=watch,
            interruption=interruption,
        )
        # Events that are known only at the end, such as the stroke to resume from.
        tell(log.end_time, log.status, FollowerStatus())
        _log_health(folder, log.end_time, process, reader)
        return log

    def _preflight(
        self, folder: RunFolder, process: BusProcess, reader: CameraReader
    ) -> None:
        """Runs the checks, reports and logs each; raises where one fails."""
        for check in preflight(self._job, self._bus, process, reader.read, folder.path):
            self._report_check(check)
            result = {"passed": check.passed, "text": check.text}
            folder.log(0.0, "check", check=check.name, **result)
            if not check.passed:
                raise BusError(
                    f"pre-flight check {check.name}: {check.text.rstrip('.')}.",
                    code="PNT-USE-019",
                )


def rehearsed(bus: BusConfig) -> BusConfig:
    """Returns a bus with longer deadlines, for drives simulated on this computer.

    Master and drives are then two more processes under a scheduler that guarantees no
    deadline: it may delay either by some 10 ms at any time.
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
    """Returns a job that moves at a share of its speeds.

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
    """Turns Ctrl-C into a reason to stop instead of an exception.

    Yields:
        A function that returns the reason once Ctrl-C was pressed, else None.
    """
    pressed: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, frame: pressed.append(number))
    try:
        yield lambda: INTERRUPTED if pressed else None
    finally:
        signal.signal(signal.SIGINT, before)


def _camera(job: Scenario, path: str | None, clock: TimeBase) -> CameraReader:
    """Returns the reader of the device, or of the pictures of `painter drives`."""
    config, stereo = job.wall_camera.driver, job.wall_camera.stereo
    source = None
    if path is not None:
        source = FrameClient(path, latency=PICTURE_LATENCY, clock=clock)
        # Pictures come at the scenario's low rate and may be rendered late.
        config = dataclasses.replace(
            config, latency=PICTURE_LATENCY, max_age=1.0, silence=3.0
        )
    intrinsics = CameraIntrinsics.from_stereo(stereo)
    opener = camera_opener(config, intrinsics, baseline=stereo.baseline, source=source)
    return CameraReader(opener, config, clock)


def _log_health(
    folder: RunFolder, time: float, process: BusProcess, reader: CameraReader
) -> None:
    """Logs the statistics of bus and camera."""
    health = reader.read().health
    folder.log(time, "camera", **dataclasses.asdict(health))
    with suppress(BusError):
        report = process.report()
        if report is not None:
            late = report.lateness
            data = dataclasses.asdict(report.feedback.statistics)
            data |= {} if late is None else {"late": dataclasses.asdict(late)}
            folder.log(time, "bus", is_fifo=report.is_fifo, **data)
