"""A log of a cycle, written down by hand."""

import numpy as np

from painter.cycle.cycle_log import CycleLog
from painter.systems.values import CycleStatus, Phase
from perception.values import SurfaceMap


def cycle_log(**changes):
    """Two samples of an arm that stood still."""
    values = {
        "status": CycleStatus(phase=Phase.DONE, finished=True),
        "end_time": 1.0,
        "time": np.array([0.0, 1.0]),
        "q": np.zeros((2, 5)),
        "v": np.zeros((2, 5)),
        "trigger": np.array([0.0, 1.0]),
        "X_WG": np.tile(np.eye(4), (2, 1, 1)),
        "X_WG_desired": np.tile(np.eye(4), (2, 1, 1)),
        "clearance_time": np.zeros(0),
        "clearance": np.zeros(0),
        "floor_clearance": np.zeros(0),
        "surface_map": SurfaceMap.empty().replace(
            p_WQs=np.array([[1.0], [2.0], [3.0]]),
            normals_W=np.array([[-1.0], [0.0], [0.0]], dtype=np.float32),
            counts=np.array([3]),
            variances=np.array([1e-6], dtype=np.float32),
        ),
        "segmentation": None,
        "program": None,
        "film": None,
        "look_image": None,
    }
    return CycleLog(**(values | changes))
