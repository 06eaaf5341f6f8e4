"""Reach map: the parts of a tile that a base placement can spray and see.

A placement is the wall's distance from the base axis and the shoulder's height over
the floor. A point of the tile is sprayed if the nozzle reaches the pose square to it at
the spray stand-off. It is seen if it lies in a picture from a pose of the camera that
is square to the wall at the scan distance and reached. Both with the elbow up, within
the joint limits and free of collisions.
"""

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from painter.planning.arm.kinematics import ArmKinematics, ArmLimits
from painter.planning.arm.scan_camera import Footprint
from painter.planning.config import TileConfig
from painter.planning.tile import grid_points, nominal_tile_pose
from perception.ground import BoolArray, FloatArray, FrozenValue


@dataclass(frozen=True, eq=False)
class ReachTask(FrozenValue):
    """What the arm has to reach at a tile.

    Attributes:
        standoff: Nozzle to wall, m.
        scan_distance: Camera to wall, m.
        footprint: Wall in one picture at that distance.
        margin: How far pictures have to reach beyond the tile's edge, m.
    """

    standoff: float
    scan_distance: float
    footprint: Footprint
    margin: float


@dataclass(frozen=True, eq=False)
class TileReach(FrozenValue):
    """The reach from one placement; row 0 at the bottom.

    Attributes:
        x: (nx,) m, columns in T, over the tile and around it.
        y: (ny,) m, rows in T, likewise.
        on_tile: (ny, nx); True on the tile.
        to_see: (ny, nx); True on the tile and the margin of the pictures.
        sprayed: (ny, nx); the nozzle reaches the pose square to the point.
        camera_at: (ny, nx); the camera reaches the pose square to the point.
        seen: (ny, nx); the point is in a picture from such a pose.
    """

    x: FloatArray
    y: FloatArray
    on_tile: BoolArray
    to_see: BoolArray
    sprayed: BoolArray
    camera_at: BoolArray
    seen: BoolArray

    @property
    def spray_share(self) -> float:
        """Share of the tile that can be sprayed."""
        return float(self.sprayed[self.on_tile].mean())

    @property
    def scan_share(self) -> float:
        """Share of the tile and its margin that can be seen."""
        return float(self.seen[self.to_see].mean())


def tile_reach(
    arm: ArmKinematics,
    limits: ArmLimits,
    tile: TileConfig,
    task: ReachTask,
    *,
    is_free: Callable[[FloatArray], BoolArray],
    step: float = 0.05,
    around: float = 0.0,
) -> TileReach:
    """Computes what the arm reaches of a tile from where it stands.

    Args:
        arm: Kinematics, in W.
        limits: Joint limits.
        tile: The tile; its distance and height over the floor are the placement.
        task: Stand-offs and sizes of pictures.
        is_free: Returns which rows of positions (n, 5), rad, are free of collisions.
        step: Spacing of the points, m; points lie on the tile's edges.
        around: How far beyond the tile to compute, m; at least the task's margin.
    """
    around = max(around, task.margin)
    x, y = _ticks(tile.width, around, step), _ticks(tile.height, around, step)
    shape = (len(y), len(x))
    X_WT = nominal_tile_pose(tile)
    ahead_W = -X_WT.rotation().col(2)

    def reached(solve: Callable[..., FloatArray], distance: float) -> BoolArray:
        q = solve((X_WT @ grid_points(x, y, distance)).T, ahead_W, elbow=1)
        mask = limits.contains(q)
        if mask.any():
            mask[mask] = is_free(q[mask])
        return mask.reshape(shape)

    camera_at = reached(arm.solve_camera, task.scan_distance)
    picture = task.footprint
    # Point from camera: y by row and column, x by column and row.
    dx, dy = x - x[:, None], y[:, None] - y
    sees_x = (dx >= -picture.left) & (dx <= picture.right)
    sees_y = (dy >= -picture.below) & (dy <= picture.above)
    return TileReach(
        x=x,
        y=y,
        on_tile=_within(x, y, tile, 0.0),
        to_see=_within(x, y, tile, task.margin),
        sprayed=reached(arm.solve, task.standoff),
        camera_at=camera_at,
        seen=(sees_y.astype(int) @ camera_at.astype(int) @ sees_x.astype(int)) > 0,
    )


def placement(tile: TileConfig, *, distance: float, raised: float) -> TileConfig:
    """Returns the tile in the axes of an arm that stands elsewhere.

    Args:
        tile: The tile before the arm as modelled.
        distance: Of the wall from the base axis, m.
        raised: How much higher than modelled the shoulder is, m.
    """
    return dataclasses.replace(tile, distance=distance, bottom=tile.bottom - raised)


def _ticks(length: float, around: float, step: float) -> FloatArray:
    """Evenly spaced coordinates with both edges, and both outer ends, among them."""
    steps = round(length / step)
    outside = math.ceil(around / step)
    ticks = np.arange(-outside, steps + outside + 1) * (length / steps)
    clipped: FloatArray = np.clip(ticks, -around, length + around)
    return clipped


def _within(x: FloatArray, y: FloatArray, tile: TileConfig, margin: float) -> BoolArray:
    # Rounding moves a point on the edge by less than this.
    margin += 1e-9
    on_x = (x >= -margin) & (x <= tile.width + margin)
    on_y = (y >= -margin) & (y <= tile.height + margin)
    within: BoolArray = on_y[:, None] & on_x
    return within
