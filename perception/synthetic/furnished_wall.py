"""A made-up wall with window, door, boxes, bottle and stick, and its truth.

Larger and rougher than `synthetic`: a cloud of any number of points as a fused depth
map has them, with blurred and mixed edges, glass and strays, to compare whole
segmentations with one another and with the truth.
"""

import functools
import math
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from perception.ground import BoolArray, FloatArray, FrozenValue, IntArray
from perception.values import TileSize

EDGE = 2.0  # Of the square tile, m.
TILE = TileSize(EDGE, EDGE)
MARGIN = 0.2  # Of wall around the tile, m.
STAND_OFF = 0.7  # Of the camera from the wall, m; Source: Tadic et al., 2021, 4.1.


class Thing(IntEnum):
    """What is seen at a place of the tile."""

    WALL = 0
    WINDOW = 1
    DOOR = 2
    BOX = 3
    BOTTLE = 4
    STICK = 5


@dataclass(frozen=True, eq=False)
class FurnishedWall(FrozenValue):
    """Cloud of a wall with things on it, and what is where.

    Attributes:
        p_CQs: (3, N) m, float32 values, in C (x right, y down, z ahead), random order.
        things: (ny, nx) `Thing` at the centre of each cell; row 0 at the bottom.
        X_CT: Tile frame in C.
        cell: Edge of a cell, m.
    """

    p_CQs: FloatArray
    things: IntArray
    X_CT: RigidTransform
    cell: float

    @property
    def mask(self) -> BoolArray:
        """(ny, nx) True = wall, to be painted."""
        wall: BoolArray = self.things == Thing.WALL
        return wall

    def iou(self, wall_mask: BoolArray) -> float:
        """Returns the overlap of a (ny, nx) mask with the truth: |A and B|/|A or B|."""
        both = np.count_nonzero(wall_mask & self.mask)
        return float(both / np.count_nonzero(wall_mask | self.mask))

    def recall(self, wall_mask: BoolArray, thing: Thing) -> float:
        """Returns the share of a thing's cells that a (ny, nx) mask leaves out."""
        own = self.things == thing
        return float(np.count_nonzero(own & ~wall_mask) / np.count_nonzero(own))


def furnished_wall(
    points: int,
    *,
    seed: int,
    noise: float = 0.002,
    edge_blur: float = 0.002,
    stray_share: float = 0.002,
    cell: float = 0.01,
) -> FurnishedWall:
    """Makes a wall 0.7 m from a camera that looks at the middle of its tile.

    Where the things are varies a little with the seed. The depth of a point is that of
    the surface `edge_blur` (standard deviation) beside it, for half of the points mixed
    with the surface at its own place: so edges are blurred, and flying points fill the
    step between near and far. Glass returns nothing for half of its points, what is
    behind for a third, a reflection for the rest. Strays fill the space 0.5 m before
    and behind the wall.

    Args:
        points: Of the cloud.
        seed: Of everything random.
        noise: Standard deviation of depth, m.
        edge_blur: Of the place that a point's depth is taken from, m.
        stray_share: Share of points that are strays.
        cell: Edge of a cell of the truth, m.

    Returns:
        The cloud and its truth.
    """
    rng = np.random.default_rng(seed)
    surface = functools.partial(
        _surface,
        shifts=rng.uniform(-0.03, 0.03, (6, 2)),
        lean=rng.uniform(-0.1, 0.1),
    )
    strays = round(stray_share * points)
    # Glass keeps at most 5 % of the points; the surplus is cut off at the end.
    side = math.sqrt(1.05 * (points - strays)) / (EDGE + 2 * MARGIN)
    # A jittered lattice: a fused map has one point a voxel.
    lattice = np.arange(round((EDGE + 2 * MARGIN) * side)) / side - MARGIN
    x, y = (axis.ravel() for axis in np.meshgrid(lattice, lattice))
    x, y = (axis + rng.uniform(0.0, 1.0 / side, axis.size) for axis in (x, y))
    z, _, glass = surface(x, y)
    beside = rng.normal(0.0, edge_blur, (2, x.size))
    z_beside, _, _ = surface(x + beside[0], y + beside[1])
    share = np.where(rng.random(x.size) < 0.5, rng.random(x.size), 1.0)
    z = z + share * (z_beside - z) + rng.normal(0.0, noise, x.size)
    fate = rng.random(x.size)
    through, mirrored = glass & (fate < 0.33), glass & (fate >= 0.83)
    z[through] -= rng.uniform(0.8, 1.5, np.count_nonzero(through))
    z[mirrored] += rng.normal(0.0, 0.1, np.count_nonzero(mirrored))
    returned = ~glass | through | mirrored
    strewn = rng.uniform([[0.0]] * 2 + [[-0.5]], [[EDGE]] * 2 + [[0.5]], (3, strays))
    p_TQs = np.concatenate([np.stack([x, y, z])[:, returned], strewn], axis=1)
    X_CT = RigidTransform(
        RotationMatrix(np.diag([1.0, -1.0, -1.0])),
        np.array([-EDGE / 2, EDGE / 2, STAND_OFF]),
    )
    p_TQs = rng.permutation(p_TQs, axis=1)[:, :points]
    p_CQs = (X_CT @ p_TQs).astype(np.float32)
    centres = (np.arange(round(EDGE / cell)) + 0.5) * cell
    _, things, _ = surface(*np.meshgrid(centres, centres))
    return FurnishedWall(p_CQs.astype(np.float64), things, X_CT, cell)


