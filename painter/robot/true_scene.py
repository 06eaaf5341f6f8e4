"""The scene of a scenario, where it truly stands before the robot."""

from pydrake.math import RigidTransform

from painter.config import Scenario
from painter.planning.tile import nominal_tile_pose
from painter.scene import Scene, load_scene, wall_pose


def true_scene(scenario: Scenario) -> tuple[Scene, RigidTransform]:
    """Loads a scenario's scene.

    Args:
        scenario: Names the scene and gives its seed and the nominal tile.

    Returns:
        The scene and X_WS, its pose in W: that of the nominal tile, off by the scene's
        base error.

    Raises:
        InputError: The scene cannot be read.
    """
    scene = load_scene(scenario.scene, scenario.random_seed)
    return scene, wall_pose(scene, nominal_tile_pose(scenario.tile))
