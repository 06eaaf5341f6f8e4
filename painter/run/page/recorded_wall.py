"""What `painter segment` leaves in its folder: values, figures, pictures."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from painter.run.pictures.segmentation_picture import segmentation_picture
from painter.run.pictures.style import png
from perception.fine_steps.unseen import Reason
from perception.io.segmentations import save_segmentation, save_wall_mask
from perception.paper_steps.pipeline import SegmentationStages
from perception.recorded.segment_recorded import RecordedWall
from perception.recorded.wall_choice import contrast
from perception.values import Opening, WallSegmentation


def write_recorded_wall(
    folder: Path, wall: RecordedWall, *, title: str
) -> dict[str, Any]:
    """Writes `segmentation.npz`, `.json` and `.png` and `wall_mask.png`.

    Args:
        folder: Where to write; exists.
        wall: What was found.
        title: Heading of the picture.

    Returns:
        The figures that were written to `segmentation.json`.
    """
    figures = segmentation_figures(wall)
    stages = wall.stages
    save_segmentation(folder / "segmentation.npz", stages.segmentation)
    save_wall_mask(folder / "wall_mask.png", stages.segmentation.wall_mask)
    (folder / "segmentation.json").write_text(json.dumps(figures, indent=2) + "\n")
    picture = segmentation_picture(stages, title=title)
    (folder / "segmentation.png").write_bytes(png(picture, dpi=110))
    return figures


def segmentation_figures(wall: RecordedWall) -> dict[str, Any]:
    """Sums a segmentation up in JSON values.

    Args:
        wall: What was found.

    Returns:
        Counts of points; the wall's distance from the origin of the cloud's frame,
        normal (to the side it was seen from) and rms; cell and inlier distance used;
        areas, of what is not to be painted by reason; and lists of openings, with
        their boxes in T (left, bottom, right, top), of planes and of regions.
    """
    stages = wall.stages
    result, found = stages.segmentation, stages.found
    area = result.cell**2
    normal = result.X_WT.rotation().matrix()[:, 2]
    plane = found.planes[stages.wall_plane - 1]
    kept = found.p_WQs[:, found.kept]
    seen = result.labels > 0
    return {
        "points": int(found.kept.size),
        "strays": wall.strays,
        "outliers": int(found.kept.size - found.kept_count),
        "seen_from": wall.side.source.value,
        "cell_m": _rounded(result.cell),
        "inlier_distance_m": _rounded(wall.inlier_distance),
        "wall_distance_m": _rounded(abs(plane.offset)),
        "wall_normal": [_rounded(value) for value in normal],
        "wall_rms_m": _rounded(stages.wall.rms),
        "wall_point_share": _rounded(stages.wall.inlier_share),
        "wall_contrast": _finite(contrast(plane, kept, threshold=wall.inlier_distance)),
        "set_back_area_m2": _rounded(wall.set_back_area),
        "wall_area_m2": _rounded(np.count_nonzero(result.wall_mask) * area),
        "other_area_m2": _rounded(np.count_nonzero(seen & ~result.wall_mask) * area),
        "unseen_area_m2": _rounded(np.count_nonzero(~seen) * area),
        "not_painted_m2": _reasons(result),
        "openings": [_opening_figures(opening) for opening in result.openings],
        "planes": [
            {
                "normal": [_rounded(value) for value in plane.normal],
                "offset_m": _rounded(plane.offset),
                "rms_m": _rounded(plane.rms),
                "points": plane.count,
            }
            for plane in found.planes
        ],
        "regions": [_region_figures(stages, label) for label in _labels(stages)],
    }


def _labels(stages: SegmentationStages) -> range:
    return range(1, int(stages.segmentation.labels.max()) + 1)


def _region_figures(stages: SegmentationStages, label: int) -> dict[str, Any]:
    result = stages.segmentation
    cells = result.labels == label
    depth = result.depth[cells]
    depth = depth[np.isfinite(depth)]
    return {
        "label": label,
        "area_m2": _rounded(np.count_nonzero(cells) * result.cell**2),
        "median_depth_m": _rounded(np.median(depth)) if depth.size else None,
        "wall": bool(result.wall_mask[cells].any()),
    }


def _reasons(result: WallSegmentation) -> dict[str, float]:
    """Returns the area of what is not to be painted by reason, m²."""
    if result.reason is None:
        return {}
    areas = np.bincount(result.reason[~result.wall_mask], minlength=len(Reason))
    return {
        reason.name.lower(): _rounded(areas[reason] * result.cell**2)
        for reason in Reason
        if reason is not Reason.WALL and areas[reason]
    }


def _opening_figures(opening: Opening) -> dict[str, Any]:
    left, bottom = opening.p_TVs.min(axis=1)
    right, top = opening.p_TVs.max(axis=1)
    return {
        "kind": opening.kind,
        "area_m2": _rounded(opening.area),
        "box_m": [_rounded(edge) for edge in (left, bottom, right, top)],
        "depth_m": _finite(opening.depth),
        "glass_share": _rounded(opening.glass_share),
    }


def _rounded(value: float) -> float:
    return round(float(value), 6)


def _finite(value: float) -> float | None:
    """JSON knows no infinity."""
    return _rounded(value) if np.isfinite(value) else None
