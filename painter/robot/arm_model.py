"""The robot as a plant: source of kinematics, limits and collision checks.

Lengths, mounts and limits are defined in the models alone; everything here is read from
a plant that is parsed from them.
"""

import numpy as np
from pydrake.geometry import Box
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import MultibodyForces
from pydrake.planning import RobotDiagramBuilder, SceneGraphCollisionChecker

from painter.planning.arm.kinematics import ArmKinematics, ArmLimits
from painter.resources import models_path
from perception.ground import FloatArray

JOINT_NAMES = (
    "base_yaw",
    "shoulder_pitch",
    "elbow_pitch",
    "wrist_pitch",
    "wrist_yaw",
)
# Model instances that move; the frame and whatever is added to W are surroundings.
ROBOT_MODELS = ("arm", "gun", "camera")
# The floor that the frame stands on, W z = 0.
FLOOR = Box(8.0, 8.0, 0.1)
X_W_FLOOR = RigidTransform([0.0, 0.0, -0.05])
# Distance at which two parts of the robot count as touching, m: less than the least
# gap of the design (1 cm, wrist flange to fork), more than its tolerances.
SELF_CLEARANCE = 0.005
# Largest step of an edge check: root sum of squares over the joints, rad. The nozzle
# moves at most 1.8 m x this far between two checks.
EDGE_STEP = 0.02


def AddRobot(parser: Parser, directives: str) -> None:
    """Adds the robot's cell to the parser's plant.

    Args:
        parser: Parser of a plant that is not finalised; parses strictly afterwards.
        directives: Path or package:// URL of the model directives;
            package://painter_models is known.
    """
    packages = parser.package_map()
    if not packages.Contains("painter_models"):
        packages.AddPackageXml(str(models_path("package.xml")))
    parser.SetStrictParsing()
    if directives.startswith("package://"):
        parser.AddModelsFromUrl(directives)
    else:
        parser.AddModels(directives)


def MakeArmPlant(directives: str) -> MultibodyPlant:
    """Makes a finalised continuous plant of the robot alone, without geometry.

    Args:
        directives: Path or package:// URL of the model directives.
    """
    plant = MultibodyPlant(time_step=0.0)
    AddRobot(Parser(plant), directives)
    plant.Finalize()
    return plant


def GetArmKinematics(plant: MultibodyPlant) -> ArmKinematics:
    """Reads lengths and mounts from the plant, at its zero positions.

    Args:
        plant: Finalised, with the robot in it; may hold more.

    Raises:
        ValueError: The robot is not an arm of the form that `ArmKinematics` describes.
    """
    context = plant.CreateDefaultContext()
    arm = plant.GetModelInstanceByName("arm")
    plant.SetPositions(context, arm, np.zeros(len(JOINT_NAMES)))

    def pose(name: str) -> RigidTransform:
        return plant.GetFrameByName(name).CalcPoseInWorld(context)

    def joint_pose(name: str) -> RigidTransform:
        joint = plant.GetJointByName(name, arm)
        return joint.frame_on_child().CalcPoseInWorld(context)

    p_WS = joint_pose("shoulder_pitch").translation()
    p_WE = joint_pose("elbow_pitch").translation()
    X_WL = joint_pose("wrist_yaw")
    X_LW = X_WL.inverse()
    return ArmKinematics(
        shoulder_height=float(p_WS[2]),
        upper_arm=float(p_WE[0] - p_WS[0]),
        forearm=float(X_WL.translation()[0] - p_WE[0]),
        X_LG=X_LW @ pose("gun_nozzle"),
        X_LC=X_LW @ pose("camera_depth"),
    )


class ArmTorques:
    """Joint torques of a motion: inverse dynamics of a plant.

    Gravity, inertia with that of the rotors, and the joints' viscous friction.
    """

    def __init__(self, plant: MultibodyPlant) -> None:
        """Takes a finalised plant in which only the arm moves."""
        self._plant = plant
        self._context = plant.CreateDefaultContext()
        self._forces = MultibodyForces(plant)

    def __call__(self, q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
        """See `painter.planning.arm.kinematics.TorqueModel`."""
        plant, context, forces = self._plant, self._context, self._forces
        torques = np.empty(q.shape)
        for row, x in enumerate(np.hstack([q, v])):
            plant.SetPositionsAndVelocities(context, x)
            plant.CalcForceElementsContribution(context, forces)
            torques[row] = plant.CalcInverseDynamics(context, a[row], forces)
        return torques


def GetArmLimits(plant: MultibodyPlant) -> ArmLimits:
    """Reads the limits of the five joints from the plant."""
    arm = plant.GetModelInstanceByName("arm")
    joints = [plant.GetJointByName(name, arm) for name in JOINT_NAMES]
    drives = [plant.GetJointActuatorByName(name, arm) for name in JOINT_NAMES]
    return ArmLimits(
        q_min=np.array([joint.position_lower_limits()[0] for joint in joints]),
        q_max=np.array([joint.position_upper_limits()[0] for joint in joints]),
        v_max=np.array([joint.velocity_upper_limits()[0] for joint in joints]),
        a_max=np.array([joint.acceleration_upper_limits()[0] for joint in joints]),
        effort_max=np.array([drive.effort_limit() for drive in drives]),
        torques=ArmTorques(plant) if plant.num_velocities() == len(joints) else None,
    )


def MakeCollisionChecker(
    directives: str,
    *,
    clearance: float,
    self_clearance: float = SELF_CLEARANCE,
    edge_step: float = EDGE_STEP,
) -> SceneGraphCollisionChecker:
    """Makes a checker of the robot against itself, its frame and the floor.

    Its positions are the arm's five joints, base yaw first. Obstacles are added by
    `AddCollisionShapeToBody(..., checker.plant().world_body(), ...)`, as boxes or
    cylinders posed in W.

    Args:
        directives: Path or package:// URL of the model directives.
        clearance: Least distance of the robot from anything else, m.
        self_clearance: Least distance between two parts of the robot, m.
        edge_step: Largest step between two checks along an edge, as the root of the
            sum of squares over the joints, rad.
    """
    builder = RobotDiagramBuilder(time_step=0.0)
    AddRobot(builder.parser(), directives)
    plant = builder.plant()
    plant.Finalize()
    robot = [plant.GetModelInstanceByName(name) for name in ROBOT_MODELS]
    checker = SceneGraphCollisionChecker(
        model=builder.Build(),
        robot_model_instances=robot,
        edge_step_size=edge_step,
        env_collision_padding=clearance,
        self_collision_padding=self_clearance,
    )
    checker.AddCollisionShapeToBody(
        "floor", checker.plant().world_body(), FLOOR, X_W_FLOOR
    )
    return checker