def _surface(
    x: FloatArray, y: FloatArray, *, shifts: FloatArray, lean: float
) -> tuple[FloatArray, IntArray, BoolArray]:
    """Returns depth (m along T z), `Thing` and whether it is glass, by place.

    Args:
        x: Places of the tile, m.
        y: The same.
        shifts: (6, 2) of the things, m.
        lean: The stick's slope.
    """
    z = np.zeros(x.shape)
    things = np.full(x.shape, int(Thing.WALL))
    glass = np.zeros(x.shape, dtype=np.bool_)

    def put(thing: Thing, where: BoolArray, depth: FloatArray | float) -> None:
        z[where] = np.broadcast_to(depth, x.shape)[where]
        things[where] = thing

    # Window 0.6 x 0.7 m with a 6 cm frame, door, two boxes; all in metres.
    put(Thing.WINDOW, _box(x, y, (0.50, 1.35, 0.60, 0.70), shifts[0]), -0.12)
    glass |= _box(x, y, (0.50, 1.35, 0.48, 0.58), shifts[0])
    put(Thing.DOOR, _box(x, y, (1.55, 0.74, 0.60, 1.40), shifts[1]), -0.07)
    put(Thing.BOX, _box(x, y, (0.25, 0.55, 0.20, 0.20), shifts[2]), 0.10)
    put(Thing.BOX, _box(x, y, (0.65, 0.70, 0.15, 0.12), shifts[3]), 0.06)
    # A bottle that touches the wall: body 8 cm, neck 3 cm across, 27 cm tall.
    middle, bottom = 0.70 + shifts[4, 0], 0.25 + shifts[4, 1]
    for low, high, radius in ((0.0, 0.19, 0.04), (0.19, 0.27, 0.015)):
        off = x - middle
        round_ = (np.abs(off) < radius) & (y >= bottom + low) & (y < bottom + high)
        bulge = np.sqrt(np.maximum(0.0, radius**2 - off**2))
        put(Thing.BOTTLE, round_, 0.04 + bulge)
    # A round stick, 3 cm across and 1.2 m long, leaning, its axis 2.5 cm off.
    off = x - (1.05 + shifts[5, 0] + lean * (y - 0.9))
    off /= math.hypot(1.0, lean)
    stick = (np.abs(off) < 0.015) & (np.abs(y - 0.9) < 0.6)
    bulge = np.sqrt(np.maximum(0.0, 0.015**2 - off**2))
    put(Thing.STICK, stick, 0.025 + bulge)
    return z, things, glass


def _box(
    x: FloatArray, y: FloatArray, box: tuple[float, ...], shift: FloatArray
) -> BoolArray:
    """Returns which places are in a rectangle: middle x and y, width and height."""
    middle_x, middle_y, width, height = box
    across: BoolArray = np.abs(x - middle_x - shift[0]) <= width / 2
    across &= np.abs(y - middle_y - shift[1]) <= height / 2
    return across
