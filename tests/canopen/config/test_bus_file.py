import os
import shutil
from pathlib import Path

import pytest
import yaml

from painter.canopen.config.bus_file import choose_mode, load_bus
from painter.canopen.config.device import Mode, read_device
from painter.errors import InputError
from painter.resources import models_path

DATA = Path(os.environ.get("PAINTER_DATA", "../shared/data")) / "eds"
pytestmark = pytest.mark.skipif(
    not DATA.is_dir(), reason=f"no device descriptions in {DATA}; set PAINTER_DATA"
)
PAINTER = models_path("bus", "painter.bus.yaml")


def write(tmp_path, change):
    """Writes the robot's bus file with its fields changed by `change`."""
    fields = yaml.safe_load(PAINTER.read_text())
    change(fields)
    path = tmp_path / "x.bus.yaml"
    path.write_text(yaml.safe_dump(fields))
    for file in DATA.glob("*.[de]*"):
        shutil.copy(file, tmp_path)
    return path


def test_the_robots_bus_loads_with_the_models_limits():
    bus = load_bus(PAINTER)
    assert bus.cycle == 0.005
    assert [drive.node_id for drive in bus.axis_drives()] == [1, 2, 3, 4, 5]
    assert bus.drives["wrist_right"].sign == -1


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda f: f["drives"].pop("elbow_pitch"), "drives.elbow_pitch is missing"),
        (lambda f: f["drives"]["base_yaw"].update(gaer=1), "base_yaw.gaer is unknown"),
        (
            lambda f: f["drives"]["base_yaw"].update(gear=-1),
            "base_yaw.gear must be > 0",
        ),
        (lambda f: f["drives"]["base_yaw"].update(gear="a"), "gear must be a number"),
        (lambda f: f["drives"]["base_yaw"].update(sign=2), "sign must be one of 1, -1"),
        (lambda f: f["drives"]["base_yaw"].update(node_id=2), "must be other than"),
        (lambda f: f["drives"]["base_yaw"].update(node_id=200), "must be 1 to 127"),
        (lambda f: f["drives"]["base_yaw"].pop("gear"), "base_yaw.gear is missing"),
        (
            lambda f: f["drives"]["base_yaw"].update(velocity_unit="deg"),
            "velocity_unit must be one of counts/s, rpm",
        ),
        (
            lambda f: f["drives"]["base_yaw"].update(options={"quick_stop": 9}),
            "base_yaw.options.quick_stop must be one of 0, 1",
        ),
        (lambda f: f["drives"]["base_yaw"].update(eds="no.eds"), "no such EDS"),
        (lambda f: f["joints"]["wrist_yaw"].update(q_min=2.0), "q_min must be < q_max"),
        (lambda f: f.update(bitrate=9600), "bitrate must be one of"),
        (lambda f: f.update(cycle=0.0055), "cycle must be whole milliseconds"),
        (lambda f: f.update(timeouts={"tpdo": 0.001}), "tpdo must be >= 2 cycles"),
        (lambda f: f.update(path="x"), "path is unknown"),
        (lambda f: f.update(io=3), "io must have fields"),
    ],
)
def test_an_error_names_file_and_field(tmp_path, change, message):
    path = write(tmp_path, change)
    with pytest.raises(InputError, match=message) as caught:
        load_bus(path)
    assert str(tmp_path) in str(caught.value)


def test_a_missing_or_broken_file_is_one_error(tmp_path):
    with pytest.raises(InputError, match="no such bus file"):
        load_bus(tmp_path / "none.yaml")
    (tmp_path / "bad.yaml").write_text("{")
    with pytest.raises(InputError, match=r"bad\.yaml"):
        load_bus(tmp_path / "bad.yaml")


@pytest.mark.parametrize(
    ("file", "mode"),
    [
        ("maxon_epos4_50_15.dcf", Mode.CYCLIC_SYNC_POSITION),
        ("zeroerr_erob.eds", Mode.CYCLIC_SYNC_POSITION),
        ("schunk_erb_0_63.dcf", Mode.INTERPOLATED_POSITION),
    ],
)
def test_mode_is_csp_else_ip(file, mode):
    assert choose_mode(read_device(DATA / file, 1)) == mode


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"eds": "maxon_epos4_50_15.dcf"}, "velocity_unit is counts/s, but 60A9h"),
        (
            {"eds": "zeroerr_erob.eds", "homing": {"kind": "drive"}},
            "homing.kind: .* has no homing mode",
        ),
        (
            {"eds": "schunk_erb_0_63.dcf", "homing": {"kind": "drive"}},
            "homing.kind: .* has no homing mode",
        ),
        ({"eds": "zeroerr_erob.eds", "identity": {"vendor": 1}}, "identity.vendor"),
    ],
)
def test_a_drive_that_lacks_a_function_is_rejected_with_the_reason(
    tmp_path, fields, message
):
    def change(f):
        f["drives"]["base_yaw"]["identity"] = {}
        f["drives"]["base_yaw"].update(fields)

    with pytest.raises(InputError, match=message):
        load_bus(write(tmp_path, change))


def test_three_makers_load_on_one_bus(tmp_path):
    def change(f):
        for axis, file in (
            ("base_yaw", "maxon_epos4_50_15.dcf"),
            ("shoulder_pitch", "zeroerr_erob.eds"),
            ("elbow_pitch", "schunk_erb_0_63.dcf"),
        ):
            f["drives"][axis].update(eds=file, identity={})
        f["drives"]["base_yaw"].update(velocity_unit="rpm", acceleration_unit="rpm/s")

    bus = load_bus(write(tmp_path, change))
    assert bus.drive_limits()[0].profile_velocity == bus.drive_limits()[0].motor_speed
