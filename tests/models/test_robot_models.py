"""The robot's models: they parse, they are physical, and they are the arm asked for."""

from pathlib import Path

import numpy as np
import pytest
from pydrake.geometry import Box, Cylinder
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.systems.framework import DiagramBuilder

from painter.resources import models_path
from painter.robot.arm_model import (
    JOINT_NAMES,
    AddRobot,
    GetArmKinematics,
    GetArmLimits,
    MakeArmPlant,
)
from painter_models.generate.__main__ import generated_files

CELL = "package://painter_models/painter_cell.dmd.yaml"
FOLDERS = ("arm", "gun", "camera", "frame")


@pytest.fixture(scope="module")
def plant():
    return MakeArmPlant(CELL)


@pytest.mark.parametrize("folder", FOLDERS)
def test_every_model_parses_strictly(folder):
    plant = MultibodyPlant(time_step=0.0)
    parser = Parser(plant)
    parser.package_map().AddPackageXml(str(models_path("package.xml")))
    parser.SetStrictParsing()
    parser.AddModelsFromUrl(f"package://painter_models/{folder}/{folder}.urdf")
    plant.Finalize()


@pytest.mark.parametrize("folder", FOLDERS)
def test_every_folder_explains_itself(folder):
    for name in ("README.md", "LICENSE", "meshes"):
        assert models_path(folder, name).exists()


def test_generated_files_are_what_the_generator_writes():
    root = Path(__file__).parents[2] / "models"
    for path, text in generated_files().items():
        assert (root / path).read_text() == text, (
            f"{path}: run `python -m painter_models.generate`."
        )


def test_inertias_are_physically_valid_and_of_the_size_of_the_body(plant):
    context = plant.CreateDefaultContext()
    for name in FOLDERS:
        for index in plant.GetBodyIndices(plant.GetModelInstanceByName(name)):
            body = plant.get_body(index)
            inertia = body.CalcSpatialInertiaInBodyFrame(context)
            assert inertia.IsPhysicallyValid(), body.name()
            about_com = inertia.Shift(inertia.get_com()).get_unit_inertia()
            gyration = np.sqrt(about_com.get_moments())
            assert np.all((gyration > 0.004) & (gyration < 0.5)), body.name()


def test_the_arm_weighs_about_50_kg(plant):
    robot = [plant.GetModelInstanceByName(n) for n in ("arm", "gun", "camera")]
    mass = plant.CalcTotalMass(plant.CreateDefaultContext(), robot)
    assert mass == pytest.approx(50.0, abs=1.0)


def test_the_arm_has_the_published_reach_and_the_agreed_frames(plant):
    arm = GetArmKinematics(plant)
    assert arm.reach == pytest.approx(1.820, abs=1e-9)
    assert arm.shoulder_height == pytest.approx(1.20, abs=1e-9)
    instance = plant.GetModelInstanceByName("arm")
    bodies = ("base", "shoulder", "upper_arm", "forearm", "wrist", "tool")
    assert all(plant.HasBodyNamed(name, instance) for name in bodies)
    # z ahead, x to the right (-y of L), y down (-z of L).
    ahead_right_down = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    for X_LF in (arm.X_LG, arm.X_LC):
        np.testing.assert_allclose(
            X_LF.rotation().matrix(), ahead_right_down, atol=1e-12
        )


def test_every_joint_has_limits_rotor_inertia_and_gear_ratio(plant):
    limits = GetArmLimits(plant)
    for values in (limits.v_max, limits.a_max, limits.effort_max):
        assert np.all(np.isfinite(values) & (values > 0.0))
    assert np.all(np.isfinite(limits.q_min) & (limits.q_min < limits.q_max))
    for name in JOINT_NAMES:
        actuator = plant.GetJointActuatorByName(name)
        assert actuator.default_rotor_inertia() > 0.0
        assert actuator.default_gear_ratio() > 1.0


def test_both_wrist_joints_carry_the_rotors_of_both_motors(plant):
    # 1/2 J n² (l'² + r'²) with l, r = pitch +- yaw is J n² (pitch'² + yaw'²): each
    # joint sees twice the inertia of one motor, with the gear ratio of one gearbox.
    pitch, yaw = (plant.GetJointActuatorByName(n) for n in JOINT_NAMES[3:])
    assert pitch.default_rotor_inertia() == yaw.default_rotor_inertia()
    assert pitch.default_gear_ratio() == yaw.default_gear_ratio()


def test_drives_hold_and_accelerate_the_stretched_arm(plant):
    limits = GetArmLimits(plant)
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, np.zeros(5))
    # Gravity alone: with half of the drives' torque in hand at least.
    static = -plant.CalcGravityGeneralizedForces(context)
    assert np.all(np.abs(static) < 0.5 * limits.effort_max)
    # One joint after the other at its full acceleration, upwards.
    inertia = np.diag(plant.CalcMassMatrix(context))  # Rotors included.
    for joint in range(5):
        effort = abs(static[joint]) + inertia[joint] * limits.a_max[joint]
        assert effort < 0.9 * limits.effort_max[joint], JOINT_NAMES[joint]


def test_the_camera_does_not_see_the_robot():
    """No point of the robot lies in the field of view while the arm scans."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    AddRobot(Parser(plant), CELL)
    plant.Finalize()
    context = plant.GetMyContextFromRoot(builder.Build().CreateDefaultContext())
    inspector = scene_graph.model_inspector()
    half_x, half_y = np.tan(np.radians([87.0 / 2.0, 58.0 / 2.0]))
    places = [
        [1.05 - distance, y, z]
        for distance in (0.65, 0.70, 0.75)
        for y in (-0.4, -0.2, 0.0, 0.2, 0.4)
        for z in (0.52, 0.80, 1.08, 1.36, 1.64, 1.88)
    ]
    arm = GetArmKinematics(plant)
    for q in arm.solve_camera(np.array(places), np.array([1.0, 0.0, 0.0])):
        plant.SetPositions(context, q)
        X_CW = plant.GetFrameByName("camera_depth").CalcPoseInWorld(context).inverse()
        for name in ("arm", "gun", "camera", "frame"):
            for index in plant.GetBodyIndices(plant.GetModelInstanceByName(name)):
                body = plant.get_body(index)
                X_CB = X_CW @ body.EvalPoseInWorld(context)
                for shape in plant.GetCollisionGeometriesForBody(body):
                    X_CS = X_CB @ inspector.GetPoseInFrame(shape)
                    x, y, z = X_CS @ _points_of(inspector.GetShape(shape))
                    ahead = z > 0.0
                    seen = (np.abs(x) < half_x * z) & (np.abs(y) < half_y * z) & ahead
                    assert not seen.any(), (body.name(), q)


def _points_of(shape: Box | Cylinder) -> np.ndarray:
    """Points all over a shape, its edges among them, (3, n), m."""
    ticks = np.linspace(-1.0, 1.0, 10)
    if isinstance(shape, Box):
        points = np.stack(np.meshgrid(ticks, ticks, ticks)).reshape(3, -1)
        return np.array(shape.size())[:, None] / 2.0 * points
    angle, radius, height = (
        grid.ravel()
        for grid in np.meshgrid(np.arange(48) * np.pi / 24, [0.0, 0.5, 1.0], ticks)
    )
    radius, height = radius * shape.radius(), height * shape.length() / 2.0
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), height])
