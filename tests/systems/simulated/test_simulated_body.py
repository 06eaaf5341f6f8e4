"""The small systems of the simulated body: encoder, drives, gun pose, clearance."""

import numpy as np
import pytest
from pydrake.geometry import Box
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from pydrake.multibody.tree import PrismaticJoint, SpatialInertia, UnitInertia
from pydrake.systems.framework import DiagramBuilder

from painter.planning.arm.kinematics import ArmKinematics
from painter.systems.simulated.clearance_monitor import ClearanceMonitor
from painter.systems.simulated.gun_pose import GunPose
from painter.systems.simulated.joint_encoder import JointEncoder
from painter.systems.simulated.simulated_drives import SimulatedDrives


def evaluate(dut, output: str, **inputs: np.ndarray):
    context = dut.CreateDefaultContext()
    for name, value in inputs.items():
        dut.GetInputPort(name).FixValue(context, value)
    return dut.GetOutputPort(output).Eval(context)


def test_encoder_rounds_position_to_counts_and_velocity_to_counts_a_window():
    count = 2 * np.pi / 2**12
    state = np.concatenate([np.full(5, 10.4 * count), np.full(5, 2.6 * count / 0.01)])
    dut = JointEncoder(bits=12, velocity_window=0.01)
    measured = evaluate(dut, "state_estimated", state=state)
    np.testing.assert_allclose(measured[:5], 10 * count, rtol=1e-12)
    np.testing.assert_allclose(measured[5:], 3 * count / 0.01, rtol=1e-12)


@pytest.mark.parametrize(
    "bad", [{"bits": 0}, {"bits": 33}, {"bits": 12, "velocity_window": 0.0}]
)
def test_encoder_refuses_what_no_encoder_is(bad):
    with pytest.raises(ValueError, match="must be"):
        JointEncoder(**bad)


def test_drives_are_operational_until_their_fault_is_due():
    dut = SimulatedDrives(faults=[(2.0, 3, 0x8611)])
    context = dut.CreateDefaultContext()
    dut.GetInputPort("desired_state").FixValue(context, np.full(10, 0.5))
    dut.GetInputPort("state_estimated").FixValue(context, np.full(10, 0.4))
    port = dut.GetOutputPort("status")
    context.SetTime(1.99)
    assert port.Eval(context).fault is None
    context.SetTime(2.0)
    status = port.Eval(context)
    assert status.fault.cause == "drive 3: FAULT, fault code 0x8611"
    assert status.drives[0].following_error == pytest.approx(0.1)


def test_gun_pose_of_the_stretched_arm():
    X_LG = RigidTransform(
        np.array(
            [[0, 0, 1, 0.27], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]], dtype=float
        )
    )
    arm = ArmKinematics(
        shoulder_height=1.2, upper_arm=0.79, forearm=0.76, X_LG=X_LG, X_LC=X_LG
    )
    X_WG = evaluate(GunPose(kinematics=arm), "X_WG", state=np.zeros(10))
    np.testing.assert_allclose(X_WG.translation(), [1.82, 0.0, 1.2], atol=1e-12)
    np.testing.assert_allclose(X_WG.rotation().col(2), [1.0, 0.0, 0.0], atol=1e-12)


def make_sliding_box(robot: set[str], surroundings: set[str]):
    """A 0.2 m box that slides along x towards a wall whose face is at x = 1."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.001)
    body = plant.AddRigidBody(
        "slider", SpatialInertia(1.0, np.zeros(3), UnitInertia.SolidBox(0.2, 0.2, 0.2))
    )
    friction = CoulombFriction(0.5, 0.5)
    ids = {
        "slider": plant.RegisterCollisionGeometry(
            body, RigidTransform(), Box(0.2, 0.2, 0.2), "slider", friction
        ),
        "wall": plant.RegisterCollisionGeometry(
            plant.world_body(), RigidTransform([1.5, 0, 0]), Box(1, 4, 4), "w", friction
        ),
        "floor": plant.RegisterCollisionGeometry(
            plant.world_body(), RigidTransform([0, 0, -9]), Box(9, 9, 1), "f", friction
        ),
    }
    plant.AddJoint(
        PrismaticJoint("x", plant.world_frame(), body.body_frame(), [1, 0, 0])
    )
    plant.Finalize()
    dut = builder.AddSystem(
        ClearanceMonitor(
            robot=frozenset(ids[name] for name in robot),
            surroundings=frozenset(ids[name] for name in surroundings),
            horizon=0.3,
        )
    )
    builder.Connect(
        scene_graph.get_query_output_port(), dut.GetInputPort("query_object")
    )
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()

    def clearance(x: float) -> float:
        plant.SetPositions(plant.GetMyMutableContextFromRoot(context), [x])
        port = dut.GetOutputPort("clearance")
        return port.Eval(dut.GetMyContextFromRoot(context))[0]

    return clearance


def test_clearance_is_the_distance_to_the_surroundings():
    clearance = make_sliding_box({"slider"}, {"wall"})
    assert clearance(0.75) == pytest.approx(0.15, abs=1e-6)
    assert clearance(0.95) == pytest.approx(-0.05, abs=1e-6)
    assert clearance(0.0) == 0.3  # Beyond the horizon.


def test_what_is_neither_robot_nor_surroundings_does_not_count():
    clearance = make_sliding_box({"slider"}, {"floor"})
    assert clearance(0.75) == 0.3


def test_parts_of_the_robot_count_only_when_they_touch():
    clearance = make_sliding_box({"slider", "wall"}, {"floor"})
    assert clearance(0.75) == 0.3
    assert clearance(0.95) == pytest.approx(-0.05, abs=1e-6)
