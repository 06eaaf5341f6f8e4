"""The bodies a scene is made of; geometry, truth and pictures all come from them."""

import dataclasses
import enum
import itertools
from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw

from painter.scene.config import ObjectConfig, OpeningConfig, Scene, WallConfig

# Thickness of a double-glazed pane and of a door's panel, m. Both stand in the middle
# of the frame's depth. Source: 4-16-4 mm sealed units, EN 1279-1; a common door leaf.
GLASS_THICKNESS = 0.024
PANEL_THICKNESS = 0.024
# The back wall of the room is a plate of this thickness, m; only its front is seen.
_ROOM_WALL_THICKNESS = 0.05
# Thinner pieces of wall are rounding, m.
_LEAST_PIECE = 1e-9
# Glass is drawn with this opacity.
_GLASS_RGBA = (0.60, 0.78, 0.88, 0.35)


class SurfaceKind(enum.IntEnum):
    """What a surface is; only WALL is to be painted."""

    NONE = 0
    WALL = 1
    FRAME = 2
    GLASS = 3
    PANEL = 4
    OBJECT = 5


@dataclass(frozen=True)
class Solid:
    """A convex body fixed in S.

    Attributes:
        name: Unique in its scene.
        kind: What it is; NONE is the room behind the glass, which counts as no surface.
        shape: "box", "cylinder" or "sphere", centred on its own frame P.
        size: Box: edges, m; cylinder: diameter and length along P's z, m; sphere:
            diameter, m.
        X_SP: Pose of P in S.
        rgba: Colour and opacity, 0 to 1.
    """

    name: str
    kind: SurfaceKind
    shape: str
    size: tuple[float, ...]
    X_SP: RigidTransform
    rgba: tuple[float, ...]


def scene_solids(scene: Scene) -> list[Solid]:
    """Returns the bodies of a scene: wall pieces, openings, objects, then the room."""
    solids = _wall_pieces(scene.wall, scene.openings)
    for number, opening in enumerate(scene.openings, start=1):
        solids += _opening_solids(opening, f"{opening.kind}_{number}")
    for number, body in enumerate(scene.objects, start=1):
        solids.append(_object_solid(body, number))
    if any(solid.kind == SurfaceKind.GLASS for solid in solids):
        solids.append(_room_wall(scene))
    return solids


def _wall_pieces(wall: WallConfig, openings: list[OpeningConfig]) -> list[Solid]:
    """Fills the wall around its openings: strips cut at the openings' sides."""
    right, top = wall.x + wall.width, wall.y + wall.height
    sides = {wall.x, right}
    for hole in openings:
        sides |= {hole.x, hole.x + hole.width}
    cuts = sorted(sides)
    spans = []
    for x0, x1 in itertools.pairwise(cuts):
        middle = 0.5 * (x0 + x1)
        y0 = wall.y
        holes = [hole for hole in openings if hole.x < middle < hole.x + hole.width]
        for hole in sorted(holes, key=lambda hole: hole.y):
            spans.append((x0, x1, y0, hole.y))
            y0 = hole.y + hole.height
        spans.append((x0, x1, y0, top))
    # Sides that meet but for rounding leave no piece between them.
    spans = [s for s in spans if min(s[1] - s[0], s[3] - s[2]) > _LEAST_PIECE]
    return [
        _plate(f"wall_{i}", SurfaceKind.WALL, span, 0.0, wall.thickness, wall.color)
        for i, span in enumerate(spans, start=1)
    ]


