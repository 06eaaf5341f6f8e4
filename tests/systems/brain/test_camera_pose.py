import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from painter.planning.arm.kinematics import ArmKinematics
from painter.systems.brain.camera_pose import CameraPose, ImageTimeError, JointHistory

R_AHEAD = RotationMatrix([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
ARM = ArmKinematics(
    shoulder_height=1.2,
    upper_arm=0.8,
    forearm=0.7,
    X_LG=RigidTransform(R_AHEAD, [0.3, 0.0, 0.0]),
    X_LC=RigidTransform(R_AHEAD, [0.1, 0.0, 0.2]),
)


def yaw_pose(yaw: float) -> RigidTransform:
    """X_WC of the arm stretched out, turned about the base axis."""
    X_WB = RigidTransform(RotationMatrix.MakeZRotation(yaw), [0.0, 0.0, 0.0])
    return X_WB @ RigidTransform(R_AHEAD, [1.6, 0.0, 1.4])


def make_simulator(image_time: float, *, yaw_rate: float = 0.5) -> Simulator:
    """The arm stretched out, its base turning at a constant rate."""
    builder = DiagramBuilder()
    turn = np.zeros((10, 2))
    turn[0] = [0.0, 10.0 * yaw_rate]
    turn[5] = yaw_rate
    state = builder.AddSystem(
        TrajectorySource(PiecewisePolynomial.FirstOrderHold([0.0, 10.0], turn))
    )
    time = builder.AddSystem(ConstantVectorSource([image_time]))
    dut = builder.AddNamedSystem("camera_pose", CameraPose(kinematics=ARM))
    builder.Connect(state.get_output_port(), dut.GetInputPort("state"))
    builder.Connect(time.get_output_port(), dut.GetInputPort("image_time"))
    builder.ExportOutput(dut.GetOutputPort("X_WC"), "X_WC")
    return Simulator(builder.Build())


def pose(simulator: Simulator) -> RigidTransform:
    return simulator.get_system().GetOutputPort("X_WC").Eval(simulator.get_context())


@pytest.mark.parametrize("image_time", [0.35, 0.7034, 1.2, 1.2049])
def test_pose_is_that_of_the_picture_not_of_now(image_time):
    simulator = make_simulator(image_time)
    simulator.AdvanceTo(1.205)
    # Joints move at a constant rate: interpolation is exact.
    expected = yaw_pose(0.5 * image_time)
    assert pose(simulator).IsNearlyEqualTo(expected, 1e-9)


def test_a_calibrated_mount_is_where_the_pose_is():
    X_NC = RigidTransform(RotationMatrix.MakeXRotation(0.01), [0.0, 0.002, 0.0])
    dut = CameraPose(kinematics=ARM, X_NC=X_NC)
    context = dut.CreateDefaultContext()
    dut.GetInputPort("state").FixValue(context, np.zeros(10))
    dut.GetInputPort("image_time").FixValue(context, [-1.0])
    X_WC = dut.GetOutputPort("X_WC").Eval(context)
    assert X_WC.IsNearlyEqualTo(yaw_pose(0.0) @ X_NC, 1e-12)


def test_before_the_first_picture_the_pose_is_now():
    simulator = make_simulator(-1.0)
    assert pose(simulator).IsNearlyEqualTo(yaw_pose(0.0), 1e-12)
    simulator.AdvanceTo(0.333)
    assert pose(simulator).IsNearlyEqualTo(yaw_pose(0.5 * 0.333), 1e-9)


def test_first_moment_has_a_pose_before_any_event():
    assert pose(make_simulator(0.0)).IsNearlyEqualTo(yaw_pose(0.0), 1e-12)


@pytest.mark.parametrize(
    ("image_time", "age"), [(0.1, r"1\.900 s old"), (2.5, r"-0\.500 s old")]
)
def test_pictures_out_of_the_history_are_an_error(image_time, age):
    simulator = make_simulator(image_time)
    simulator.AdvanceTo(2.0)
    with pytest.raises(
        ImageTimeError, match=f"camera_pose: .*{age}.* oldest joint positions 1.0"
    ):
        pose(simulator)


def test_history_keeps_its_length_and_replaces_what_is_there():
    dut = JointHistory.empty()
    for time in np.arange(0.0, 2.0, 0.25):
        dut = dut.append(time, np.full(5, time), length=1.0)
    np.testing.assert_allclose(dut.time, [0.75, 1.0, 1.25, 1.5, 1.75])
    np.testing.assert_allclose(dut.at(1.1), 1.1)
    dut = dut.append(1.75, np.zeros(5), length=1.0)
    np.testing.assert_allclose(dut.at(1.625), 0.75)
    assert not dut.q.flags.writeable


def test_bad_periods_are_refused():
    with pytest.raises(ValueError, match="period must be > 0"):
        CameraPose(kinematics=ARM, period=0.0)
    with pytest.raises(ValueError, match="length at least"):
        CameraPose(kinematics=ARM, period=0.1, length=0.05)
