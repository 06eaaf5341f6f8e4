"""Random scenes: walls as a painter meets them, drawn from a seed."""

import math

import numpy as np

from painter.scene.config import (
    BaseErrorConfig,
    ObjectConfig,
    OpeningConfig,
    Scene,
    WallConfig,
)
from perception.settings import validate

# Least gap between two things on the wall, and between one and the tile's edge, m.
_GAP = 0.06
# Edge of the tile, m.
_TILE = 2.0
# Heights of objects over the wall, m: more than the paper's 4 cm resolution, and low
# enough that the gun at 0.30 m passes over them.
_HEIGHTS = (0.05, 0.15)
# Tries to find a free place for a thing before it is left out.
_TRIES = 100

_COLORS = (
    (0.80, 0.15, 0.12),
    (0.12, 0.28, 0.70),
    (0.93, 0.93, 0.92),
    (0.20, 0.50, 0.25),
    (0.25, 0.25, 0.27),
    (0.85, 0.65, 0.15),
)
_WALL_COLORS = (
    (0.86, 0.84, 0.79),
    (0.80, 0.76, 0.66),
    (0.72, 0.76, 0.78),
    (0.88, 0.80, 0.72),
)

# A rectangle in S: x0, x1, y0, y1, m.
_Box = tuple[float, float, float, float]


def draw_random_scene(seed: int) -> Scene:
    """Draws a scene: 0-2 openings, 0-6 objects, base errors up to 2 cm and 1 degree.

    Openings and objects do not overlap. Every draw comes from `seed` alone.

    Args:
        seed: Seed of the draw.

    Returns:
        The scene, checked.
    """
    rng = np.random.default_rng(seed)
    texture = str(rng.choice(["none", "plaster", "brick"]))
    color = (
        [0.62, 0.30, 0.22]
        if texture == "brick"
        else list(_WALL_COLORS[rng.integers(len(_WALL_COLORS))])
    )
    taken: list[_Box] = []
    openings = _draw_openings(rng, int(rng.integers(0, 3)), taken)
    objects = _draw_objects(rng, int(rng.integers(0, 7)), taken)
    x, y, z = rng.uniform(-0.02, 0.02, 3).round(4).tolist()
    roll, pitch, yaw = rng.uniform(-1.0, 1.0, 3).round(3).tolist()
    scene = Scene(
        name=f"random_{seed}",
        description=f"Drawn from seed {seed}.",
        wall=WallConfig(texture=texture, color=color),
        openings=openings,
        objects=objects,
        base_error=BaseErrorConfig(
            x=x, y=y, z=z, roll_deg=roll, pitch_deg=pitch, yaw_deg=yaw
        ),
    )
    validate(scene)
    return scene


def _draw_openings(
    rng: np.random.Generator, count: int, taken: list[_Box]
) -> list[OpeningConfig]:
    openings: list[OpeningConfig] = []
    for _ in range(count):
        has_door = any(opening.kind == "door" for opening in openings)
        kind = "window" if has_door or rng.random() < 0.6 else "door"
        if kind == "door":
            width, height = rng.uniform(0.80, 0.95), rng.uniform(1.9, 2.05)
            panel_share = float(rng.choice([0.4, 1.0]))
            y_range = (-0.2, -0.2)
        else:
            width, height = rng.uniform(0.5, 0.9), rng.uniform(0.5, 1.1)
            panel_share = 0.0
            y_range = (0.5, 1.85 - height)
        width, height = round(width, 3), round(height, 3)
        place = _find_place(rng, width, height, (-0.3, 2.3 - width), y_range, taken)
        if place is None:
            continue
        openings.append(
            OpeningConfig(
                kind=kind,
                x=place[0],
                y=place[1],
                width=width,
                height=height,
                recess=round(rng.uniform(0.08, 0.15), 3),
                frame_width=round(rng.uniform(0.05, 0.08), 3),
                panel_share=panel_share,
                vertical_bars=int(rng.integers(0, 2)) if kind == "window" else 0,
            )
        )
    return openings


def _draw_objects(
    rng: np.random.Generator, count: int, taken: list[_Box]
) -> list[ObjectConfig]:
    objects = []
    for _ in range(count):
        shape = str(rng.choice(["box", "cylinder", "sphere"]))
        color = list(_COLORS[rng.integers(len(_COLORS))])
        top = rng.uniform(*_HEIGHTS)
        turn = rng.uniform(-90.0, 90.0)
        if shape == "box":
            length, width = rng.uniform(0.05, 0.30, 2)
            size, rpy = [length, width, top], [0.0, 0.0, turn]
            extent = _turned_extent(length, width, turn)
        elif shape == "cylinder":
            # Lies against the wall: own z turned to x, then about the wall's normal.
            length = rng.uniform(0.10, 0.50)
            size, rpy = [top, length], [0.0, 90.0, turn]
            extent = _turned_extent(length, top, turn)
        else:
            size, rpy = [top], [0.0, 0.0, 0.0]
            extent = (top, top)
        ranges = [(_GAP, _TILE - _GAP - edge) for edge in extent]
        place = _find_place(rng, *extent, ranges[0], ranges[1], taken)
        if place is None:
            continue
        center = [place[0] + 0.5 * extent[0], place[1] + 0.5 * extent[1], 0.5 * top]
        objects.append(
            ObjectConfig(
                shape=shape,
                size=[round(edge, 4) for edge in size],
                position=[round(value, 4) for value in center],
                rpy_deg=[round(angle, 2) for angle in rpy],
                color=color,
            )
        )
    return objects


def _turned_extent(length: float, width: float, turn_deg: float) -> tuple[float, float]:
    """Returns the upright extent of a rectangle turned in its plane, m."""
    c = abs(math.cos(math.radians(turn_deg)))
    s = abs(math.sin(math.radians(turn_deg)))
    return c * length + s * width, s * length + c * width


def _find_place(
    rng: np.random.Generator,
    width: float,
    height: float,
    x_range: tuple[float, float],
    y_range: tuple[float, float],
    taken: list[_Box],
) -> tuple[float, float] | None:
    """Draws a lower-left corner clear of all in `taken`, and adds it there; m in S."""
    for _ in range(_TRIES):
        x, y = round(rng.uniform(*x_range), 3), round(rng.uniform(*y_range), 3)
        box = (x, x + width, y, y + height)
        if all(_clear(box, other) for other in taken):
            taken.append(box)
            return x, y
    return None


def _clear(a: _Box, b: _Box) -> bool:
    return (
        a[1] + _GAP <= b[0]
        or b[1] + _GAP <= a[0]
        or a[3] + _GAP <= b[2]
        or b[3] + _GAP <= a[2]
    )
