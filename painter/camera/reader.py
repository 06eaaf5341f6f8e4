"""Reads a camera in a thread of its own: newest picture, health, reconnection."""

import enum
import importlib.util
import logging
import threading
from collections.abc import Callable
from dataclasses import dataclass, field, replace

from painter.camera.clock import CameraClock
from painter.camera.config import CameraDriverConfig
from painter.camera.frames import Camera, CameraError, CameraFrame, FrameSource
from painter.errors import InputError
from painter.timebase import TimeBase
from perception.depth_camera.depth import CameraIntrinsics

_LOGGER = logging.getLogger(__name__)
_WAIT = 0.1


class CameraState(enum.StrEnum):
    """State of the camera."""

    STARTING = "starting"
    STREAMING = "streaming"
    MISSING = "missing"  # The reader tries to reopen it.
    LOST = "lost"  # All tries have failed.


@dataclass(frozen=True)
class CameraHealth:
    """State of the camera and counts since the reader began.

    Attributes:
        state: Of the camera.
        problem: Why no pictures arrive; empty while they do.
        pictures: Pictures taken over.
        repeated: Pictures dropped because they were not newer than the last one.
        late: Pictures dropped because they were too old on arrival.
        skipped: Pictures that the camera took and this computer never received.
        reconnects: How often the camera was reopened.
    """

    state: CameraState = CameraState.STARTING
    problem: str = ""
    pictures: int = 0
    repeated: int = 0
    late: int = 0
    skipped: int = 0
    reconnects: int = 0


@dataclass(frozen=True, eq=False)
class Reading:
    """Newest picture of a camera.

    Attributes:
        frame: The picture; None before the first.
        taken: When it was taken, by the reader's clock, s.
        health: Of the camera.
    """

    frame: CameraFrame | None = None
    taken: float = 0.0
    health: CameraHealth = field(default_factory=CameraHealth)


def camera_opener(
    config: CameraDriverConfig,
    wanted: CameraIntrinsics,
    *,
    baseline: float,
    source: FrameSource | None = None,
) -> Callable[[], Camera]:
    """Returns a function that opens the camera of a scenario.

    Args:
        config: Settings of the driver.
        wanted: Intrinsics of the returned pictures.
        baseline: Of the stereo imagers, m.
        source: Feeds librealsense's software device in place of a camera, or None.

    Raises:
        InputError: pyrealsense2 is not installed.
    """
    if importlib.util.find_spec("pyrealsense2") is None:
        raise InputError(
            "the camera needs pyrealsense2; install it with: "
            "pip install 'painter[hardware]'.",
            code="PNT-CAMERA-003",
        )
    from painter.camera import realsense, software

    if source is not None:
        return lambda: software.SoftwareCamera(
            source, config, wanted, baseline=baseline
        )
    if config.recording:
        return lambda: realsense.open_recording(config, wanted)
    return lambda: realsense.open_device(config, wanted)


class CameraReader:
    """The reader thread; a context manager that releases the camera on exit."""

    def __init__(
        self,
        open_camera: Callable[[], Camera],
        config: CameraDriverConfig,
        clock: TimeBase | None = None,
    ) -> None:
        """Starts reading.

        Args:
            open_camera: Opens the camera, also after a loss.
            config: Latency, ages and tries.
            clock: Of the run; None = the machine's.
        """
        self._clock = clock or TimeBase()
        self._open_camera = open_camera
        self._config = config
        self._reading = Reading()
        self._end = threading.Event()
        self._thread = threading.Thread(
            target=self._run, name="painter camera", daemon=True
        )
        self._thread.start()

    def __enter__(self) -> "CameraReader":
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def read(self) -> Reading:
        """Returns the newest reading; never waits."""
        return self._reading  # One reference, replaced whole.

    def close(self) -> None:
        """Ends the thread and releases the camera."""
        self._end.set()
        self._thread.join()

    def _run(self) -> None:
        config, tries = self._config, 0
        while not self._end.is_set():
            count = self._reading.health.pictures
            try:
                self._stream()
            except CameraError as error:
                problem = str(error)
            else:
                return
            tries = 0 if self._reading.health.pictures > count else tries
            _LOGGER.warning("%s", problem)
            if tries >= config.retries:
                self._set_health(
                    state=CameraState.LOST,
                    problem=f"{problem} Given up after {tries} tries.",
                )
                return
            tries += 1
            self._set_health(
                state=CameraState.MISSING,
                problem=f"{problem} Reopening, try {tries} of {config.retries}.",
                reconnects=self._reading.health.reconnects + 1,
            )
            self._end.wait(config.retry_period)

    def _stream(self) -> None:
        """Opens the camera and takes its pictures until the reader is closed."""
        camera = self._open_camera()
        clock, number = CameraClock(self._config.latency), None
        heard = self._clock.now()
        try:
            while not self._end.is_set():
                frame = camera.wait(_WAIT)
                now = self._clock.now()
                if frame is None:
                    if now - heard > self._config.silence:
                        raise CameraError(
                            f"camera: no picture for {self._config.silence:g} s.",
                            code="PNT-CAMERA-004",
                        )
                    continue
                heard = now
                self._take(frame, clock.map(frame.time, now), now, number)
                number = frame.number
        finally:
            camera.close()

    def _take(
        self, frame: CameraFrame, taken: float | None, now: float, number: int | None
    ) -> None:
        health = self._reading.health
        missed = 0 if number is None else max(0, frame.number - number - 1)
        health = replace(health, skipped=health.skipped + missed)
        if taken is None:
            health = replace(health, repeated=health.repeated + 1)
        elif now - taken > self._config.max_age:
            health = replace(health, late=health.late + 1)
        else:
            health = replace(
                health,
                state=CameraState.STREAMING,
                problem="",
                pictures=health.pictures + 1,
            )
            self._reading = Reading(frame, taken, health)
            return
        self._reading = replace(self._reading, health=health)

    def _set_health(self, **changes: object) -> None:
        health = replace(self._reading.health, **changes)  # type: ignore[arg-type]
        self._reading = replace(self._reading, health=health)
