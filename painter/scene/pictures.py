"""Pictures of scenes: the front view, and the truth of what is to be painted."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from painter.scene.config import Scene
from painter.scene.solids import SurfaceKind
from painter.scene.surface import cast_rays, is_paintable, surface_at, visible_solids
from painter.scene.texture import wall_picture
from perception.ground import FloatArray

# Colours of the truth picture: white is to be painted, everything else is keep-out.
KIND_COLORS = {
    SurfaceKind.NONE: "#2b2b2b",
    SurfaceKind.WALL: "#ffffff",
    SurfaceKind.FRAME: "#8d6e63",
    SurfaceKind.GLASS: "#64b5f6",
    SurfaceKind.PANEL: "#ffb74d",
    SurfaceKind.OBJECT: "#e53935",
}
# Pictures are drawn on a grid of this cell, m.
_CELL = 0.005
# Direction to the light in S, and the share of ambient light.
_LIGHT = np.array([-0.45, 0.55, 0.70])
_AMBIENT = 0.45
# Steeper rises from cell to cell are drawn as steps.
_STEEPEST = 2.5
# Shadows fall from steps this high at most, m.
_SHADOW_REACH = 0.2


def draw_scene(scene: Scene, *, width: float = 2.0, height: float = 2.0) -> Figure:
    """Draws the front view and the truth of a scene side by side.

    Args:
        scene: The scene.
        width: The tile's width, m; drawn as a dashed outline.
        height: The tile's height, m.

    Returns:
        The figure; its axes are x and y of S, m.
    """
    figure = Figure(figsize=(11.0, 4.9), layout="constrained")
    view, truth = figure.subplots(1, 2, sharey=True)
    _draw_view(view, scene)
    _draw_truth(truth, scene)
    tile = int(np.ceil(width / _CELL)), int(np.ceil(height / _CELL))
    x, y = [(np.arange(n) + 0.5) * _CELL for n in tile]
    _, kind = surface_at(scene, *np.meshgrid(x, y))
    share = np.count_nonzero(is_paintable(kind)) / kind.size
    view.set_title(f"{scene.name}: seen from the robot")
    truth.set_title(f"truth: {100 * share:.0f} % of the tile is wall to paint")
    for axes in (view, truth):
        _draw_tile(axes, width, height)
        axes.set_xlabel("x / m")
    view.set_ylabel("y / m")
    present = [kind for kind in SurfaceKind if kind in _kinds(scene)]
    handles = [
        Rectangle((0, 0), 1, 1, facecolor=KIND_COLORS[kind], edgecolor="#666666")
        for kind in present
    ]
    names = [kind.name.lower() for kind in present]
    truth.legend(handles, names, loc="center left", bbox_to_anchor=(1.01, 0.5))
    return figure


def draw_contact_sheet(scenes: Sequence[Scene]) -> Figure:
    """Draws several scenes: front views above, truths below.

    Args:
        scenes: The scenes, at least one.

    Returns:
        The figure.
    """
    figure = Figure(figsize=(2.6 * len(scenes), 4.7), layout="constrained")
    rows = figure.subplots(2, len(scenes), squeeze=False)
    for (view, truth), scene in zip(rows.T, scenes, strict=True):
        _draw_view(view, scene)
        _draw_truth(truth, scene)
        view.set_title(scene.name)
        for axes in (view, truth):
            _draw_tile(axes, 2.0, 2.0)
            axes.set_xticks([])
            axes.set_yticks([])
    return figure


def _draw_view(axes: Axes, scene: Scene) -> None:
    x, y = _grid(scene)
    axes.imshow(
        _front_view(scene, x, y), origin="lower", extent=_extent(scene), zorder=0
    )


def _draw_truth(axes: Axes, scene: Scene) -> None:
    colors = [
        tuple(bytes.fromhex(KIND_COLORS[kind].removeprefix("#")))
        for kind in SurfaceKind
    ]
    picture = np.array(colors, dtype=np.uint8)[_kinds(scene)]
    axes.imshow(picture, origin="lower", extent=_extent(scene), zorder=0)


def _draw_tile(axes: Axes, width: float, height: float) -> None:
    outline = Rectangle(
        (0.0, 0.0), width, height, fill=False, linestyle="--", edgecolor="#333333"
    )
    axes.add_patch(outline)


def _kinds(scene: Scene) -> "np.typing.NDArray[np.uint8]":
    return surface_at(scene, *_grid(scene))[1]


def _front_view(scene: Scene, x: FloatArray, y: FloatArray) -> FloatArray:
    """Returns the lit scene as (ny, nx, 3) float64, 0 to 1, row 0 at the bottom."""
    solids = visible_solids(scene)
    height, index = cast_rays(solids, x, y)
    picture = np.array([solid.rgba[:3] for solid in solids])[index]
    wall = np.array([solid.kind == SurfaceKind.WALL for solid in solids])[index]
    front = wall_picture(scene.wall)
    row = (y[wall] - scene.wall.y) / scene.wall.height * front.shape[0]
    column = (x[wall] - scene.wall.x) / scene.wall.width * front.shape[1]
    picture[wall] = front[row.astype(int), column.astype(int)]
    light = _AMBIENT + (1.0 - _AMBIENT) * _lit(height)
    lit: FloatArray = np.clip(picture * light[..., None], 0.0, 1.0)
    return lit


def _lit(height: FloatArray) -> FloatArray:
    """Returns the share of direct light on a surface, relative to the flat wall's."""
    slope = np.array([np.gradient(height, _CELL, axis=axis) for axis in (1, 0)])
    # A step between bodies is an edge, not a slope.
    slope[np.abs(slope) > _STEEPEST] = 0.0
    normal = np.stack([*-slope, np.ones_like(height)])
    normal /= np.linalg.norm(normal, axis=0)
    lit: FloatArray = np.maximum(np.tensordot(_LIGHT, normal, 1), 0.0) / _LIGHT[2]
    # Walk towards the light; what rises above the ray takes the light away.
    shadow = np.zeros(height.shape, dtype=bool)
    run = _LIGHT[:2] / _LIGHT[2]
    per_step = _CELL / np.abs(run).max()
    for step in range(1, int(_SHADOW_REACH / per_step)):
        dx, dy = np.round(step * per_step * run / _CELL).astype(int)
        seen = np.roll(height, (-dy, -dx), axis=(0, 1))
        shadow |= seen > height + step * per_step + 1e-6
    lit[shadow] = 0.0
    return lit


def _grid(scene: Scene) -> tuple[FloatArray, FloatArray]:
    """Returns x and y of the picture's cells over the whole wall, m in S."""
    wall = scene.wall
    nx, ny = int(wall.width / _CELL), int(wall.height / _CELL)
    x = wall.x + wall.width * (np.arange(nx) + 0.5) / nx
    y = wall.y + wall.height * (np.arange(ny) + 0.5) / ny
    grid_x, grid_y = np.meshgrid(x, y)
    return grid_x, grid_y


def _extent(scene: Scene) -> tuple[float, float, float, float]:
    wall = scene.wall
    return wall.x, wall.x + wall.width, wall.y, wall.y + wall.height
