"""The paper's six steps, one after another, with the result of each."""

from dataclasses import dataclass

import numpy as np

from perception.config import SegmentationConfig
from perception.errors import NoWallError
from perception.ground import BoolArray, FloatArray, FrozenValue, IntArray
from perception.paper_steps.filters import statistical_filter
from perception.paper_steps.label_grid import NOTHING, LabelGrid, label_grid
from perception.paper_steps.planes import Plane, segment_planes
from perception.paper_steps.regions import (
    absorb_tiny_regions,
    adjacent_regions,
    drop_specks,
    euclidean_clusters,
    join_fragments,
    sort_by_area,
)
from perception.paper_steps.wall import finite_points
from perception.settings import validate
from perception.values import TileSize, Wall, WallSegmentation


@dataclass(frozen=True, eq=False)
class FoundPlanes(FrozenValue):
    """Steps 1 and 2: the filtered cloud and its planes.

    Attributes:
        p_WQs: (3, N) m, in W: the finite points of the cloud.
        kept: (N,) False = outlier by the statistical filter.
        labels: (N,) plane of each point, from 1; 0 = of none, or an outlier.
        planes: The planes in W, plane 1 first.
    """

    p_WQs: FloatArray
    kept: BoolArray
    labels: IntArray
    planes: tuple[Plane, ...]

    @property
    def kept_count(self) -> int:
        """Points that the filter kept."""
        return int(np.count_nonzero(self.kept))


@dataclass(frozen=True, eq=False)
class SegmentationStages(FrozenValue):
    """Everything between a cloud and its segmentation, for pictures and reports.

    Attributes:
        found: Steps 1 and 2.
        wall: The wall among the planes, with the tile on it.
        wall_plane: Label of its plane.
        grid: Step 3: labels and depths over the tile.
        clusters: (ny, nx) step 4a, -1 = nothing seen.
        regions: (ny, nx) step 4b, with fragments joined.
        absorbed: (ny, nx) step 5, -1 = nothing seen.
        segmentation: Step 6, the result.
    """

    found: FoundPlanes
    wall: Wall
    wall_plane: int
    grid: LabelGrid
    clusters: IntArray
    regions: IntArray
    absorbed: IntArray
    segmentation: WallSegmentation


def find_planes(
    p_WQs: FloatArray, *, config: SegmentationConfig, seed: int
) -> FoundPlanes:
    """Does steps 1 and 2: filters the cloud and finds its planes.

    Args:
        p_WQs: (3, N) m, in W; non-finite points are dropped.
        config: Thresholds of the steps.
        seed: Of RANSAC's random triples.

    Returns:
        Filtered cloud and planes.

    Raises:
        NoWallError: There are too few points.
    """
    validate(config, "segmentation")
    p_WQs = p_WQs.compress(finite_points(p_WQs), axis=1)
    kept = statistical_filter(
        p_WQs,
        neighbors=config.neighbors,
        std_multiplier=config.std_multiplier,
        fast=config.fast_filter,
    )
    labels = np.zeros(kept.size, dtype=np.int64)
    labels[kept], planes = segment_planes(
        p_WQs.compress(kept, axis=1), config=config, rng=np.random.default_rng(seed)
    )
    return FoundPlanes(p_WQs=p_WQs, kept=kept, labels=labels, planes=planes)


def segment_tile(
    found: FoundPlanes,
    wall: Wall,
    wall_plane: int,
    tile: TileSize,
    *,
    config: SegmentationConfig,
) -> SegmentationStages:
    """Does steps 3 to 6 on the tile of a wall.

    All regions of the wall's plane are wall, not just the largest: a door or a pipe may
    divide the wall, and both sides are painted.

    Args:
        found: Filtered cloud and planes.
        wall: The wall, with the tile.
        wall_plane: Label of its plane.
        tile: Its size.
        config: Thresholds of the steps.

    Returns:
        The segmentation with its intermediate results.

    Raises:
        NoWallError: No region of the wall's plane is on the tile.
    """
    grid = label_grid(
        wall.X_WT.inverse() @ found.p_WQs.compress(found.kept, axis=1),
        found.labels.compress(found.kept),
        tile,
        cell=config.cell,
        hidden=config.cluster_tolerance,
    )
    clusters = euclidean_clusters(grid, tolerance=config.cluster_tolerance)
    parts = adjacent_regions(clusters)
    area = {"min_area": config.min_region_area, "cell": config.cell}
    regions = join_fragments(parts, **area)
    absorbed = absorb_tiny_regions(regions, grid.labels != NOTHING, **area)
    # All cells of a region have one plane; joined fragments are of none. The last entry
    # is for the cells of no region, numbered -1.
    region_plane = np.full(int(regions.max()) + 2, NOTHING, dtype=np.int64)
    region_plane[regions.ravel()] = np.where(regions == parts, grid.labels, 0).ravel()
    wall_mask = drop_specks(region_plane[absorbed] == wall_plane, **area)
    if not wall_mask.any():
        raise NoWallError(
            f"the wall's plane has no region of {config.min_region_area:g} m² on the "
            f"{tile.width:g} x {tile.height:g} m tile.",
            code="PNT-WALL-003",
        )
    segmentation = WallSegmentation(
        labels=sort_by_area(absorbed).astype(np.uint16),
        depth=grid.depth.astype(np.float32),
        wall_mask=wall_mask,
        X_WT=wall.X_WT,
        cell=config.cell,
    )
    return SegmentationStages(
        found=found,
        wall=wall,
        wall_plane=wall_plane,
        grid=grid,
        clusters=clusters,
        regions=regions,
        absorbed=absorbed,
        segmentation=segmentation,
    )
