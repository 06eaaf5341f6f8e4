"""The arm's plant under simulated drives: held by brakes, held by motors, moved."""

import numpy as np
import pytest

from painter.canopen.config.bus_file import load_bus
from painter.canopen.master.arm_bus import ArmBus
from painter.canopen.master.feedback import BusState
from painter.canopen.sim.faults import Fault
from painter.canopen.sim.rack import Rack
from painter.config import load_scenario
from painter.rehearsal.arm_load import ArmLoad
from painter.resources import models_path
from tests.canopen.conftest import Lab


@pytest.fixture
def lab():
    """Drives that carry the arm in its home pose, switched off."""
    lab = Lab()
    lab.rack = Rack(lab.bus, ArmLoad(load_scenario("cubes")))
    lab.master = ArmBus(lab.bus, lab.rack.transport)
    return lab


def axes(lab):
    return [drive.motor.position for drive in lab.rack.drives.values()]


def test_the_arm_does_not_sag_while_its_brakes_open(lab):
    home = np.deg2rad(load_scenario("cubes").motion.home_deg)
    positions = []
    lab.master.start()
    while lab.master.state == BusState.STARTING:
        lab.step()
        positions.append(axes(lab))
    assert lab.master.state == BusState.ENABLED, lab.master.reason
    np.testing.assert_allclose(lab.master.feedback().q, home, atol=1e-5)
    counts = 65536 * 100 / (2 * np.pi)
    # Unpowered for 0.1 s at a tenth of gravity, a joint would turn by 5 mrad.
    assert np.ptp(positions, axis=0).max() / counts < 5e-5


def test_the_arm_is_where_its_setpoints_say(lab):
    lab.bring_up()
    samples = []
    lab.master.measured = lambda *sample: samples.append(sample)
    lab.sway(0.12)
    path, start = lab.path, lab.now
    lab.run(2.5)
    error = np.array([q - path(t)[0] for t, q, _, _ in samples if t > start + 0.5])
    assert len(error) > 350
    # 0.38 rad/s: one cycle of lag would be 1.9 mrad.
    assert np.abs(error).max() < 2e-4


def test_an_axis_that_is_held_stays_and_trips(lab):
    lab.bring_up().sway(0.12)
    lab.run(0.4)
    lab.rack.inject(Fault.FOLLOWING_ERROR, "base_yaw")
    held = lab.rack.drives["base_yaw"].motor.position
    lab.until(lambda: lab.master.state == BusState.STOPPED, 1.0)
    assert "base_yaw: EMCY 8611h, following error" in lab.master.reason
    lab.run(0.5)
    counts = 65536 * 100 / (2 * np.pi)
    # It brakes as hard as the position loop can: 0.36 rad/s and 40 rad/s of bandwidth.
    assert abs(lab.rack.drives["base_yaw"].motor.position - held) / counts < 0.36 / 40


def test_load_and_bus_begin_in_the_same_pose():
    bus = load_bus(models_path("bus", "painter.bus.yaml"))
    load = ArmLoad(load_scenario("cubes"))
    rack = Rack(bus, load)
    units = [drive.units() for drive in bus.axis_drives()]
    angles = [
        u.angle(d.motor.position)
        for u, d in zip(units, rack.drives.values(), strict=True)
    ]
    np.testing.assert_allclose(angles, load.axes()[0], atol=1e-12)
