"""The robot's station: the simulated one's ports, setpoints and feedback in time."""

import ast
from pathlib import Path

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, PortDataType
from pydrake.systems.primitives import (
    ConstantVectorSource,
    LogVectorOutput,
    TrajectorySource,
)
from pydrake.trajectories import PiecewisePolynomial

from painter.canopen.master.feedback import BusState
from painter.canopen.process.robot_clock import RobotClock
from painter.canopen.sim.faults import Fault
from painter.config import load_scenario
from painter.cycle.bus_record import executions, robot_times
from painter.diagrams.station import CHEAT_PREFIX, CheckStation, MakeStation
from painter.errors import BusError
from painter.systems.values import ArmStatus
from tests.hil import Loop, blind_reading

ROOT = Path(__file__).parents[2]


@pytest.fixture
def loop():
    """Drives enabled in the home pose; no camera and no film."""
    return Loop(load_scenario("blank"), world=False).bring_up()


def ports(station):
    """Name, kind, size and type of each port but the simulator's own."""
    found = {}
    for kind, count, get in (
        ("in", station.num_input_ports(), station.get_input_port),
        ("out", station.num_output_ports(), station.get_output_port),
    ):
        for index in range(count):
            port = get(index)
            name = port.get_name()
            if name.startswith(CHEAT_PREFIX):
                continue
            size = port.size()
            if port.get_data_type() == PortDataType.kAbstractValued:
                value = port.Allocate().get_value() if kind == "out" else None
                shape = getattr(value, "width", int)(), getattr(value, "height", int)()
                size = type(value), shape
            found[kind, name] = port.get_data_type(), size
    return found


def test_both_stations_have_the_same_ports(loop):
    scenario = loop.scenario
    simulated = MakeStation(scenario)
    robot = MakeStation(scenario, connection=loop.connection(read_camera=blind_reading))
    CheckStation(robot)
    assert ports(robot) == ports(simulated)
    assert len(ports(robot)) == 7


def test_nothing_outside_the_station_knows_which_body_it_has():
    """The brain's diagram and its systems import nothing of the robot's side."""
    brain = [ROOT / "painter/diagrams/brain.py"]
    brain += sorted((ROOT / "painter/systems/brain").glob("*.py"))
    assert len(brain) > 8
    for path in brain:
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and node.module:
                assert not node.module.startswith("painter.canopen"), path
        assert "cheat." not in path.read_text(), path


def swing(home, seconds=3.0):
    """One swing of 0.1 rad of all joints, from rest to rest."""
    time = np.linspace(0.0, seconds, 301)
    phase = 2.0 * np.pi * time / seconds
    q = home + 0.05 * (1.0 - np.cos(phase))[:, None] * np.ones(5)
    v = 0.05 * 2.0 * np.pi / seconds * np.sin(phase)[:, None] * np.ones(5)
    return PiecewisePolynomial.CubicHermite(time, q.T, v.T)


def test_setpoints_are_carried_out_when_stamped_and_measured_in_time(loop):
    body = loop.connection(read_camera=blind_reading)
    home = loop.bus.report().feedback.q
    path = swing(home)
    builder = DiagramBuilder()
    station = builder.AddSystem(MakeStation(loop.scenario, connection=body))
    source = builder.AddSystem(TrajectorySource(path, 1))
    gun = builder.AddSystem(ConstantVectorSource([0.0]))
    builder.Connect(source.get_output_port(), station.GetInputPort("arm.desired_state"))
    builder.Connect(gun.get_output_port(), station.GetInputPort("gun.trigger"))
    log = LogVectorOutput(station.GetOutputPort("arm.state_estimated"), builder, 0.01)
    simulator = Simulator(builder.Build())
    context = simulator.get_mutable_context()
    body.clock.start(loop.bus.now())
    simulator.Initialize()
    for _ in range(150):
        time = context.get_time() + 0.02
        loop.bus.wait_until(body.clock.due(time))
        simulator.AdvanceTo(time)
    record = log.FindLog(context)
    time, q = record.sample_times(), record.data()[:5]
    late = time > 0.5
    # What is measured at a time was commanded `ahead` before; a log sees the update
    # that is due at its own time only 5 ms later. 0.1 rad/s: 10 ms would be 1 mrad.
    expected = path.vector_values(time[late] - body.clock.ahead - 0.005)
    assert np.abs(q[:, late] - expected).max() < 1e-4
    assert loop.bus.report().feedback.bus_state == BusState.ENABLED


def test_a_stop_of_the_bus_is_a_fault_with_its_reason(loop):
    station = MakeStation(
        loop.scenario, connection=loop.connection(read_camera=blind_reading)
    )
    simulator = Simulator(station)
    context = simulator.get_mutable_context()
    home = loop.bus.report().feedback.q
    desired = np.concatenate([home, np.zeros(5)])
    station.GetInputPort("arm.desired_state").FixValue(context, desired)
    station.GetInputPort("gun.trigger").FixValue(context, [0.0])
    simulator.AdvanceTo(0.01)
    status: ArmStatus = station.GetOutputPort("arm.status").Eval(context)
    assert status.fault is None
    loop.rack.inject(Fault.EMCY, "elbow_pitch")
    loop.bus.wait_until(loop.bus.now() + 0.05)
    simulator.AdvanceTo(0.03)
    status = station.GetOutputPort("arm.status").Eval(context)
    assert "elbow_pitch: EMCY 3220h" in status.fault.cause
    loop.bus.kill()
    simulator.AdvanceTo(0.05)
    assert "the bus process has ended" in (
        station.GetOutputPort("arm.status").Eval(context).fault.cause
    )


def test_drives_must_be_enabled_before_there_is_a_station():
    loop = Loop(load_scenario("blank"), world=False)
    with pytest.raises(BusError, match="not enabled"):
        MakeStation(
            loop.scenario, connection=loop.connection(read_camera=blind_reading)
        )


def test_a_clock_that_is_held_maps_times_on_both_sides():
    clock = RobotClock(lag=0.02, ahead=0.3)
    clock.start(100.0)
    assert clock.due(1.0) == pytest.approx(101.02)
    # At 5 s of the diagram's a computation has taken 2 s.
    assert clock.hold(5.0, 107.02) == pytest.approx(2.0)
    assert clock.hold(5.0, 107.02) == 0.0
    assert clock.bus_time(6.0) == pytest.approx(108.0)
    assert clock.diagram_time(108.0) == pytest.approx(6.0)
    # A picture that was taken before the computation, or while it ran.
    assert clock.diagram_time(104.0) == pytest.approx(4.0)
    assert clock.diagram_time(106.0) == pytest.approx(5.0)
    assert clock.diagram_time(99.0) == pytest.approx(-1.0)
    # While it ran the arm carried out what had been commanded: no pose fits.
    assert np.isnan(clock.picture_time(106.0))
    assert clock.picture_time(104.0) == pytest.approx(4.0)
    assert clock.picture_time(108.0) == pytest.approx(6.0)
    times = robot_times(np.array([99.0, 104.0, 106.0, 107.5]), clock)
    np.testing.assert_allclose(times, [np.nan, 4.0, np.nan, 5.5])
    stamps = executions(np.array([4.99, 5.0, 6.0]), clock)
    np.testing.assert_allclose(stamps, [105.29, 107.3, 108.3])


@pytest.mark.parametrize(("lag", "ahead"), [(0.0, 0.3), (0.3, 0.3), (0.02, 1.0)])
def test_a_clock_out_of_bounds_is_refused(lag, ahead):
    with pytest.raises(ValueError, match="lag must be"):
        RobotClock(lag=lag, ahead=ahead)
