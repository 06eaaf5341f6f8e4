"""The bus in a process of its own, so that no computation delays a SYNC.

`BusProcess` is the diagram's side; it never waits for the bus. Feedback arrives
through a mailbox in shared memory; commands and setpoints go through a pipe that the
bus empties each cycle. When this side dies, the pipe ends: the bus stops the arm,
closes the gun and switches off. When the bus process dies, the drives miss the master's
heartbeat and stop by 6007h.
"""

import contextlib
import logging
import multiprocessing
import os
import select
import signal
import time
from collections.abc import Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from painter.canopen.config.bus_config import BusConfig
from painter.canopen.master.arm_bus import ArmBus
from painter.canopen.master.feedback import BusState, Feedback
from painter.canopen.master.setpoints import Setpoint
from painter.canopen.process.mailbox import Mailbox
from painter.canopen.process.realtime import (
    Lateness,
    Ticker,
    freeze_gc,
    lock_memory,
    stay_awake,
    use_fifo,
)
from painter.canopen.process.sample_ring import SampleRing, Samples
from painter.canopen.wire.frame_log import FrameLogger, TappedTransport
from painter.canopen.wire.transports import CanTransport, open_transport
from painter.errors import BusError, PainterError
from painter.timebase import TimeBase

_LOGGER = logging.getLogger(__name__)
_SWITCH_OFF_TIME = 5.0
_STOP_TIME = 1.0
_MOST_COMMANDS = 64
_POINTS_AT_ONCE = 6


@dataclass(frozen=True)
class Report:
    """Content of the mailbox, replaced each cycle.

    Attributes:
        feedback: State of the arm.
        rejection: Why the last command was rejected; empty if it was not.
        lateness: How late cycles began; updated every second.
        is_fifo: Whether the loop runs under SCHED_FIFO.
    """

    feedback: Feedback
    rejection: str = ""
    lateness: Lateness | None = None
    is_fifo: bool = False


class BusLoop:
    """The loop that calls the master in real time; runs in the bus process."""

    def __init__(
        self,
        bus: BusConfig,
        commands: Connection,
        mailbox: Mailbox,
        ring: SampleRing,
        log: Connection | None = None,
        clock: TimeBase | None = None,
    ) -> None:
        """Connects to the bus.

        Args:
            bus: The bus file.
            commands: Source of commands.
            mailbox: Takes the reports.
            ring: Takes the measured joint states.
            log: Pipe of a `FrameLogger`, or None.
            clock: Of the run; None = the machine's.

        Raises:
            PainterError: The transport cannot be opened, or an EDS is unusable.
        """
        self._clock = clock or TimeBase()
        transport = open_transport(bus)
        self._transport: CanTransport = (
            transport if log is None else TappedTransport(transport, log, self._clock)
        )
        self._master = ArmBus(bus, self._transport)
        self._commands = commands
        self._mailbox = mailbox
        self._ticker = Ticker(bus.cycle, self._clock)
        self._master.before_sync = self._ticker.wait_until_due
        self._master.measured = ring.put
        self._rejection = ""
        self._lateness: Lateness | None = None
        self._is_fifo = False
        self._end_at: float | None = None

    def run(self) -> None:
        """Runs until the other side ends it or dies, and the arm is switched off."""
        self._is_fifo = use_fifo()
        freeze_gc()
        lock_memory()
        with stay_awake():
            self._cycle_until_ended()
        self._transport.close()

    def _cycle_until_ended(self) -> None:
        per_second = max(1, round(1.0 / self._ticker.period))
        count = 0
        self._ticker.begin()  # Locking memory took up to a second.
        while not self._has_ended():
            while (remaining := self._ticker.remaining()) > 0.0:
                # Frames between two SYNCs are read at once, so faults act at once.
                now = self._clock.now()
                again = max(0.0, self._clock.machine(self._master.io.repeat_at - now))
                self._master.poll(now, min(remaining, again))
                if self._master.is_lost:  # There is no transport to wait on.
                    time.sleep(self._ticker.remaining())
            due, skipped = self._ticker.tick()
            self._master.cycle(due, overruns=skipped)
            self._take_commands()
            count += 1
            if count % per_second == 0:
                self._lateness = self._ticker.lateness()
            self._mailbox.put(
                Report(
                    self._master.feedback(),
                    self._rejection,
                    self._lateness,
                    self._is_fifo,
                )
            )

    def _has_ended(self) -> bool:
        if self._end_at is None:
            return False
        is_off = self._master.state in (BusState.DOWN, BusState.STOPPED)
        return (is_off and self._master.is_idle) or self._clock.now() > self._end_at

    def _take_commands(self) -> None:
        if self._end_at is not None:
            return
        try:
            for _ in range(_MOST_COMMANDS):
                if not self._commands.poll():
                    return
                self._do(self._commands.recv())
        except (EOFError, OSError):
            self._master.stop("the program that commands the arm has ended.")
            self._end(_STOP_TIME)

    def _do(self, command: tuple[str, Any]) -> None:
        name, argument = command
        try:
            if name == "push":
                self._master.push(argument)
            elif name == "start":
                self._master.start()
            elif name == "stop":
                self._master.stop(argument)
            elif name == "acknowledge":
                self._rejection = ""
                self._master.acknowledge()
            elif name == "end":
                self._end(0.0)
        except (BusError, ValueError) as error:
            self._rejection = str(error)
            if isinstance(error, ValueError):
                self._master.stop(f"setpoints: {error}")

    def _end(self, wait: float) -> None:
        """Lets a stop finish, then switches off."""
        deadline = self._clock.now() + wait
        while self._clock.now() < deadline:
            time.sleep(self._ticker.remaining())
            due, skipped = self._ticker.tick()
            self._master.cycle(due, overruns=skipped)
        self._end_at = self._clock.now() + _SWITCH_OFF_TIME
        self._master.shut_down()


