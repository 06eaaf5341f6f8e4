"""The truth: which surface the robot sees where, from the scene's geometry alone.

Rays run along -z of S and meet the nearest face of each body in closed form.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from painter.scene.config import Scene
from painter.scene.solids import Solid, SurfaceKind, scene_solids
from perception.ground import BoolArray, FloatArray, FrozenValue

KindArray = npt.NDArray[np.uint8]

# Boxes that share a face must not leave a gap of rounding between them that a ray could
# slip through, m.
_SEAM = 1e-9


@dataclass(frozen=True, eq=False)
class HeightField(FrozenValue):
    """True visible surface over a grid in S; row 0 is the bottom row, column 0 left.

    Attributes:
        height: (ny, nx) float64, m along S z at cell centres; NaN = nothing there.
        kind: (ny, nx) uint8, values of `SurfaceKind`.
        origin: (2,) float64, m in S: lower-left corner of the grid.
        cell: Edge of a cell, m.
    """

    height: FloatArray
    kind: KindArray
    origin: FloatArray
    cell: float

    @property
    def x(self) -> FloatArray:
        """(nx,) m in S: centres of the columns."""
        centers: FloatArray = self.origin[0] + self.cell * (
            np.arange(self.height.shape[1]) + 0.5
        )
        return centers

    @property
    def y(self) -> FloatArray:
        """(ny,) m in S: centres of the rows."""
        centers: FloatArray = self.origin[1] + self.cell * (
            np.arange(self.height.shape[0]) + 0.5
        )
        return centers


def is_paintable(kind: npt.ArrayLike) -> BoolArray:
    """Returns True where a surface of this kind is to be painted: wall alone."""
    paintable: BoolArray = np.asarray(kind) == SurfaceKind.WALL
    return paintable


def height_field(
    scene: Scene,
    *,
    cell: float,
    margin: float = 0.0,
    width: float = 2.0,
    height: float = 2.0,
) -> HeightField:
    """Computes the true visible surface over the nominal tile and a margin around it.

    The tile's left and lower edges are edges of cells.

    Args:
        scene: The scene.
        cell: Edge of a cell, m.
        margin: Kept on each side of the tile, m; rounded up to whole cells.
        width: The tile's width, m; rounded up to whole cells.
        height: The tile's height, m; rounded up to whole cells.

    Returns:
        The surface at the cells' centres.

    Raises:
        ValueError: `cell`, `width` or `height` is not > 0, or `margin` is < 0.
    """
    for name, value in (("cell", cell), ("width", width), ("height", height)):
        if not (np.isfinite(value) and value > 0.0):
            raise ValueError(f"{name} must be > 0 m, got {value!r}.")
    if not (np.isfinite(margin) and margin >= 0.0):
        raise ValueError(f"margin must be >= 0 m, got {margin!r}.")

    def cells(length: float) -> int:
        return int(np.ceil(length / cell - 1e-9))

    border = cells(margin)
    origin = np.full(2, -border * cell)
    x = origin[0] + cell * (np.arange(cells(width) + 2 * border) + 0.5)
    y = origin[1] + cell * (np.arange(cells(height) + 2 * border) + 0.5)
    heights, kinds = surface_at(scene, *np.meshgrid(x, y))
    return HeightField(height=heights, kind=kinds, origin=origin, cell=cell)


def surface_at(
    scene: Scene, x: npt.ArrayLike, y: npt.ArrayLike
) -> tuple[FloatArray, KindArray]:
    """Returns the visible surface at points of S, seen along -z.

    Args:
        scene: The scene.
        x: Array of any shape, m in S.
        y: Array of the same shape, m in S.

    Returns:
        Height along S z, m (NaN = nothing there), and `SurfaceKind`; both that shape.
    """
    solids = visible_solids(scene)
    height, index = cast_rays(solids, x, y)
    kinds = np.array([*(solid.kind for solid in solids), SurfaceKind.NONE], np.uint8)
    return height, kinds[index]


def visible_solids(scene: Scene) -> list[Solid]:
    """Returns the bodies that can be the nearest surface: all but the room."""
    return [s for s in scene_solids(scene) if s.kind != SurfaceKind.NONE]


def cast_rays(
    solids: list[Solid], x: npt.ArrayLike, y: npt.ArrayLike
) -> tuple[FloatArray, npt.NDArray[np.intp]]:
    """Finds the nearest body along -z of S.

    Args:
        solids: Bodies in S.
        x: Array of any shape, m in S.
        y: Array of the same shape, m in S.

    Returns:
        Height along S z, m (NaN = no body), and the body's place in `solids` (-1 = no
        body), both in that shape.
    """
    points = np.stack(np.broadcast_arrays(x, y)).astype(float)
    height = np.full(points.shape[1:], -np.inf)
    index = np.full(points.shape[1:], -1, dtype=np.intp)
    for i, solid in enumerate(solids):
        top = _top(solid, points)
        higher = top > height
        height[higher] = top[higher]
        index[higher] = i
    height[index < 0] = np.nan
    return height, index


def _top(solid: Solid, points: FloatArray) -> FloatArray:
    """Returns the greatest z of a body over points (2, ...) of S; -inf beside it."""
    # A ray is o + t d in the body's frame, with t = z in S.
    X_PS = solid.X_SP.inverse()
    flat = points.reshape(2, -1)
    o = X_PS @ np.vstack([flat, np.zeros(flat.shape[1])])
    d = X_PS.rotation().matrix()[:, 2]
    # The body is an intersection of convex parts: so is a ray's share of it.
    if solid.shape == "box":
        half = 0.5 * np.array(solid.size)
        shares = [_slab(o[i], d[i], half[i]) for i in range(3)]
    elif solid.shape == "cylinder":
        diameter, length = solid.size
        shares = [_ball(o[:2], d[:2], 0.5 * diameter), _slab(o[2], d[2], 0.5 * length)]
    else:
        shares = [_ball(o, d, 0.5 * solid.size[0])]
    entry = np.max([share[0] for share in shares], axis=0)
    exit_ = np.min([share[1] for share in shares], axis=0)
    top: FloatArray = np.where(entry <= exit_, exit_, -np.inf)
    return top.reshape(points.shape[1:])


def _slab(o: FloatArray, d: float, half: float) -> tuple[FloatArray, FloatArray]:
    """Returns the t for which |o + t d| <= half, one coordinate."""
    if abs(d) < 1e-12:
        inside = np.abs(o) <= half + _SEAM
        return np.where(inside, -np.inf, np.inf), np.where(inside, np.inf, -np.inf)
    ends = (np.array([-half, half])[:, None] - o) / d
    return ends.min(axis=0), ends.max(axis=0)


def _ball(o: FloatArray, d: FloatArray, radius: float) -> tuple[FloatArray, FloatArray]:
    """Returns the t for which |o + t d| <= radius, in two or three coordinates."""
    a = float(d @ d)
    if a < 1e-12:
        return _slab(np.linalg.norm(o, axis=0), 0.0, radius)
    b = d @ o
    discriminant = b**2 - a * ((o**2).sum(axis=0) - radius**2)
    root = np.sqrt(np.maximum(discriminant, 0.0))
    hit = discriminant >= 0.0
    entry = np.where(hit, (-b - root) / a, np.inf)
    exit_ = np.where(hit, (-b + root) / a, -np.inf)
    return entry, exit_
