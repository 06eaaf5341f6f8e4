"""Segmentation of a recording, from its file or its points."""

import dataclasses
from pathlib import Path

import numpy as np

from perception.config import SegmentationConfig
from perception.errors import GridSizeError
from perception.ground import FloatArray
from perception.io.clouds import RecordedCloud
from perception.io.recordings import read_recording
from perception.recorded.segment_recorded import (
    MAX_CELLS,
    RecordedWall,
    segment_recorded,
)


def segment_file(
    cloud: Path | str | FloatArray,
    *,
    config: SegmentationConfig | None = None,
    cell: float | None = None,
    inlier_distance: float | None = None,
    tile: tuple[float, float] | None = None,
    up: FloatArray | None = None,
    viewpoint: FloatArray | None = None,
    distance: float | None = None,
    max_range: float | None = None,
    set_back: float = 0.0,
    fine: bool = False,
    intrinsics: Path | None = None,
    unit: float = 1.0,
    seed: int = 1,
) -> RecordedWall:
    """Segments a recorded cloud or depth image into wall and other regions.

    Example: `segment("cloud.ply", tile=(2.0, 2.0)).stages.segmentation.wall_mask`.

    Args:
        cloud: PLY, PCD, XYZ, NPY or NPZ file, depth PNG or folder of them, RealSense
            bag, or points: (3, N) m, in the recording's frame W.
        config: Thresholds; None = the defaults.
        cell: Edge of a grid cell, m; None = the config's, or larger where the points
            are sparse or the wall is large.
        inlier_distance: Greatest distance of a wall point from the wall's plane, m;
            None = from the noise of the points, at most the config's.
        tile: Width and height of the tile, m, centred on the wall; None = all of it.
        up: (3,) unit vector against gravity, in W; None = the cloud is in a camera's
            frame (up = -y), and floors are not told from walls.
        viewpoint: (3,) m, of the sensor, in W; None = from the file, or from the
            points (see `side_of_view`).
        distance: Expected distance of the wall from the sensor, m; None = any.
        max_range: Greatest distance of a point from the sensor, m; None = any.
        set_back: How far behind the wall's plane parts beside it may lie and still
            be wall, such as dormers, m.
        fine: Whether the mask is drawn by fine steps, as on the robot; see
            `refine_segmentation`.
        intrinsics: Camera of depth images; None = intrinsics.json beside them.
        unit: Length of a cloud file's unit, m.
        seed: Of RANSAC's random triples.

    Returns:
        The wall: `stages` holds the segmentation and every stage on the way to it.

    Raises:
        CloudReadError: The file is unusable.
        NoWallError: There are too few points or no plane is a wall; says why.
        GridSizeError: The tile is smaller than a cell or has too many of them.
    """
    config = SegmentationConfig() if config is None else config
    if cell is not None:
        config = dataclasses.replace(config, cell=cell)
    if inlier_distance is not None:
        config = dataclasses.replace(config, distance_threshold=inlier_distance)
    if tile is not None:
        _check_tile(*tile, config.cell)
    if isinstance(cloud, np.ndarray):
        recording = RecordedCloud(p_WQs=cloud)
    else:
        recording = read_recording(Path(cloud), intrinsics=intrinsics, unit=unit)
    p_WC = recording.p_WC if viewpoint is None else viewpoint
    points = recording.p_WQs
    if max_range is not None:
        with np.errstate(over="ignore"):
            offsets = points - (np.zeros(3) if p_WC is None else p_WC)[:, None]
            points = points[:, np.linalg.norm(offsets, axis=0) <= max_range]
    return segment_recorded(
        points,
        tile=tile,
        config=config,
        seed=seed,
        up_W=up,
        distance=distance,
        p_WC=p_WC,
        fit_cell=cell is None,
        fit_inlier_distance=inlier_distance is None,
        set_back=set_back,
        fine=fine,
    )


def _check_tile(width: float, height: float, cell: float) -> None:
    if min(width, height) < cell:
        raise GridSizeError(
            f"a tile of {width:g} x {height:g} m is smaller than a cell, {cell:g} m.",
            code="PNT-USE-048",
        )
    if width * height / cell**2 > MAX_CELLS:
        raise GridSizeError(
            f"a tile of {width:g} x {height:g} m with cells of {cell:g} m has more "
            f"than {MAX_CELLS:.0e} cells; choose larger cells.",
            code="PNT-USE-049",
        )