class BusProcess:
    """The diagram's side of the bus; a context manager that switches off on exit."""

    def __init__(
        self,
        bus: BusConfig,
        *,
        log: Path | None = None,
        clock: TimeBase | None = None,
    ) -> None:
        """Starts the process; `start` brings the bus up.

        Args:
            bus: The bus file.
            log: File that gets all frames in candump's format, or None.
            clock: Of the run; None = the machine's.

        Raises:
            InputError: The log cannot be written.
        """
        self.clock = clock or TimeBase()
        self._logger = None if log is None else FrameLogger(log, bus.channel)
        pipe = None if self._logger is None else self._logger.pipe
        context = multiprocessing.get_context("spawn")
        theirs, self._commands = context.Pipe(duplex=False)
        self._mailbox = Mailbox()
        self._ring = SampleRing()
        self._errors, errors = context.Pipe(duplex=False)
        self._process = context.Process(
            target=_run,
            args=(
                bus,
                theirs,
                self._mailbox.name,
                self._ring.name,
                errors,
                pipe,
                self.clock,
            ),
            name="painter bus",
            daemon=False,
        )
        self._process.start()
        theirs.close()
        errors.close()
        if pipe is not None:
            pipe.close()  # So that the log ends when the bus process does.

    def __enter__(self) -> "BusProcess":
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    @property
    def pid(self) -> int:
        """Identifier of the bus process."""
        assert self._process.pid is not None
        return self._process.pid

    @property
    def is_alive(self) -> bool:
        """Whether the bus process runs."""
        return self._process.is_alive()

    def start(self) -> None:
        """Commands bring-up; the feedback shows its progress."""
        self._send("start")

    def push(self, points: Sequence[Setpoint]) -> None:
        """Sends setpoints.

        Raises:
            BusError: The bus process has ended or takes no commands.
        """
        for i in range(0, len(points), _POINTS_AT_ONCE):
            self._send("push", list(points[i : i + _POINTS_AT_ONCE]))

    def stop(self, reason: str) -> None:
        """Commands a controlled stop."""
        self._send("stop", reason)

    def acknowledge(self) -> None:
        """Commands a restart after a stop; the report holds a rejection."""
        self._send("acknowledge")

    def report(self) -> Report | None:
        """Returns the newest report; None before the first one.

        Raises:
            BusError: The bus process has ended; gives the cause if known.
        """
        if not self._process.is_alive():
            raise BusError(
                f"the bus process has ended: {self._exit_cause()}", code="PNT-BUS-019"
            )
        found = self._mailbox.get()
        return None if found is None else found[1]

    def samples(self, since: float) -> Samples:
        """Returns samples after a time, s on the clock of the bus."""
        return self._ring.since(since)

    def now(self) -> float:
        """Returns the clock of the bus, s."""
        return self.clock.now()

    def wait_until(self, when: float) -> None:
        """Waits until a time, s, of the clock of the bus."""
        self.clock.sleep(when - self.clock.now())

    def close(self) -> None:
        """Switches the arm off and ends the process."""
        with contextlib.suppress(BusError):
            self._send("end")
        self._process.join(self.clock.machine(_SWITCH_OFF_TIME + _STOP_TIME))
        if self._process.is_alive():
            _LOGGER.error("the bus process did not end and was killed.")
            self._process.kill()
            self._process.join()
        self._commands.close()
        self._mailbox.close()
        self._ring.close()
        if self._logger is not None:
            self._logger.close()

    def _send(self, name: str, argument: object = None) -> None:
        # A writable pipe has room for 4096 bytes (POSIX: PIPE_BUF), and no command is
        # longer: this never waits.
        _, ready, _ = select.select([], [self._commands], [], 0.0)
        if not ready:
            raise BusError(
                "the bus process takes no commands: its pipe is full.",
                code="PNT-BUS-020",
            )
        try:
            self._commands.send((name, argument))
        except (BrokenPipeError, OSError) as error:
            raise BusError(
                f"the bus process has ended: {self._exit_cause()}", code="PNT-BUS-021"
            ) from error

    def _exit_cause(self) -> str:
        with contextlib.suppress(EOFError, OSError):
            if self._errors.poll():
                return str(self._errors.recv())
        return f"exit code {self._process.exitcode}."


def _run(
    bus: BusConfig,
    commands: Connection,
    mailbox_name: str,
    ring_name: str,
    errors: Connection,
    log: Connection | None,
    clock: TimeBase,
) -> None:
    """Runs the bus process; the parent handles Ctrl-C and then ends the pipe."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    mailbox, ring = Mailbox(name=mailbox_name), SampleRing(name=ring_name)
    try:
        BusLoop(bus, commands, mailbox, ring, log, clock).run()
    except PainterError as error:
        errors.send(str(error))
        os._exit(1)
    finally:
        mailbox.close()
        ring.close()
