"""The planners of a scenario's robot."""

from painter.config import Scenario
from painter.planning.program.program import ProgramPlanner
from painter.planning.scan.free_motion import FreeMotionPlanner
from painter.robot.arm_model import (
    GetArmKinematics,
    GetArmLimits,
    MakeArmPlant,
    MakeCollisionChecker,
)


def MakeProgramPlanner(scenario: Scenario) -> ProgramPlanner:
    """Makes the planner of paint programs, the same for every body of the robot.

    Args:
        scenario: Gives the robot's directives, tip and settings.
    """
    plant = MakeArmPlant(scenario.directives)
    kinematics = GetArmKinematics(plant)
    limits = GetArmLimits(plant)
    return ProgramPlanner(
        kinematics=kinematics,
        limits=limits.replace(
            nozzle=kinematics.nozzle, nozzle_speed=scenario.motion.nozzle_speed
        ),
        checker=MakeCollisionChecker(
            scenario.directives, clearance=scenario.motion.clearance
        ),
        tip=scenario.gun.tip,
        raster=scenario.raster,
        motion=scenario.motion,
    )


def MakeFreeMotionPlanner(
    scenario: Scenario, programs: ProgramPlanner
) -> FreeMotionPlanner:
    """Makes the planner of motions with the gun closed.

    Args:
        scenario: Gives tile and settings.
        programs: Planner of programs for the same robot.
    """
    return FreeMotionPlanner(
        kinematics=programs.kinematics,
        limits=programs.limits,
        checker=programs.checker,
        tile=scenario.tile,
        scan=scenario.scan,
        motion=scenario.motion,
        standoff=scenario.raster.standoff,
    )
