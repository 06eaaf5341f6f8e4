"""How near to the wall the gun may come beside what stands out of it.

With the gun square to the wall the tool keeps its place relative to the nozzle, so the
least stand-offs beside boxes follow without solving for a single pose.
"""

from collections.abc import Sequence

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.planning import CollisionChecker

from painter.planning.clearance.obstacles import ObstacleBox
from perception.ground import FloatArray

_CORNERS = np.array(np.meshgrid(*3 * [[-1.0, 1.0]])).reshape(3, 8)
# The spray axis, G z, leads into the wall; G y is down.
_NOZZLE = "gun_nozzle"
_R_TG = RotationMatrix(np.diag([1.0, -1.0, -1.0]))


def tool_boxes(checker: CollisionChecker) -> tuple[ObstacleBox, ...]:
    """Returns boxes around the bodies that move with the nozzle.

    Args:
        checker: Of the robot's cell.

    Returns:
        One for each shape of a body that is fixed to the nozzle: relative to the
        nozzle, along T's axes when the gun is square to the wall, m.
    """
    plant = checker.plant()
    inspector = checker.model().scene_graph().model_inspector()
    context = plant.CreateDefaultContext()
    frame = plant.GetFrameByName(_NOZZLE)
    boxes = []
    for body in plant.GetBodiesWeldedTo(frame.body()):
        X_GB = plant.CalcRelativeTransform(context, frame, body.body_frame())
        for shape in plant.GetCollisionGeometriesForBody(body):
            around = inspector.GetObbInGeometryFrame(shape)
            X_TO = (
                RigidTransform(_R_TG, np.zeros(3))
                @ X_GB
                @ inspector.GetPoseInFrame(shape)
                @ around.pose()
            )
            corners = X_TO @ (_CORNERS * around.half_width()[:, None])
            lower, upper = corners.min(axis=1), corners.max(axis=1)
            boxes.append(ObstacleBox(body.name(), lower, upper))
    return tuple(boxes)


def standoffs_beside(
    x: FloatArray,
    y: FloatArray,
    *,
    obstacles: Sequence[ObstacleBox],
    tool: Sequence[ObstacleBox],
    clearance: float,
    run_out: Sequence[tuple[float, float]],
) -> FloatArray:
    """Returns the least stand-offs at which the tool keeps clear of boxes.

    Args:
        x: (nx,) m in T, evenly spaced, ascending.
        y: (ny,) m in T, the same.
        obstacles: On the wall, in T.
        tool: As `tool_boxes` returns them.
        clearance: Least distance, m.
        run_out: Where the nozzle passes as it stops beyond the end of a stroke: m along
            T y and away from the wall. A stroke may end anywhere.

    Returns:
        (ny, nx) m; -inf where no part of the tool is near any box. It holds for the
        whole cell around each place, and for a stroke that ends in the next one.
    """
    aside = clearance + max(np.diff(x).max(), np.diff(y).max())
    least = np.full((y.size, x.size), -np.inf)
    for obstacle in obstacles:
        for part in tool:
            first = obstacle.lower - part.upper - aside
            last = obstacle.upper - part.lower + aside
            columns = slice(*np.searchsorted(x, [first[0], last[0]]))
            standoff = obstacle.upper[2] - part.lower[2] + clearance
            for beyond, away in ((0.0, 0.0), *run_out):
                ends = [first[1] - beyond, last[1] + beyond]
                window = least[slice(*np.searchsorted(y, ends)), columns]
                np.maximum(window, standoff - away, out=window)
    return least