def _opening_solids(opening: OpeningConfig, name: str) -> list[Solid]:
    """Makes frame, rail, glazing bars, panel and glass of one opening."""
    width = opening.frame_width
    left, right = opening.x, opening.x + opening.width
    bottom, top = opening.y, opening.y + opening.height
    inner_left, inner_right = left + width, right - width
    inner_bottom, inner_top = bottom + width, top - width
    bars = {
        "left": (left, inner_left, bottom, top),
        "right": (inner_right, right, bottom, top),
        "bottom": (inner_left, inner_right, bottom, inner_bottom),
        "top": (inner_left, inner_right, inner_top, top),
    }
    # Panel and glass part at `sill`; the rail, if both are there, covers the joint.
    sill = inner_bottom + opening.panel_share * (inner_top - inner_bottom)
    if 0.0 < opening.panel_share < 1.0:
        rail = (sill - 0.5 * width, sill + 0.5 * width)
        bars["rail"] = (inner_left, inner_right, *rail)
    if opening.panel_share < 1.0:
        half = 0.5 * opening.bar_width
        xs = np.linspace(inner_left, inner_right, opening.vertical_bars + 2)[1:-1]
        ys = np.linspace(sill, inner_top, opening.horizontal_bars + 2)[1:-1]
        for i, x in enumerate(xs.tolist(), start=1):
            bars[f"vertical_{i}"] = (x - half, x + half, sill, inner_top)
        for i, y in enumerate(ys.tolist(), start=1):
            bars[f"horizontal_{i}"] = (inner_left, inner_right, y - half, y + half)

    front, depth = -opening.recess, opening.frame_depth
    solids = [
        _plate(
            f"{name}_frame_{part}",
            SurfaceKind.FRAME,
            span,
            front,
            depth,
            opening.frame_color,
        )
        for part, span in bars.items()
    ]
    if opening.panel_share > 0.0:
        thickness = min(PANEL_THICKNESS, 0.5 * depth)
        solids.append(
            _plate(
                f"{name}_panel",
                SurfaceKind.PANEL,
                (inner_left, inner_right, inner_bottom, sill),
                front - 0.5 * (depth - thickness),
                thickness,
                opening.panel_color,
            )
        )
    if opening.panel_share < 1.0:
        thickness = min(GLASS_THICKNESS, 0.5 * depth)
        pane = _plate(
            f"{name}_glass",
            SurfaceKind.GLASS,
            (inner_left, inner_right, sill, inner_top),
            front - 0.5 * (depth - thickness),
            thickness,
            [0.0, 0.0, 0.0],
        )
        solids.append(dataclasses.replace(pane, rgba=_GLASS_RGBA))
    return solids


def _object_solid(body: ObjectConfig, number: int) -> Solid:
    rotation = RollPitchYaw(np.deg2rad(body.rpy_deg))
    label = body.name or body.shape
    return Solid(
        name=f"{label}_{number}",
        kind=SurfaceKind.OBJECT,
        shape=body.shape,
        size=tuple(body.size),
        X_SP=RigidTransform(rotation, body.position),
        rgba=(*body.color, 1.0),
    )


def _room_wall(scene: Scene) -> Solid:
    """Makes the room's back wall, so large that slanting views through glass hit it."""
    wall, depth = scene.wall, scene.room.depth
    grown = 2.0 * depth
    span = (
        wall.x - grown,
        wall.x + wall.width + grown,
        wall.y - grown,
        wall.y + wall.height + grown,
    )
    front = -wall.thickness - depth
    return _plate(
        "room_back_wall",
        SurfaceKind.NONE,
        span,
        front,
        _ROOM_WALL_THICKNESS,
        scene.room.color,
    )


def _plate(
    name: str,
    kind: SurfaceKind,
    span: tuple[float, float, float, float],
    front: float,
    depth: float,
    color: list[float],
) -> Solid:
    """Makes a box over `span` (x0, x1, y0, y1) from z = `front` back by `depth`, m."""
    x0, x1, y0, y1 = span
    center = [0.5 * (x0 + x1), 0.5 * (y0 + y1), front - 0.5 * depth]
    return Solid(
        name=name,
        kind=kind,
        shape="box",
        size=(x1 - x0, y1 - y0, depth),
        X_SP=RigidTransform(center),
        rgba=(*color, 1.0),
    )
