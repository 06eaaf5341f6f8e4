"""The planner of a scenario's robot."""

from painter.config import Scenario
from painter.diagrams.arm_model import (
    GetArmKinematics,
    GetArmLimits,
    MakeArmPlant,
    MakeCollisionChecker,
)
from painter.planning.program import ProgramPlanner


def MakeProgramPlanner(scenario: Scenario) -> ProgramPlanner:
    """Makes the planner of paint programs, the same for every body of the robot.

    Args:
        scenario: Gives the robot's directives, tip and settings.
    """
    plant = MakeArmPlant(scenario.directives)
    return ProgramPlanner(
        kinematics=GetArmKinematics(plant),
        limits=GetArmLimits(plant),
        checker=MakeCollisionChecker(
            scenario.directives, clearance=scenario.motion.clearance
        ),
        tip=scenario.gun.tip,
        raster=scenario.raster,
        motion=scenario.motion,
    )
