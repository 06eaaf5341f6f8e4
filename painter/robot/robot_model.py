"""The robot of a scenario as one value: its models are parsed once a run."""

from dataclasses import dataclass

from pydrake.planning import SceneGraphCollisionChecker

from painter.config import Scenario
from painter.planning.arm.kinematics import ArmKinematics, ArmLimits
from painter.robot.arm_model import (
    GetArmKinematics,
    GetArmLimits,
    MakeCollisionChecker,
)


@dataclass(frozen=True)
class RobotModel:
    """What planning, tracking and logs need of the robot.

    Attributes:
        kinematics: Of the arm, in W.
        limits: Of its joints, and of the nozzle's speed as the scenario bounds it.
        checker: Of arm, frame and floor; clone it before adding shapes to it.
    """

    kinematics: ArmKinematics
    limits: ArmLimits
    checker: SceneGraphCollisionChecker


def MakeRobotModel(scenario: Scenario) -> RobotModel:
    """Parses the robot's models and reads everything from that one plant.

    Args:
        scenario: Gives the robot's directives, its clearance and the nozzle's speed.
    """
    checker = MakeCollisionChecker(
        scenario.directives, clearance=scenario.motion.clearance
    )
    kinematics = GetArmKinematics(checker.plant())
    limits = GetArmLimits(checker.plant()).replace(
        nozzle=kinematics.nozzle, nozzle_speed=scenario.motion.nozzle_speed
    )
    return RobotModel(kinematics=kinematics, limits=limits, checker=checker)
