"""Drives of three makers, made from their own EDS files, on one bus."""

import os
import shutil
from pathlib import Path

import numpy as np
import pytest
import yaml

from painter.canopen.config.bus_file import load_bus
from painter.canopen.config.device import Mode
from painter.canopen.master.feedback import BusState
from painter.canopen.protocol.cia402 import State
from painter.canopen.sim.faults import Fault
from painter.errors import InputError
from painter.resources import models_path

DATA = Path(os.environ.get("PAINTER_DATA", "../shared/data")) / "eds"
pytestmark = pytest.mark.skipif(
    not DATA.is_dir(), reason=f"no device descriptions in {DATA}; set PAINTER_DATA"
)
RPM = {"velocity_unit": "rpm", "acceleration_unit": "rpm/s"}
# Counts a turn that keep the position of a joint's range in 32 bits, as all do.
MAKERS = {
    "base_yaw": {"eds": "maxon_epos4_50_15.dcf", "counts_per_turn": 4096, **RPM},
    "shoulder_pitch": {"eds": "zeroerr_erob.eds", "counts_per_turn": 4096, **RPM},
    "elbow_pitch": {"eds": "schunk_erb_0_63.dcf"},
}


def write_bus(tmp_path, drives):
    fields = yaml.safe_load(models_path("bus", "painter.bus.yaml").read_text())
    for axis, changes in drives.items():
        fields["drives"][axis].update({"identity": {}, **changes})
    for file in DATA.glob("*.[de]*"):
        shutil.copy(file, tmp_path)
    path = tmp_path / "makers.bus.yaml"
    path.write_text(yaml.safe_dump(fields))
    return path


@pytest.fixture
def makers(make_lab, tmp_path):
    return make_lab(load_bus(write_bus(tmp_path, MAKERS)))


def test_three_makers_configure_enable_and_move(makers):
    lab = makers.bring_up()
    modes = [drive.store.number(0x6060) for drive in lab.rack.drives.values()]
    assert modes[:3] == [
        Mode.CYCLIC_SYNC_POSITION,
        Mode.CYCLIC_SYNC_POSITION,
        Mode.INTERPOLATED_POSITION,
    ]
    lab.sway()
    lab.run(1.05)
    # 4096 counts a turn through 1:100 are 1.5e-5 rad; the rest is the cubic's end.
    np.testing.assert_allclose(lab.master.feedback().q, 0.4, atol=2e-3)
    # Half way, 0.63 rad/s: 606Ch in rpm and in counts/s give the same speed.
    lab.run(0.5)
    v = lab.master.feedback().v
    np.testing.assert_allclose(v, v[3], atol=0.02)
    assert abs(v[3]) > 0.4


def test_rpm_drives_get_rpm(makers):
    lab = makers.bring_up()
    rpm = 2.0 * 100 * 60 / (2 * np.pi)  # 2 rad/s through 1:100.
    maxon = lab.rack.drives["base_yaw"].store
    assert maxon.number(0x607F) == np.ceil(rpm)
    assert maxon.number(0x6080) == np.ceil(rpm)
    # The quick stop's 20 rad/s2 in rpm/s.
    assert maxon.number(0x6085) == np.floor(20.0 * 100 * 60 / (2 * np.pi))


def test_objects_that_a_drive_lacks_are_noted(makers):
    notes = {d.name: " ".join(d.plan.notes) for d in makers.master.drives}
    assert "607Fh" in notes["elbow_pitch"]
    assert "only the host enforces this limit" in notes["elbow_pitch"]
    assert "605Ah (quick stop option)" in notes["shoulder_pitch"]
    assert "6007h (abort connection option)" in notes["shoulder_pitch"]
    assert "6066h (following error time) is fixed to 0" in notes["base_yaw"]
    assert notes["wrist_left"] == ""


