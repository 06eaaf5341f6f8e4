"""Plays a log of the bus into the robot's station."""

from dataclasses import dataclass

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from painter.camera.reader import Reading
from painter.canopen.analysis.log_bus import LogBus
from painter.canopen.process.robot_clock import RobotClock
from painter.config import Scenario
from painter.diagrams.hardware_station import MakeHardwareStation, RobotConnection
from painter.planning.arm.kinematics import NQ
from painter.robot.robot_model import MakeRobotModel
from painter.systems.ports import EvalAs
from painter.systems.simulated.gun_pose import GunPose
from painter.systems.values import ArmStatus
from perception.ground import FloatArray


@dataclass(frozen=True)
class Replay:
    """What a diagram saw of a log.

    Attributes:
        time: (n,) s, from when the drives were first enabled.
        q: (n, 5) rad, measured.
        v: (n, 5) rad/s, measured.
        trigger: (n,) 0 to 1, as commanded to the gun.
        X_WG: (n, 4, 4) pose of the gun.
        X_WG_desired: (n, 4, 4) pose commanded at the same times.
        stops: When the station's status named a new reason to stop, s, and the reason.
    """

    time: FloatArray
    q: FloatArray
    v: FloatArray
    trigger: FloatArray
    X_WG: FloatArray
    X_WG_desired: FloatArray
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
    kinematics = MakeRobotModel(scenario).kinematics
    builder = DiagramBuilder()
    station = builder.AddSystem(MakeHardwareStation(scenario, connection))
    gun = builder.AddNamedSystem("gun_pose", GunPose(kinematics=kinematics))
    state_port = station.GetOutputPort("arm.state_estimated")
    builder.Connect(state_port, gun.GetInputPort("state"))
    for name in ("arm.desired_state", "gun.trigger"):
        builder.ExportInput(station.GetInputPort(name), name)
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    diagram.GetInputPort("arm.desired_state").FixValue(context, np.zeros(2 * NQ))
    diagram.GetInputPort("gun.trigger").FixValue(context, [0.0])
    station_context = station.GetMyContextFromRoot(context)
    pose_port, gun_context = (
        gun.GetOutputPort("X_WG"),
        gun.GetMyContextFromRoot(context),
    )
    status_port = station.GetOutputPort("arm.status")
    rows, stops, reason = [], [], ""
    for time in np.arange(0.0, bus.end - bus.begin + 0.5 * cycle, cycle):
        bus.wait_until(clock.bus_time(time))
        simulator.AdvanceTo(time)
        simulator.AdvancePendingEvents()
        feedback = bus.report().feedback
        status = EvalAs(status_port, station_context, ArmStatus)
        if status.stopped != reason:
            reason = status.stopped
            if reason:
                stops.append((float(time), reason))
        state = state_port.Eval(station_context)
        X_WG = pose_port.Eval(gun_context).GetAsMatrix4()
        rows.append((time, state, feedback.trigger, X_WG, feedback.q_commanded))
    times, states, triggers, poses, commanded = (
        np.array(column) for column in zip(*rows, strict=True)
    )
    R_WG, p_WG = kinematics.gun_poses(commanded)
    desired = np.tile(np.eye(4), (times.size, 1, 1))
    desired[:, :3, :3], desired[:, :3, 3] = R_WG, p_WG
    return Replay(
        time=times,
        q=states[:, :NQ],
        v=states[:, NQ:],
        trigger=triggers,
        X_WG=poses,
        X_WG_desired=desired,
        stops=tuple(stops),
    )
