"""Checks before the arm moves: each passes on a sound robot and names its fault."""

import dataclasses
import shutil
from collections import namedtuple

import numpy as np
import pytest

from painter.camera.frames import CameraFrame
from painter.camera.reader import CameraHealth, CameraState, Reading
from painter.canopen.config.bus_file import load_bus
from painter.canopen.master.feedback import BusState
from painter.canopen.process.realtime import Lateness
from painter.config import Scenario
from painter.cycle import preflight as module
from painter.cycle.preflight import check_calibration, check_disk, preflight
from painter.errors import BusError
from painter.resources import models_path
from tests.cycle.scripted_bus import ScriptedBus, feedback

HOME = np.deg2rad(Scenario().motion.home_deg)
# From begin at 100 s: 0.05 s of bring-up and the 1.2 s over which lateness is measured.
CLOCK_CHECK = 101.25


@pytest.fixture(scope="module")
def bus_config():
    return load_bus(models_path("bus", "painter.bus.yaml"))


def picture(taken=CLOCK_CHECK - 0.25, shape=None):
    """A reading with a picture of the scenario's size."""
    stereo = Scenario().wall_camera.stereo
    depth = np.zeros(shape or (stereo.height, stereo.width), dtype=np.uint16)
    health = CameraHealth(state=CameraState.STREAMING, pictures=1)
    return Reading(CameraFrame(depth, None, 0.0, 1), taken, health)


def checks(bus_config, out, *, bus=None, reading=None):
    """All checks, whether they pass or not."""
    bus = bus or ScriptedBus(lambda time: feedback(time, q=HOME))
    reading = reading or picture()
    found = preflight(Scenario(), bus_config, bus, lambda: reading, out)
    return {check.name: check for check in found}


def test_a_sound_robot_passes_all_checks_in_their_order(bus_config, tmp_path):
    found = checks(bus_config, tmp_path)
    assert list(found) == ["disk", "calibration", "camera", "drives", "homing", "clock"]
    assert [check for check in found.values() if not check.passed] == []
    shown = ", ".join(f"{angle:.1f}" for angle in Scenario().motion.home_deg)
    assert shown in found["homing"].text
    assert "0.25 s old" in found["clock"].text


def test_a_full_disk_is_found_where_the_run_will_be(tmp_path, monkeypatch):
    usage = namedtuple("usage", "total used free")
    asked = []

    def disk_usage(path):
        asked.append(path)
        return usage(0, 0, 3 << 28)  # 0.75 GiB.

    monkeypatch.setattr(shutil, "disk_usage", disk_usage)
    check = check_disk(tmp_path / "not" / "yet")
    assert asked == [tmp_path]
    assert not check.passed
    assert check.text == f"0.8 GiB free at {tmp_path}, 1 GiB needed"


def test_a_joint_with_another_range_than_the_model_is_named(bus_config):
    joints = dict(bus_config.joints)
    elbow = joints["elbow_pitch"]
    assert check_calibration(Scenario(), bus_config).passed
    joints["elbow_pitch"] = dataclasses.replace(elbow, q_max=elbow.q_max - 0.02)
    check = check_calibration(
        Scenario(), dataclasses.replace(bus_config, joints=joints)
    )
    assert not check.passed
    assert "0.02" in check.text
    assert "elbow_pitch" in check.text


def test_a_camera_with_other_pictures_is_refused(bus_config, tmp_path):
    check = checks(bus_config, tmp_path, reading=picture(shape=(240, 424)))["camera"]
    assert not check.passed
    assert check.text == "pictures of 424 x 240 px, the scenario has 848 x 480 px"


def test_a_camera_without_pictures_says_why(bus_config, tmp_path, monkeypatch):
    monkeypatch.setattr(module, "CAMERA_TIME", 0.1)
    for problem, text in (("camera: unplugged.", "unplugged"), ("", "no picture in")):
        health = CameraHealth(state=CameraState.MISSING, problem=problem)
        found = checks(bus_config, tmp_path, reading=Reading(health=health))
        assert not found["camera"].passed
        assert text in found["camera"].text


def test_drives_that_stop_or_never_start_are_refused(bus_config, tmp_path):
    def stopped(time):
        reason = "elbow_pitch: wrong device"
        return feedback(time, q=HOME, bus_state=BusState.STOPPED, reason=reason)

    def starting(time):
        return feedback(time, q=HOME, bus_state=BusState.STARTING)

    for at, text in (
        (stopped, "elbow_pitch: wrong device"),
        (starting, "not enabled within 60 s"),
    ):
        check = checks(bus_config, tmp_path, bus=ScriptedBus(at))["drives"]
        assert (check.passed, check.text) == (False, text)


def test_a_bus_that_has_ended_is_named(bus_config, tmp_path):
    class Dead(ScriptedBus):
        def start(self):
            raise BusError("the bus process has ended.", code="PNT-TEST-001")

    bus = Dead(lambda time: feedback(time, q=HOME))
    check = checks(bus_config, tmp_path, bus=bus)["drives"]
    assert (check.passed, check.text) == (False, "the bus process has ended.")


def test_a_joint_out_of_its_range_or_moving_is_named(bus_config, tmp_path):
    beyond = HOME.copy()
    beyond[2] = bus_config.joints["elbow_pitch"].q_max + 0.1
    moving = np.array([0.0, 0.02, 0.0, 0.0, 0.0])
    for changes, text in (
        ({"q": beyond}, "elbow_pitch is at"),
        ({"q": HOME, "v": moving}, "shoulder_pitch moves at 0.020 rad/s"),
    ):
        bus = ScriptedBus(lambda time, c=changes: feedback(time, **c))
        check = checks(bus_config, tmp_path, bus=bus)["homing"]
        assert not check.passed
        assert text in check.text


def test_old_pictures_and_late_cycles_fail_the_clock(bus_config, tmp_path):
    def late(share):
        """Lateness with a median of a share of the cycle."""
        p50 = share * bus_config.cycle
        return Lateness(count=200, p50=p50, p99=p50, p999=p50, worst=p50)

    for taken, lateness, passed in (
        (CLOCK_CHECK - 0.9, late(0.4), True),
        (CLOCK_CHECK - 1.1, None, False),
        # Taken in the future: another clock.
        (CLOCK_CHECK + 0.1, None, False),
        (CLOCK_CHECK - 0.1, late(0.6), False),
    ):
        bus = ScriptedBus(
            lambda time: feedback(time, q=HOME), lateness=lateness, is_fifo=False
        )
        reading = picture(taken=taken)
        check = checks(bus_config, tmp_path, bus=bus, reading=reading)["clock"]
        assert check.passed == passed, check.text
        assert check.text.endswith(", no SCHED_FIFO")
