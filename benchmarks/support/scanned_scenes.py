"""Looks, scans and segments simulated scenes, without painting them."""

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator

from painter.config import Scenario
from painter.diagrams.paint_cycle import MakePaintCycle
from painter.planning.tile import cell_centres, grid_points
from painter.robot.true_scene import true_scene
from painter.scene import surface_at
from painter.systems.values import Phase
from perception.ground import FrozenValue
from perception.values import WallSegmentation

STEP = 0.1  # Robot time between looks at the cycle, s.
FINE_STEP = 0.02  # The same while the segmentation is due, s.


@dataclass(frozen=True, eq=False)
class ScannedScene(FrozenValue):
    """A scene as the robot found it and as it is.

    Attributes:
        segmentation: What the robot made of its scan.
        kind: (ny, nx) true `SurfaceKind` of each cell, by ray casting.
        scan_time: Robot time of the scan, s.
        compute_time: Wall-clock time of the segmentation, s.
    """

    segmentation: WallSegmentation
    kind: np.ndarray
    scan_time: float
    compute_time: float


def scan_and_segment(scenario: Scenario) -> ScannedScene:
    """Runs a paint cycle up to its segmentation.

    Args:
        scenario: The job.

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
    begun = {
        data["phase"]: time for time, name, data in status.events if name == "phase"
    }
    scene, X_WS = true_scene(scenario)
    return ScannedScene(
        segmentation=result.value,
        kind=true_kind(scene, X_WS.inverse() @ result.value.X_WT, result.value),
        scan_time=begun[Phase.SEGMENT.value] - begun[Phase.SCAN.value],
        compute_time=result.compute_time,
    )


def true_kind(scene, X_ST: RigidTransform, segmentation: WallSegmentation):
    """Returns the true `SurfaceKind` at the cells' centres, (ny, nx)."""
    shape = segmentation.labels.shape
    p_SQs = X_ST @ grid_points(*cell_centres(shape, segmentation.cell))
    _, kind = surface_at(scene, p_SQs[0], p_SQs[1])
    return kind.reshape(shape)
