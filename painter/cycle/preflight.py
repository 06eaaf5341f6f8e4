"""Checks before the arm moves, each with a name and a result."""

import shutil
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from painter.camera.reader import CameraState, Reading
from painter.canopen.config.bus_config import BusConfig
from painter.canopen.config.units import JOINTS
from painter.canopen.master.feedback import BusState
from painter.canopen.process.robot_clock import Bus
from painter.config import Scenario
from painter.errors import BusError
from painter.robot.robot_model import MakeRobotModel

# A run takes some 10 MB, a log of the bus 15 MB a minute; bytes.
LEAST_DISK = 1 << 30
OLDEST_PICTURE = 1.0  # s.
# A joint that moves faster than this does not stand still, rad/s.
STILL = 0.01
# Largest difference between the joint ranges of bus file and model, rad.
SAME_RANGE = 0.01
# Time within which the first picture must come and the drives be enabled, s.
CAMERA_TIME = 15.0
BRING_UP_TIME = 60.0
# The bus renews the lateness of its cycles every second, s.
SETTLE = 1.2


@dataclass(frozen=True)
class Check:
    """One check.

    Attributes:
        name: Of the check.
        passed: Whether it passed.
        text: What was found.
    """

    name: str
    passed: bool
    text: str


def preflight(
    scenario: Scenario,
    bus_config: BusConfig,
    bus: Bus,
    read_camera: Callable[[], Reading],
    out: Path,
) -> Iterator[Check]:
    """Checks everything in order; the drives are enabled on the way.

    The caller stops at the first check that fails: later ones depend on it.

    Args:
        scenario: The job.
        bus_config: The bus file.
        bus: Not yet started.
        read_camera: Returns the camera's newest reading.
        out: Run folder to be written.
    """
    yield check_disk(out)
    yield check_calibration(scenario, bus_config)
    yield _check_camera(scenario, read_camera)
    yield _check_drives(bus)
    yield _check_homing(bus, bus_config)
    yield _check_clock(bus, bus_config, read_camera)


def check_disk(out: Path) -> Check:
    """Checks the free disk space for a run and its logs."""
    folder = out.absolute()
    while not folder.exists():
        folder = folder.parent
    free = shutil.disk_usage(folder).free
    text = f"{free / 2**30:.1f} GiB free at {folder}, {LEAST_DISK / 2**30:g} GiB needed"
    return Check("disk", free >= LEAST_DISK, text)


def check_calibration(scenario: Scenario, bus: BusConfig) -> Check:
    """Checks that bus file and arm model give the joints the same ranges."""
    limits = MakeRobotModel(scenario).limits
    joints = bus.joint_limits()
    apart = np.array(
        [
            [abs(joint.q_min - low), abs(joint.q_max - high)]
            for joint, low, high in zip(joints, limits.q_min, limits.q_max, strict=True)
        ]
    )
    worst = int(apart.max(axis=1).argmax())
    text = (
        f"joint ranges of bus file and model differ by up to {apart.max():.4f} rad "
        f"({JOINTS[worst]}); limit {SAME_RANGE:g} rad"
    )
    return Check("calibration", bool(apart.max() <= SAME_RANGE), text)


def _check_camera(scenario: Scenario, read: Callable[[], Reading]) -> Check:
    stereo = scenario.wall_camera.stereo
    end = time.monotonic() + CAMERA_TIME
    reading = read()
    while reading.health.state != CameraState.STREAMING and time.monotonic() < end:
        time.sleep(0.05)
        reading = read()
    if reading.frame is None:
        text = reading.health.problem or f"no picture in {CAMERA_TIME:g} s"
        return Check("camera", False, text)
    shape = reading.frame.depth_mm.shape
    text = f"pictures of {shape[1]} x {shape[0]} px"
    if shape != (stereo.height, stereo.width):
        text += f", the scenario has {stereo.width} x {stereo.height} px"
    return Check("camera", shape == (stereo.height, stereo.width), text)


def _check_drives(bus: Bus) -> Check:
    """Starts the bus and waits until the master has enabled the drives."""
    try:
        bus.start()
        end = bus.now() + BRING_UP_TIME
        while bus.now() < end:
            bus.wait_until(bus.now() + 0.05)
            report = bus.report()
            if report is None:
                continue
            feedback = report.feedback
            if feedback.bus_state == BusState.ENABLED:
                axes = ", ".join(axis.name for axis in feedback.axes)
                return Check("drives", True, f"configured, read back, enabled: {axes}")
            if feedback.bus_state == BusState.STOPPED:
                return Check("drives", False, feedback.reason)
    except BusError as error:
        return Check("drives", False, str(error))
    return Check("drives", False, f"not enabled within {BRING_UP_TIME:g} s")


def _check_homing(bus: Bus, config: BusConfig) -> Check:
    """Checks that the homed joints stand still inside their ranges."""
    report = bus.report()
    assert report is not None
    q, v = report.feedback.q, report.feedback.v
    for name, limits, angle, speed in zip(
        JOINTS, config.joint_limits(), q, v, strict=True
    ):
        if not limits.q_min <= angle <= limits.q_max:
            return Check(
                "homing",
                False,
                f"{name} is at {angle:.3f} rad, outside {limits.q_min:g} to "
                f"{limits.q_max:g} rad: its zero is wrong",
            )
        if abs(speed) > STILL:
            return Check("homing", False, f"{name} moves at {speed:.3f} rad/s")
    shown = ", ".join(f"{angle:.1f}" for angle in np.rad2deg(q))
    return Check("homing", True, f"joints at {shown} deg")


def _check_clock(bus: Bus, config: BusConfig, read: Callable[[], Reading]) -> Check:
    """Checks that SYNC is on time and the pictures are recent."""
    bus.wait_until(bus.now() + SETTLE)
    report, reading = bus.report(), read()
    assert report is not None
    late = report.lateness
    age = bus.now() - reading.taken
    text = f"newest picture {age:.2f} s old"
    passed = 0.0 <= age <= OLDEST_PICTURE
    if late is not None:
        text += f", SYNC late by {1e3 * late.p50:.2f} ms (median), "
        text += f"{1e3 * late.p99:.2f} ms (99 %)"
        passed = passed and late.p50 < 0.5 * config.cycle
    if not report.is_fifo:
        text += ", no SCHED_FIFO"
    return Check("clock", passed, text)
