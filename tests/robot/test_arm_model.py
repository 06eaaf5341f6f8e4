"""What is read from the models, against Drake's own kinematics and geometry."""

import numpy as np
import pytest
from pydrake.geometry import Box
from pydrake.math import RigidTransform

from painter.robot.arm_model import (
    JOINT_NAMES,
    GetArmKinematics,
    GetArmLimits,
    MakeArmPlant,
    MakeCollisionChecker,
)

CELL = "package://painter_models/painter_cell.dmd.yaml"
CLEARANCE = 0.04


@pytest.fixture(scope="module")
def plant():
    return MakeArmPlant(CELL)


@pytest.fixture(scope="module")
def checker():
    return MakeCollisionChecker(CELL, clearance=CLEARANCE)


def test_only_the_five_joints_move(plant, checker):
    for each in (plant, checker.plant()):
        assert each.num_positions() == each.num_velocities() == 5
        assert each.GetPositionNames(always_add_suffix=False) == [
            f"arm_{name}" for name in JOINT_NAMES
        ]


def test_closed_form_agrees_with_the_plant(plant):
    limits, arm = GetArmLimits(plant), GetArmKinematics(plant)
    rng = np.random.default_rng(0)
    q = rng.uniform(limits.q_min, limits.q_max, (100, 5))
    context = plant.CreateDefaultContext()
    for name, (R_WF, p_WF) in {
        "tool": arm.forward(q),
        "gun_nozzle": arm.gun_poses(q),
        "camera_depth": arm.camera_poses(q),
    }.items():
        frame = plant.GetFrameByName(name)
        for i, q_i in enumerate(q):
            plant.SetPositions(context, q_i)
            X_WF = frame.CalcPoseInWorld(context)
            np.testing.assert_allclose(p_WF[i], X_WF.translation(), atol=1e-12)
            np.testing.assert_allclose(R_WF[i], X_WF.rotation().matrix(), atol=1e-12)


def test_floor_and_wall_collide_at_the_clearance(checker):
    arm = GetArmKinematics(checker.plant())
    ahead = np.array([1.0, 0.0, 0.0])
    wall = checker.plant().world_body()
    X_WWall = RigidTransform([1.05 + 0.05, 0.0, 1.5])
    assert checker.AddCollisionShapeToBody("wall", wall, Box(0.1, 4, 3), X_WWall)
    # The tip's flat front is square to the wall, so its gap is the nozzle's.
    for gap, free in ((CLEARANCE + 0.001, True), (CLEARANCE - 0.001, False)):
        q = arm.solve(np.array([[1.05 - gap, 0.3, 1.0]]), ahead)[0]
        assert checker.CheckConfigCollisionFree(q) is free
    checker.RemoveAllAddedCollisionShapes("wall")
    # Pointing down at the floor.
    for gap, free in ((CLEARANCE + 0.001, True), (CLEARANCE - 0.001, False)):
        q = arm.solve(np.array([[0.9, 0.0, gap]]), np.array([0.0, 0.0, -1.0]))[0]
        assert checker.CheckConfigCollisionFree(q) is free


def test_the_robot_sees_itself_and_its_frame(checker):
    home = checker.plant().GetDefaultPositions()
    assert checker.CheckConfigCollisionFree(home)
    # Gun turned back onto the forearm; wrist lowered into the frame.
    folded = np.array([0.0, -0.8, 0.8, -2.75, 0.0])
    into_frame = np.array([np.pi, 0.9, 1.2, -0.5, 0.0])
    for q in (folded, into_frame):
        assert not checker.CheckConfigCollisionFree(q)


def test_torques_are_those_of_the_equation_of_motion(plant):
    limits = GetArmLimits(plant)
    rng = np.random.default_rng(1)
    q = rng.uniform(limits.q_min, limits.q_max, (20, 5))
    v, a = rng.uniform(-1.0, 1.0, (2, 20, 5))
    torques = limits.torques(q, v, a)
    damping = [plant.GetJointByName(name).default_damping() for name in JOINT_NAMES]
    context = plant.CreateDefaultContext()
    for row in range(len(q)):
        plant.SetPositions(context, q[row])
        plant.SetVelocities(context, v[row])
        expected = (
            plant.CalcMassMatrix(context) @ a[row]
            + plant.CalcBiasTerm(context)
            - plant.CalcGravityGeneralizedForces(context)
            + damping * v[row]
        )
        np.testing.assert_allclose(torques[row], expected, atol=1e-9)
