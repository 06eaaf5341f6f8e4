"""The simulated station: the contract's ports, a quiet hold, tracking, pictures."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import (
    ConstantVectorSource,
    LogVectorOutput,
    TrajectorySource,
)
from pydrake.trajectories import PiecewisePolynomial

from painter.config import load_scenario
from painter.diagrams.station import CheckStation, MakeStation
from painter.errors import PortTypeError


@pytest.fixture(scope="module")
def scenario():
    return load_scenario("blank", ["wall_camera.rate=2"])


def test_ports_are_the_contract_with_their_types(scenario):
    station = MakeStation(scenario)
    CheckStation(station)
    sizes = {
        "arm.state_estimated": 10,
        "wall_camera.image_time": 1,
        "cheat.state": 10,
        "cheat.clearance": 1,
    }
    for name, size in sizes.items():
        assert station.GetOutputPort(name).size() == size
    assert station.GetInputPort("arm.desired_state").size() == 10
    assert station.GetInputPort("gun.trigger").size() == 1


def test_a_station_with_other_ports_is_refused():
    builder = DiagramBuilder()
    source = builder.AddSystem(ConstantVectorSource([0.0]))
    builder.ExportOutput(source.get_output_port(), "arm.status")
    with pytest.raises(PortTypeError, match=r"missing ports: input arm.desired_state"):
        CheckStation(builder.Build())


def test_arm_tracks_a_swing_and_the_camera_sees_the_wall(scenario):
    # One period of a 0.4 rad swing in 4 s, all joints at once, from the home pose.
    time = np.linspace(0.0, 4.0, 401)
    home = np.deg2rad(scenario.motion.home_deg)
    swing = 0.2 * (1.0 - np.cos(0.5 * np.pi * time))
    ways = np.array([1.0, 0.5, -0.5, 0.5, 1.0])
    q = home + swing[:, None] * ways
    v = 0.1 * np.pi * np.sin(0.5 * np.pi * time)[:, None] * ways
    trajectory = PiecewisePolynomial.CubicHermite(time, q.T, v.T)
    builder = DiagramBuilder()
    station = builder.AddSystem(MakeStation(scenario))
    source = builder.AddSystem(TrajectorySource(trajectory, 1))
    gun = builder.AddSystem(ConstantVectorSource([0.0]))
    builder.Connect(source.get_output_port(), station.GetInputPort("arm.desired_state"))
    builder.Connect(gun.get_output_port(), station.GetInputPort("gun.trigger"))
    log = LogVectorOutput(station.GetOutputPort("cheat.state"), builder, 0.01)
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(4.0)
    context = simulator.get_context()
    record = log.FindLog(context)
    error = record.data()[:5] - trajectory.vector_values(record.sample_times())
    # 1 mrad moves the nozzle by less than 2 mm at full reach.
    assert np.abs(error).max() < 1e-3
    own = station.GetMyContextFromRoot(context)
    measured = station.GetOutputPort("arm.state_estimated").Eval(own)
    true = station.GetOutputPort("cheat.state").Eval(own)
    assert np.abs(measured - true)[:5].max() <= np.pi / 2**scenario.arm.encoder_bits
    image_time = station.GetOutputPort("wall_camera.image_time").Eval(own)[0]
    assert 3.0 < image_time <= 4.0
    depth = station.GetOutputPort("wall_camera.depth_image").Eval(own).data[:, :, 0]
    seen = depth[depth > 0] / 1000.0
    assert seen.size > 0.5 * depth.size
    # The folded arm holds the camera about a metre and less from the wall at 1.05 m.
    assert 0.3 < np.median(seen) < 1.2
