"""Looks, scans and segments simulated scenes, without painting them."""

import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator

from painter.config import Scenario
from painter.diagrams.paint_cycle import MakePaintCycle
from painter.planning.tile import cell_centres, grid_points, nominal_tile_pose
from painter.scene import load_scene, surface_at, wall_pose
from painter.systems.values import Phase
from perception.values import WallSegmentation

STEP = 0.1  # Robot time between looks at the cycle, s.
FINE_STEP = 0.02  # The same while the segmentation is due, s.


def scan_and_segment(scenario: Scenario) -> tuple[WallSegmentation, np.ndarray, float]:
    """Runs a paint cycle up to its segmentation.

    Args:
        scenario: The job.

    Returns:
        The segmentation; the true kind (`SurfaceKind`) of each cell, (ny, nx), by ray
        casting; and the wall-clock time of the segmentation, s.

    Raises:
        RuntimeError: The cycle ended before; says why.
    """
    cycle = MakePaintCycle(scenario).diagram
    simulator = Simulator(cycle)
    context = simulator.get_mutable_context()
    simulator.Initialize()
    while True:
        status = cycle.GetOutputPort("cycle_status").Eval(context)
        result = cycle.GetOutputPort("segmentation").Eval(context)
        if status.finished or result.error:
            raise RuntimeError(f"{scenario.name}: {result.error or status.cause}")
        if result.value is not None:
            break
        step = FINE_STEP if status.phase == Phase.SEGMENT else STEP
        simulator.AdvanceTo(context.get_time() + step)
    scene = load_scene(scenario.scene, scenario.random_seed)
    X_WS = wall_pose(scene, nominal_tile_pose(scenario.tile))
    kind = true_kind(scene, X_WS.inverse() @ result.value.X_WT, result.value)
    return result.value, kind, result.compute_time


def true_kind(scene, X_ST: RigidTransform, segmentation: WallSegmentation):
    """Returns the true `SurfaceKind` at the cells' centres, (ny, nx)."""
    shape = segmentation.labels.shape
    p_SQs = X_ST @ grid_points(*cell_centres(shape, segmentation.cell))
    _, kind = surface_at(scene, p_SQs[0], p_SQs[1])
    return kind.reshape(shape)
