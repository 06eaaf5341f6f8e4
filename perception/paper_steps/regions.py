"""Steps 4 to 6 of the segmentation: regions of the label grid.

Regions and clusters are numbered from 0 in the order of their first cell, row by row;
-1 marks cells that belong to none.
"""

import math
from typing import TypeVar

import numpy as np
from scipy.ndimage import binary_opening, distance_transform_edt, label
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from perception.ground import BoolArray, FloatArray, IntArray
from perception.paper_steps.label_grid import NOTHING, LabelGrid

Grid = TypeVar("Grid", IntArray, FloatArray)

# Half of the eight neighbours: those that come later, row by row.
_NEIGHBOURS = ((0, 1), (1, -1), (1, 0), (1, 1))


def euclidean_clusters(grid: LabelGrid, *, tolerance: float) -> IntArray:
    """Step 4a: parts each label's cells into clusters that are far apart in space.

    Two cells of one label belong to one cluster when a chain of such cells joins them
    whose links are no longer than `tolerance`, depth included. That is the paper's
    k-d tree clustering of the cells' points (cell centre and depth), done on the grid:
    a link can only reach cells within `tolerance` in the plane, so it is enough to
    compare the grid with itself moved by each such offset.

    Source: Tadic et al., "Painting Robot with RealSense D435", 2021, section 4.4 (4a).

    Args:
        grid: Labels and depths.
        tolerance: Longest link, m.

    Returns:
        (ny, nx) cluster of each cell, -1 where nothing was seen.
    """
    seen = grid.labels != NOTHING
    reach = math.floor(tolerance / grid.cell + 1e-9)
    farther = [
        (dy, dx)
        for dy in range(reach + 1)
        for dx in range(-reach, reach + 1)
        if (dy, dx) > (0, 0) and (dy, dx) not in _NEIGHBOURS
    ]
    numbers = np.arange(seen.size).reshape(seen.shape)
    # Neighbours already connect most cells; from then on only the few links between
    # two clusters matter.
    for offsets in (list(_NEIGHBOURS), farther):
        pairs = [np.zeros((2, 0), dtype=np.int64)]
        pairs += [_links(grid, numbers, offset, tolerance) for offset in offsets]
        numbers = _components(np.concatenate(pairs, axis=1), seen.size)[numbers]
    clusters = np.where(seen, numbers, -1)
    clusters[seen] = _ranks(clusters[seen])
    return clusters


def adjacent_regions(clusters: IntArray) -> IntArray:
    """Step 4b: parts each cluster into regions whose cells touch (8 neighbours).

    Depth does not count here. Cells of cluster -1 (nothing seen) form regions too:
    holes, which are kept or filled by their size.

    Source: Tadic et al., 2021, section 4.4 (4b).

    Args:
        clusters: (ny, nx) from `euclidean_clusters`.

    Returns:
        (ny, nx) region of each cell.
    """
    numbers = np.arange(clusters.size).reshape(clusters.shape)
    pairs = []
    for offset in _NEIGHBOURS:
        here, there = _moved(clusters, offset)
        a, b = _moved(numbers, offset)
        pairs.append(np.stack([a[here == there], b[here == there]]))
    regions = _components(np.concatenate(pairs, axis=1), clusters.size)
    return regions.reshape(clusters.shape)


def join_fragments(regions: IntArray, *, min_area: float, cell: float) -> IntArray:
    """Joins tiny regions that lie together into one, between steps 4 and 5.

    A thing that is not flat (a plant behind glass, a pipe, a curtain) splits into many
    planes and so into many tiny regions. Each alone would inherit from the wall around
    it and be painted. Together they are too large for noise, so they are kept as one
    region. Noise along edges is one or two cells wide and stays as it is: only patches
    that a square of 3 x 3 cells fits into are joined.

    Source: ours; the paper's step 5 has no such exception.

    Args:
        regions: (ny, nx) from `adjacent_regions`.
        min_area: Area below which a region is tiny, m².
        cell: Edge of a cell, m.

    Returns:
        (ny, nx) region of each cell; joined ones have new numbers at the end.
    """
    square = np.ones((3, 3), dtype=np.bool_)
    tiny = _tiny(regions, min_area=min_area, cell=cell)
    patches, _ = label(binary_opening(tiny[regions], square), structure=square)
    small = _tiny(patches, min_area=min_area, cell=cell)
    joined = (patches > 0) & ~small[patches]
    return np.where(joined, patches + regions.max(), regions)


