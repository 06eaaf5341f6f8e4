"""The planners of a scenario's robot."""

from painter.config import Scenario
from painter.planning.arm.scan_camera import ScanCamera
from painter.planning.program.program import ProgramPlanner
from painter.planning.scan.free_motion import FreeMotionPlanner
from painter.robot.robot_model import MakeRobotModel, RobotModel


def MakeProgramPlanner(
    scenario: Scenario, robot: RobotModel | None = None
) -> ProgramPlanner:
    """Makes the planner of paint programs, the same for every connection of the robot.

    Args:
        scenario: Gives tip and settings.
        robot: The scenario's robot; None = make it.
    """
    robot = robot or MakeRobotModel(scenario)
    return ProgramPlanner(
        kinematics=robot.kinematics,
        limits=robot.limits,
        checker=robot.checker,
        tip=scenario.gun.tip,
        raster=scenario.raster,
        motion=scenario.motion,
    )


def MakeFreeMotionPlanner(scenario: Scenario, robot: RobotModel) -> FreeMotionPlanner:
    """Makes the planner of motions with the gun closed.

    Args:
        scenario: Gives tile and settings.
        robot: The scenario's robot.
    """
    return FreeMotionPlanner(
        kinematics=robot.kinematics,
        limits=robot.limits,
        checker=robot.checker,
        tile=scenario.tile,
        scan=scenario.scan,
        motion=scenario.motion,
        camera=ScanCamera.mounted(
            scenario.wall_camera.stereo,
            robot.kinematics.X_LC,
            rate=scenario.wall_camera.rate,
        ),
        standoff=scenario.raster.standoff,
        time_limit=scenario.cycle.time_limit,
    )
