"""Beyond the paper: a mask by steps from the wall's own surface, with reasons."""

import dataclasses
import functools
import math
from typing import TypeVar

import numpy as np
from scipy.ndimage import distance_transform_edt, label
from scipy.special import erf
from threadpoolctl import ThreadpoolController

from perception.config import SegmentationConfig
from perception.errors import NoWallError
from perception.fine_steps.openings import find_openings
from perception.fine_steps.outlines import straighten
from perception.fine_steps.steps import StepDetection, find_steps, sub_cells
from perception.fine_steps.unseen import Reason, close_gaps, explain
from perception.fine_steps.votes import point_votes, wall_share
from perception.fine_steps.wall_surface import blocks_of, fit_wall_surface
from perception.ground import BoolArray, FloatArray, IntArray
from perception.paper_steps.regions import drop_specks, sort_by_area
from perception.values import SurfaceMap, WallSegmentation

Grid = TypeVar("Grid", BoolArray, IntArray, FloatArray)

_SQUARE = np.ones((3, 3), dtype=np.bool_)
_SPLITS = (2, 4)  # Least and most sub-cells along a cell's edge.
_MAJORITY = 0.58
"""Share of votes from which a cell is wall: overspray on a thing is worse than a bare
strip of wall, and edges are known to a fraction of the spacing of points."""
_GAP_CONFIDENCE = 0.5  # Of gaps between points that are filled in.