def absorb_tiny_regions(
    regions: IntArray, seen: BoolArray, *, min_area: float, cell: float
) -> IntArray:
    """Step 5: tiny regions and holes inherit from the nearest cell of a large region.

    Nearest is meant in the plane of the wall. A hole of `min_area` or more stays a
    hole: unseen wall is not painted.

    Source: Tadic et al., 2021, section 4.4 (5).

    Args:
        regions: (ny, nx) from `adjacent_regions` or `join_fragments`.
        seen: (ny, nx) False = nothing was seen in the cell.
        min_area: Area below which a region is tiny, m².
        cell: Edge of a cell, m.

    Returns:
        (ny, nx) region of each cell, -1 in large holes; -1 everywhere if no region is
        large.
    """
    tiny = _tiny(regions, min_area=min_area, cell=cell)
    large = seen & ~tiny[regions]
    absorbed = np.where(large, regions, -1)
    if not large.any():
        return absorbed
    rows, columns = distance_transform_edt(
        ~large, return_distances=False, return_indices=True
    )
    return np.where(tiny[regions], absorbed[rows, columns], absorbed)


def drop_specks(mask: BoolArray, *, min_area: float, cell: float) -> BoolArray:
    """Removes tiny isolated parts from a mask.

    A stray return in a large hole, such as a window, inherits from the wall as the
    nearest; it does not touch the wall and is not painted.

    Args:
        mask: (ny, nx).
        min_area: Area below which a part (8 neighbours) is tiny, m².
        cell: Edge of a cell, m.

    Returns:
        (ny, nx) the mask without them.
    """
    parts, _ = label(mask, structure=np.ones((3, 3)))
    kept: BoolArray = mask & ~_tiny(parts, min_area=min_area, cell=cell)[parts]
    return kept


def sort_by_area(regions: IntArray) -> IntArray:
    """Step 6: labels regions by area.

    Source: Tadic et al., 2021, section 4.4 (6).

    Args:
        regions: (ny, nx), -1 = of no region.

    Returns:
        (ny, nx), 1 = the largest region, 2 = the next, ...; 0 = of no region. Of two
        equally large regions the lower number comes first.
    """
    present, areas = np.unique(regions[regions >= 0], return_counts=True)
    ranks = np.zeros(int(regions.max(initial=-1)) + 2, dtype=np.int64)
    ranks[present[np.argsort(-areas, kind="stable")]] = np.arange(1, present.size + 1)
    return ranks[regions]  # Number -1 reads the last entry, which stays 0.


def _tiny(regions: IntArray, *, min_area: float, cell: float) -> BoolArray:
    """Returns for each region number whether its area is below the bound."""
    # The margin keeps a region of exactly the area, as in 50 x (0.01 m)².
    tiny: BoolArray = np.bincount(regions.ravel()) * cell**2 < min_area * (1.0 - 1e-9)
    return tiny


def _links(
    grid: LabelGrid, numbers: IntArray, offset: tuple[int, int], tolerance: float
) -> IntArray:
    """Returns the (2, M) pairs of clusters that cells at an offset link.

    Linked are cells of one label that are close to one another, depth included.
    """
    number_a, number_b = _moved(numbers, offset)
    label_a, label_b = _moved(grid.labels, offset)
    depth_a, depth_b = _moved(grid.depth, offset)
    apart = np.nonzero((number_a != number_b) & (label_a == label_b))
    across = math.hypot(*offset) * grid.cell
    # A comparison with NaN, where nothing was seen, is False.
    close = np.hypot(across, depth_a[apart] - depth_b[apart]) <= tolerance + 1e-9
    return np.stack([number_a[apart][close], number_b[apart][close]])


def _moved(grid: Grid, offset: tuple[int, int]) -> tuple[Grid, Grid]:
    """Returns two views of a grid: cell (0, 0) of one is `offset` on in the other."""
    dy, dx = offset
    ny, nx = grid.shape
    rows, columns = max(0, ny - dy), max(0, nx - abs(dx))
    left, right = max(0, -dx), max(0, dx)
    here = grid[:rows, left : left + columns]
    there = grid[dy : dy + rows, right : right + columns]
    return here, there


def _components(pairs: IntArray, count: int) -> IntArray:
    """Numbers the components of a graph of `count` nodes, given as (2, M) links."""
    links = coo_array(
        (np.ones(pairs.shape[1], dtype=np.int8), tuple(pairs)), (count,) * 2
    )
    _, numbers = connected_components(links, directed=False)
    return _ranks(numbers)


def _ranks(numbers: IntArray) -> IntArray:
    """Renumbers from 0 in the order in which the numbers first occur."""
    _, first, dense = np.unique(numbers, return_index=True, return_inverse=True)
    ranks = np.empty(first.size, dtype=np.int64)
    ranks[np.argsort(first)] = np.arange(first.size)
    return ranks[dense]
