"""The wall segmentation: the paper's six steps, one after another."""

import numpy as np
from pydrake.math import RigidTransform

from perception.config import SegmentationConfig
from perception.fine_steps.refine import refine_segmentation
from perception.ground import FloatArray, IntArray
from perception.paper_steps.pipeline import find_planes, segment_tile
from perception.paper_steps.wall import choose_plane, finite_points, wall_on_plane
from perception.values import WallSegmentation


def segment_wall(
    p_WQs: FloatArray,
    X_WT_expected: RigidTransform,
    *,
    width: float,
    height: float,
    config: SegmentationConfig,
    seed: int,
    counts: IntArray | None = None,
    variances: FloatArray | None = None,
    p_WCs: FloatArray | None = None,
    up_W: FloatArray | None = None,
) -> WallSegmentation:
    """Parts the wall tile in front of the robot into wall and other regions.

    The paper's steps find the wall and part the tile; then the mask is drawn anew by
    fine steps (see `refine_segmentation`).

    Source: Tadic et al., "Painting Robot with RealSense D435", 2021, section 4.4.

    Args:
        p_WQs: (3, N) m, in W; non-finite points are dropped.
        X_WT_expected: Tile frame where the wall is expected.
        width: Of the tile, m, along T x.
        height: Of the tile, m, along T y.
        config: Thresholds of the steps.
        seed: Of RANSAC's random triples; same cloud and seed, same result.
        counts: (N,) measurements fused into each point, where that is known.
        variances: (N,) m², of one measurement of each point along the wall's normal.
        p_WCs: (3, k) m, in W, where the pictures were taken, square to the wall.
        up_W: (3,) unit, against gravity: what lies level is no wall; see
            `choose_plane`.

    Returns:
        The segmentation, on the tile frame of the wall as found. Depth is NaN wherever
        nothing was seen, also in the tiny holes that got a label from beside them.

    Raises:
        NoWallError: There are too few points, no plane is near the expected wall, or
            it does not show on the tile.
    """
    found = find_planes(p_WQs, config=config, seed=seed)
    size = {"width": width, "height": height}
    number = choose_plane(
        found.planes,
        X_WT_expected,
        width=width,
        height=height,
        total=found.kept_count,
        config=config,
        up_W=up_W,
    )
    wall = wall_on_plane(
        found.planes[number], X_WT_expected, **size, total=found.kept_count
    )
    coarse = segment_tile(found, wall, number + 1, **size, config=config).segmentation
    # A map has told by its counts what is real. On its even grid the statistical filter
    # takes the rows along edges for outliers, which say where the edges are.
    real = found.kept if counts is None else np.ones_like(found.kept)
    used = np.flatnonzero(finite_points(p_WQs))[real]
    return refine_segmentation(
        coarse,
        wall.X_WT.inverse() @ found.p_WQs.compress(real, axis=1),
        counts=None if counts is None else counts[used],
        variances=None if variances is None else variances[used],
        p_TCs=None if p_WCs is None else wall.X_WT.inverse() @ p_WCs,
        config=config,
        seed=seed,
    )
