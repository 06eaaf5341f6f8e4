"""The wall segmentation: the paper's six steps, one after another."""

import numpy as np
from pydrake.math import RigidTransform

from perception.config import SegmentationConfig
from perception.fine_steps.refine import refine_segmentation
from perception.ground import FloatArray
from perception.paper_steps.pipeline import find_planes, segment_tile
from perception.paper_steps.wall import choose_plane, finite_points, wall_on_plane
from perception.values import SurfaceMap, TileSize, WallSegmentation


def segment_wall(
    surface_map: SurfaceMap,
    X_WT_expected: RigidTransform,
    tile: TileSize,
    *,
    config: SegmentationConfig,
    seed: int,
    up_W: FloatArray | None = None,
) -> WallSegmentation:
    """Parts the wall tile in front of the robot into wall and other regions.

    The paper's steps find the wall and part the tile; then fine steps redraw the mask
    (see `refine_segmentation`).

    Source: Tadic et al., "Painting Robot with RealSense D435", 2021, section 4.4.

    Args:
        surface_map: Points in W; non-finite ones are dropped. `SurfaceMap.of_points`
            makes it of a bare cloud.
        X_WT_expected: Tile frame where the wall is expected.
        tile: Size of the tile.
        config: Thresholds of the steps.
        seed: Of RANSAC's random triples; same cloud and seed, same result.
        up_W: (3,) unit, against gravity: level planes are no wall; see `choose_plane`.

    Returns:
        The segmentation, on the tile frame of the wall as found. Depth is NaN wherever
        nothing was seen, also in the tiny holes that got a label from beside them.

    Raises:
        NoWallError: There are too few points, no plane is near the expected wall, or
            it does not show on the tile.
    """
    found = find_planes(surface_map.p_WQs, config=config, seed=seed)
    total = found.kept_count
    number = choose_plane(
        found.planes, X_WT_expected, tile, total=total, config=config, up_W=up_W
    )
    wall = wall_on_plane(found.planes[number], X_WT_expected, tile, total=total)
    coarse = segment_tile(found, wall, number + 1, tile, config=config).segmentation
    counts, variances = surface_map.counts, surface_map.variances
    # Counts show the outliers of a map. On its even grid the statistical filter would
    # drop the rows along edges, and these rows give the position of the edges.
    real = np.ones_like(found.kept) if counts.size else found.kept
    used = np.flatnonzero(finite_points(surface_map.p_WQs))[real]
    points = surface_map.replace(
        p_WQs=found.p_WQs.compress(real, axis=1),
        counts=counts[used] if counts.size else counts,
        variances=variances[used] if variances.size else variances,
    )
    return refine_segmentation(coarse, points, config=config, seed=seed)