def refine_segmentation(
    coarse: WallSegmentation,
    surface_map: SurfaceMap,
    *,
    config: SegmentationConfig,
    seed: int,
) -> WallSegmentation:
    """Redraws the mask by significant steps from the wall's own surface.

    The paper's steps divide a cloud by planes a few cm thick. Here a surface is fitted
    to most of their wall, and cells level with it are wall. Unseen cells are not
    paintable, but for gaps between points; each has a reason.

    Args:
        coarse: Result of the paper's steps.
        surface_map: The points it was made of, in W, outliers left out. Without counts
            all weigh the same.
        config: Thresholds.
        seed: Of RANSAC's random triples.

    Returns:
        The segmentation with new mask and labels, and with surface, normals,
        confidence, reasons and openings.

    Raises:
        NoWallError: No part of the tile is level with a common surface.
    """
    X_TW = coarse.X_WT.inverse()
    p_TQs = X_TW @ surface_map.p_WQs
    p_WCs = surface_map.p_WCs
    counts, variances = surface_map.counts, surface_map.variances
    cell = coarse.cell
    ny, nx = coarse.labels.shape
    spacing = _spacing(p_TQs, coarse, config)
    split = min(max(round(cell / spacing), _SPLITS[0]), _SPLITS[1])
    fine = sub_cells(
        p_TQs,
        counts=counts if counts.size else None,
        variances=variances.astype(np.float64) if variances.size else None,
        shape=(ny, nx),
        cell=cell,
        split=split,
        spacing=spacing,
    )
    near = np.abs(fine.depth) <= config.distance_threshold + config.cluster_tolerance
    near |= np.repeat(np.repeat(coarse.wall_mask, split, axis=0), split, axis=1)
    try:
        # The splines' matrices are too small for several threads: where another process
        # holds a core, OpenBLAS's threads wait for each other at each call.
        with _threads().limit(limits=1, user_api="blas"):
            surface = fit_wall_surface(
                fine.depth, near, cell=cell / split, rng=np.random.default_rng(seed)
            )
    except ValueError as error:
        raise NoWallError(
            f"the wall has no surface on the tile: {error}", code="PNT-WALL-001"
        ) from error
    steps = find_steps(fine, surface, cell=cell / split, config=config)
    votes = point_votes(fine, steps, surface)
    share = wall_share(votes, (ny, nx), cell=cell, spacing=spacing)
    seen = np.asarray(np.isfinite(blocks_of(steps.residual, split)).any(axis=2))
    gap = close_gaps(seen, spacing=spacing, cell=cell)
    hole = ~seen & ~gap
    level = _fill(seen & (share > _MAJORITY), seen, gap)
    level = straighten(level | hole, votes, cell=cell) & ~hole
    residual = _fill(_mean_residual(steps, level, split), seen, gap)
    off = drop_specks(~level, min_area=config.min_object_area, cell=cell)
    mask = drop_specks(~off & ~hole, min_area=config.min_region_area, cell=cell)
    side = np.where(residual >= 0.0, Reason.RAISED, Reason.RECESSED)
    reason = np.where(off, side, Reason.SPECK)
    p_TCs = X_TW @ p_WCs if p_WCs.size else None
    reason = explain(reason, residual, hole, cell=cell, p_TCs=p_TCs)
    openings = find_openings(reason, residual, cell=cell)
    reason[mask] = Reason.WALL
    if not mask.any():
        raise NoWallError(
            f"nothing of {config.min_region_area:g} m² on the {nx * cell:g} x "
            f"{ny * cell:g} m tile is level with the wall.",
            code="PNT-WALL-002",
        )
    middle = (slice(split // 2, None, split),) * 2
    return dataclasses.replace(
        coarse,
        wall_mask=mask,
        labels=_labels(coarse, mask, hole).astype(np.uint16),
        surface=surface.height[middle].astype(np.float32),
        normals=surface.normals[middle].astype(np.float32),
        confidence=_confidence(steps, share, gap, hole, split).astype(np.float32),
        reason=reason.astype(np.uint8),
        openings=openings,
    )


@functools.cache
def _threads() -> ThreadpoolController:
    """Returns the control of the loaded libraries' threads."""
    return ThreadpoolController()


def _mean_residual(steps: StepDetection, level: BoolArray, split: int) -> FloatArray:
    """Returns each cell's mean residual, m, over its sub-cells of the same level."""
    residual = blocks_of(steps.residual, split)
    known = np.isfinite(residual)
    alike = known & (blocks_of(steps.level, split) == level[:, :, np.newaxis])
    alike = np.where(alike.any(axis=2, keepdims=True), alike, known)
    total = np.where(alike, residual, 0.0).sum(axis=2)
    with np.errstate(invalid="ignore"):
        mean: FloatArray = total / alike.sum(axis=2)
    return mean


def _spacing(
    p_TQs: FloatArray, coarse: WallSegmentation, config: SegmentationConfig
) -> float:
    """Returns the typical distance of points on the wall, m."""
    ny, nx = coarse.wall_mask.shape
    columns, rows = np.floor(p_TQs[:2] / coarse.cell).astype(np.int64)
    on = (columns >= 0) & (columns < nx) & (rows >= 0) & (rows < ny)
    on &= np.abs(p_TQs[2]) <= config.distance_threshold
    on[on] = coarse.wall_mask[rows[on], columns[on]]
    area = np.count_nonzero(coarse.wall_mask) * coarse.cell**2
    return math.sqrt(area / max(1, int(np.count_nonzero(on))))


def _fill(values: Grid, known: BoolArray, gap: BoolArray) -> Grid:
    """Gives the cells of gaps the value of the nearest known cell."""
    if not known.any():
        return values
    rows, columns = distance_transform_edt(
        ~known, return_distances=False, return_indices=True
    )
    return np.where(gap, values[rows, columns], values)


def _labels(coarse: WallSegmentation, mask: BoolArray, hole: BoolArray) -> IntArray:
    """Returns labels by area: the mask's parts, and the paper's regions beside them."""
    parts, count = label(mask, structure=_SQUARE)
    regions = np.where(coarse.wall_mask, 0, coarse.labels.astype(np.int64))
    # Former wall joins the region that it touches or becomes one of its own.
    fresh, number = label(~mask & ~hole & (regions == 0), structure=_SQUARE)
    old = (regions > 0) & ~mask & ~hole
    if old.any() and number:
        distance, (rows, columns) = distance_transform_edt(~old, return_indices=True)
        touching = (fresh > 0) & (distance <= 2.0)
        regions = np.where(touching, regions[rows, columns], regions)
        fresh = np.where(touching, 0, fresh)
    top = count + int(regions.max(initial=0)) + 1
    merged = np.where(mask, parts - 1, np.where(regions > 0, count + regions, -1))
    merged = np.where(~mask & (fresh > 0), top + fresh, merged)
    return sort_by_area(np.where(hole, -1, merged))


def _confidence(
    steps: StepDetection, share: FloatArray, gap: BoolArray, hole: BoolArray, split: int
) -> FloatArray:
    """Returns the confidence of each cell's answer, 0 to 1.

    The chance that a normal error of the residual's standard deviation does not carry
    it over the bound, times how clearly the sub-cells voted.
    """
    margin = np.abs(np.abs(steps.residual) - steps.bound)
    sure = erf(margin / (math.sqrt(2.0) * np.maximum(steps.sigma, 1e-6)))
    blocks = blocks_of(sure, split)
    known = np.isfinite(blocks)
    mean = np.where(known, blocks, 0.0).sum(axis=2) / np.maximum(known.sum(axis=2), 1)
    confidence = mean * np.abs(2.0 * share - 1.0)
    return np.where(hole, 0.0, np.where(gap, _GAP_CONFIDENCE, confidence))