@pytest.mark.parametrize("axis", ["base_yaw", "shoulder_pitch", "elbow_pitch"])
def test_each_maker_stops_with_the_others(makers, axis):
    lab = makers.bring_up().sway()
    lab.trigger = 1.0
    lab.run(0.5)
    lab.rack.inject(Fault.EMCY, axis)
    lab.run(1.0)
    assert axis in lab.master.reason
    for drive in lab.rack.drives.values():
        assert abs(drive.motor.velocity) < 1.0
    # Without 605Ah the drive goes to SWITCH ON DISABLED when it has stopped.
    held = {"base_yaw", "wrist_left", "wrist_right"} - {axis}
    assert all(lab.rack.drives[name].state == State.QUICK_STOP for name in held)
    assert lab.rack.io.outputs == 0
    lab.path = None
    lab.master.acknowledge()
    lab.until(lambda: lab.master.state != BusState.STARTING)
    assert lab.master.state == BusState.ENABLED, lab.master.reason


def test_a_value_beyond_the_drives_range_is_rejected(make_lab, tmp_path):
    fast = {"base_yaw": {**MAKERS["base_yaw"], "gear": 5000}}
    bus = load_bus(write_bus(tmp_path, fast))
    with pytest.raises(InputError, match="607Fh:0. must be 1 to 50000, got 95493"):
        make_lab(bus)


def test_homing_in_the_drives(make_lab, tmp_path):
    homing = {"kind": "drive", "method": 17, "speed_switch": 0.5, "offset": 0.25}
    bus = load_bus(
        write_bus(tmp_path, {"base_yaw": {"homing": homing}, "wrist_right": {
            "homing": {"kind": "drive", "method": 37}}})
    )  # fmt: skip
    lab = make_lab(bus)
    units = bus.drives["base_yaw"].units()
    lab.rack.drives["base_yaw"].home_switch = units.counts(0.3)
    lab.rack.drives["wrist_right"].motor.position = 4321.0
    lab.bring_up()
    # The switch is at 0.3 rad of the motor; the drive calls it 0.25 rad.
    q = lab.master.feedback().q
    assert lab.rack.drives["base_yaw"].motor.position == pytest.approx(
        units.counts(0.3), abs=2
    )
    assert q[0] == pytest.approx(0.25, abs=1e-5)
    np.testing.assert_allclose(q[3:], 0.0, atol=1e-5)
    lab.sway()
    lab.run(1.05)
    assert lab.master.feedback().q[0] == pytest.approx(0.65, abs=2e-3)


def test_homing_that_takes_too_long_stops(make_lab, tmp_path):
    homing = {"kind": "drive", "method": 1, "speed_switch": 0.01, "timeout": 1.0}
    lab = make_lab(load_bus(write_bus(tmp_path, {"base_yaw": {"homing": homing}})))
    lab.rack.drives["base_yaw"].home_switch = 1e6
    lab.master.start()
    lab.until(lambda: lab.master.state != BusState.STARTING)
    assert "base_yaw: homing 1 not done within 1 s" in lab.master.reason
    lab.run(0.5)
    assert lab.rack.drives["base_yaw"].state == State.QUICK_STOP


def test_a_value_that_reads_back_differently_ends_bring_up(make_lab):
    lab = make_lab()
    store = lab.rack.drives["elbow_pitch"].store
    # A drive that rounds its ramp without an abort.
    store.written = lambda i, sub, v: i == 0x6085 and store.set(i, sub, int(v) // 2)
    lab.master.start()
    lab.until(lambda: lab.master.state != BusState.STARTING)
    assert "elbow_pitch: quick stop deceleration (6085h:0) was written" in (
        lab.master.reason
    )


def test_lost_sdo_answers_are_asked_for_again(make_lab):
    lab = make_lab()
    drive = lab.rack.drives["base_yaw"]
    answer, dropped = drive.sdo.answer, []

    def lossy(request):
        if len(dropped) < 10 and lab.cycles % 3 == 0:
            dropped.append(request)
            return None
        return answer(request)

    drive.sdo.answer = lossy
    lab.bring_up()
    assert len(dropped) == 10
    assert lab.master.feedback().statistics.retries >= 5


def test_stored_configuration_is_there_after_a_reset(make_lab, tmp_path):
    lab = make_lab(load_bus(write_bus(tmp_path, {"base_yaw": {"store": True}})))
    lab.bring_up()
    for name in ("base_yaw", "elbow_pitch"):
        lab.rack.drives[name].reboot()
    window = lab.bus.drive_limits()[0].following_error
    assert lab.rack.drives["base_yaw"].store.number(0x6065) == window
    assert lab.rack.drives["elbow_pitch"].store.number(0x6065) == 2000
