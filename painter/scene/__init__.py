"""Scene descriptions: geometry for the simulator, truth for the figures.

A leaf: knows neither robot nor scenario; `painter.robot.true_scene` poses a scene in W.
"""

from painter.scene.config import Scene
from painter.scene.load import dump_scene, load_scene, named_scenes
from painter.scene.sdf import scene_sdf, wall_pose
from painter.scene.solids import SurfaceKind
from painter.scene.surface import HeightField, height_field, is_paintable, surface_at

__all__ = [
    "HeightField",
    "Scene",
    "SurfaceKind",
    "dump_scene",
    "height_field",
    "is_paintable",
    "load_scene",
    "named_scenes",
    "scene_sdf",
    "surface_at",
    "wall_pose",
]
