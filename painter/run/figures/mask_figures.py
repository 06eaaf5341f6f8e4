"""Figures that compare the segmented mask with the truth."""

import numpy as np
from pydrake.math import RigidTransform
from scipy import ndimage

from perception.ground import BoolArray


def mask_iou(mask: BoolArray, truth: BoolArray) -> float:
    """Intersection over union of two masks; 1 if both are empty.

    Args:
        mask: (ny, nx) segmented wall.
        truth: (ny, nx) true wall on the same grid.

    Raises:
        ValueError: The shapes differ.
    """
    _check_shapes(mask, truth)
    union = np.count_nonzero(mask | truth)
    return 1.0 if union == 0 else float(np.count_nonzero(mask & truth) / union)


def boundary(mask: BoolArray) -> BoolArray:
    """Marks the cells of a mask that share an edge with a cell outside it.

    The border of the grid is no boundary: the wall goes on beyond the tile.
    """
    return mask & ~ndimage.binary_erosion(mask, border_value=1)


def edge_errors(mask: BoolArray, truth: BoolArray, cell: float) -> np.ndarray | None:
    """Distance from each boundary cell of a mask to the truth's boundary.

    Args:
        mask: (ny, nx) segmented wall.
        truth: (ny, nx) true wall on the same grid.
        cell: Edge of a cell, m.

    Returns:
        (n,) m between cell centres, so in steps of the cell; None where one of the two
        has no boundary on the tile.

    Raises:
        ValueError: The shapes differ.
    """
    _check_shapes(mask, truth)
    edge, true_edge = boundary(mask), boundary(truth)
    if not edge.any() or not true_edge.any():
        return None
    return ndimage.distance_transform_edt(~true_edge, sampling=cell)[edge]


def mask_figures(
    mask: BoolArray, truth: BoolArray, cell: float
) -> dict[str, float | None]:
    """Returns `mask_iou`, `mask_edge_error_median_m` and `mask_edge_error_p95_m`."""
    errors = edge_errors(mask, truth, cell)
    return {
        "mask_iou": mask_iou(mask, truth),
        "mask_edge_error_median_m": None
        if errors is None
        else float(np.median(errors)),
        "mask_edge_error_p95_m": (
            None if errors is None else float(np.percentile(errors, 95))
        ),
    }


def tile_figures(X_ST: RigidTransform) -> dict:
    """How far the robot's tile lies from where the scene has it.

    Args:
        X_ST: The robot's tile frame in S, which is the tile frame as the job wants it.

    Returns:
        `tile_offset_m`: right and up along the wall; `wall_distance_error_m`: positive
        where the robot takes the wall for nearer than it is; `wall_tilt_error_deg`:
        angle between the normals.
    """
    dx, dy, dz = X_ST.translation()
    tilt = np.arccos(np.clip(X_ST.rotation().matrix()[2, 2], -1.0, 1.0))
    return {
        "tile_offset_m": [float(dx), float(dy)],
        "wall_distance_error_m": float(dz),
        "wall_tilt_error_deg": float(np.rad2deg(tilt)),
    }


def _check_shapes(mask: BoolArray, truth: BoolArray) -> None:
    if mask.shape != truth.shape:
        raise ValueError(f"mask is {mask.shape}, truth is {truth.shape}.")
