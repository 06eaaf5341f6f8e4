"""Plays a log of the bus into the robot's station."""

from dataclasses import dataclass

import numpy as np
from pydrake.systems.analysis import Simulator

from painter.camera.reader import Reading
from painter.canopen.analysis.log_bus import LogBus
from painter.canopen.process.robot_clock import RobotClock
from painter.config import Scenario
from painter.cycle.cycle_log import GunPoses
from painter.diagrams.hardware_station import MakeHardwareStation, RobotConnection
from painter.planning.arm.kinematics import NQ
from painter.robot.robot_model import MakeRobotModel
from painter.run.folder.values import Executed
from painter.systems.ports import EvalAs
from painter.systems.values import ArmStatus
from perception.ground import FloatArray


@dataclass(frozen=True, eq=False)
class Replay(Executed):
    """What the station saw of a log; times from when the drives were first enabled.

    Attributes:
        stops: Time, s, and cause of each new stop in the station's status.
    """

    stops: tuple[tuple[float, str], ...]


def ReplayLog(scenario: Scenario, bus: LogBus, cycle: float) -> Replay:
    """Runs the hardware station on a log, as fast as it goes.

    Args:
        scenario: The robot.
        bus: The log.
        cycle: Time between two SYNCs of it, s.
    """
    clock = RobotClock()
    clock.start(bus.begin)
    connection = RobotConnection(bus=bus, clock=clock, cycle=cycle, read_camera=Reading)
    station = MakeHardwareStation(scenario, connection)
    simulator = Simulator(station)
    context = simulator.get_mutable_context()
    station.GetInputPort("arm.desired_state").FixValue(context, np.zeros(2 * NQ))
    station.GetInputPort("gun.trigger").FixValue(context, [0.0])
    state_port = station.GetOutputPort("arm.state_estimated")
    status_port = station.GetOutputPort("arm.status")
    rows: list[tuple[float, FloatArray, float, FloatArray]] = []
    stops: list[tuple[float, str]] = []
    reason = ""
    for time in np.arange(0.0, bus.end - bus.begin + 0.5 * cycle, cycle):
        bus.wait_until(clock.bus_time(time))
        simulator.AdvanceTo(time)
        simulator.AdvancePendingEvents()
        stopped = EvalAs(status_port, context, ArmStatus).stopped
        if stopped is not None and stopped.cause != reason:
            stops.append((float(time), stopped.cause))
        reason = "" if stopped is None else stopped.cause
        feedback = bus.report().feedback
        state = state_port.Eval(context).copy()
        rows.append((time, state, feedback.trigger, feedback.q_commanded))
    times, states, triggers, commanded = (
        np.array(column) for column in zip(*rows, strict=True)
    )
    kinematics = MakeRobotModel(scenario).kinematics
    return Replay(
        time=times,
        q=states[:, :NQ],
        v=states[:, NQ:],
        trigger=triggers,
        X_WG=GunPoses(kinematics, states[:, :NQ]),
        X_WG_desired=GunPoses(kinematics, commanded),
        stops=tuple(stops),
    )
