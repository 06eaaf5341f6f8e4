"""What the 3-D replay shows besides the robot: paint that appears as it is sprayed."""

import numpy as np
from pydrake.geometry import Box, Meshcat, Rgba
from pydrake.math import RigidTransform

from painter.planning.spray_path import PaintProgram, Stroke
from perception.ground import FloatArray

_PAINT = Rgba(0.16, 0.45, 0.70, 0.85)
_PIECE = 0.1  # m, length of the pieces in which a stroke appears.
_THICKNESS = 0.002  # m; the film itself would not be seen.
_PATH = "paint"


def set_view(meshcat: Meshcat) -> None:
    """Lets the scene open with robot and wall in view, from behind the robot's left."""
    meshcat.SetCameraPose(
        camera_in_world=[-1.6, 1.7, 2.0], target_in_world=[0.7, -0.1, 1.1]
    )


def add_paint(
    meshcat: Meshcat, program: PaintProgram, *, pitch: float, start: float
) -> None:
    """Adds the strokes to a recording; each piece shows from when it was sprayed on.

    Args:
        meshcat: Has a recording that is not yet published.
        program: What was painted.
        pitch: Width that a stroke is drawn with, m.
        start: Time of the recording at which the program's motion began, s.
    """
    for number, stroke in enumerate(program.strokes):
        opened, closed = program.motion.spray_on[number] + start
        count = max(1, round(stroke.length / _PIECE))
        for index in range(count):
            path = f"{_PATH}/{number}/{index}"
            share = (index + 0.5) / count
            length = stroke.length / count
            meshcat.SetObject(path, Box(pitch, length, _THICKNESS), _PAINT)
            meshcat.SetTransform(path, program.X_WT @ _piece_pose(stroke, share))
            meshcat.SetProperty(path, "visible", False, 0.0)
            meshcat.SetProperty(
                path, "visible", True, opened + share * (closed - opened)
            )


def _piece_pose(stroke: Stroke, share: float) -> RigidTransform:
    """Returns the pose in T of the piece at a share of the stroke's length."""
    centre: FloatArray = stroke.start_T + share * (stroke.end_T - stroke.start_T)
    return RigidTransform(np.array([centre[0], centre[1], 0.5 * _THICKNESS]))
