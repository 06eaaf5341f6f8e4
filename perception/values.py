"""Frozen values that perception produces and that travel on Drake ports."""

import dataclasses
from dataclasses import dataclass
from typing import Self

import numpy as np
import numpy.typing as npt
from pydrake.math import RigidTransform

from perception.ground import (
    BoolArray,
    FloatArray,
    FrozenValue,
    IntArray,
    check_positive,
)


@dataclass(frozen=True)
class TileSize:
    """Size of the tile, the part of the wall that one job covers.

    Attributes:
        width: Along T x, m.
        height: Along T y, m.
    """

    width: float
    height: float

    def __post_init__(self) -> None:
        """Raises ValueError if a side is not a positive number."""
        check_positive("tile", width=self.width, height=self.height)

    @property
    def p_TC(self) -> FloatArray:
        """The tile's centre, (3,) m, in T."""
        return np.array([self.width / 2.0, self.height / 2.0, 0.0])

    def shape(self, cell: float) -> tuple[int, int]:
        """Returns (ny, nx) of the grid over the tile with cells of edge `cell`, m."""
        return round(self.height / cell), round(self.width / cell)


@dataclass(frozen=True, eq=False)
class SurfaceMap(FrozenValue):
    """Surface points, one a voxel, as the map accumulator gives them out.

    Attributes:
        p_WQs: (3, N) float64, m, in W.
        normals_W: (3, N) float32, unit, in W, towards the camera that saw the point;
            empty = unknown.
        counts: (N,) int64, depth pixels fused into the point; empty = unknown.
        variances: (N,) float32, m², of the depth of one pixel along the map's z axis;
            empty = unknown.
        frames: Depth images fused so far.
        p_WCs: (3, frames) float64, m, in W: camera centres of these images; empty =
            unknown.
        mount_tilt: Angle between the camera's mount as the images show it and its
            model, rad; the points are not affected.
    """

    p_WQs: FloatArray
    normals_W: npt.NDArray[np.float32]
    counts: IntArray
    variances: npt.NDArray[np.float32]
    frames: int
    p_WCs: FloatArray = dataclasses.field(default_factory=lambda: np.zeros((3, 0)))
    mount_tilt: float = 0.0

    @classmethod
    def empty(cls) -> Self:
        """Makes a map of nothing."""
        return cls(
            p_WQs=np.zeros((3, 0)),
            normals_W=np.zeros((3, 0), dtype=np.float32),
            counts=np.zeros(0, dtype=np.int64),
            variances=np.zeros(0, dtype=np.float32),
            frames=0,
        )

    @classmethod
    def of_points(cls, p_WQs: FloatArray) -> Self:
        """Makes a map of points alone, (3, N) m, in W; nothing else is known."""
        return cls.empty().replace(p_WQs=p_WQs)


@dataclass(frozen=True, eq=False)
class Wall(FrozenValue):
    """A wall found in a cloud, with the tile laid on it.

    Attributes:
        X_WT: Tile frame T in W: origin at the tile's lower-left corner as seen by the
            robot, x right, y up, z out of the wall towards the robot.
        rms: Root mean square distance of the inliers from the plane, m.
        inlier_count: Points within the distance threshold of the plane.
        inlier_share: The same as a share of all points searched.
    """

    X_WT: RigidTransform
    rms: float
    inlier_count: int
    inlier_share: float


@dataclass(frozen=True, eq=False)
class Opening(FrozenValue):
    """A window, door or niche in the wall.

    Attributes:
        kind: "rectangle" or, where none fits, "contour".
        p_TVs: (2, n) m, x and y in T of its corners, counter-clockwise.
        area: Of its cells, m².
        depth: Median depth of what is recessed in it, m along T z against the wall's
            surface; NaN if nothing but glass was seen.
        glass_share: Share of its cells that are glass.
    """

    kind: str
    p_TVs: FloatArray
    area: float
    depth: float
    glass_share: float


@dataclass(frozen=True, eq=False)
class WallSegmentation(FrozenValue):
    """Labelled grid over the tile; row 0 is the bottom row, column 0 the left one.

    Attributes:
        labels: (ny, nx) uint16; 0 = nothing seen, 1 = largest region, 2 = next ...
        depth: (ny, nx) float32, m along T z; NaN = nothing seen.
        wall_mask: (ny, nx) bool; True = wall, to be painted.
        X_WT: Tile frame T in W (see `Wall`).
        cell: Edge of a cell, m.
        surface: (ny, nx) float32, m along T z: the wall's own surface, bulge and twist
            included, also where things hide it. None where the mask comes from the
            paper's steps alone; so are the fields below.
        normals: (ny, nx, 3) float32, unit, in T: the normals of that surface.
        confidence: (ny, nx) float32, 0 to 1: how sure each cell of the mask is.
        reason: (ny, nx) uint8, values of `perception.fine_steps.unseen.Reason`.
        openings: Windows, doors and niches, the largest first.
    """

    labels: npt.NDArray[np.uint16]
    depth: npt.NDArray[np.float32]
    wall_mask: BoolArray
    X_WT: RigidTransform
    cell: float
    surface: npt.NDArray[np.float32] | None = None
    normals: npt.NDArray[np.float32] | None = None
    confidence: npt.NDArray[np.float32] | None = None
    reason: npt.NDArray[np.uint8] | None = None
    openings: tuple[Opening, ...] = ()
