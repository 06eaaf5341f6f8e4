"""Scene descriptions: what stands in front of the simulated robot.

Scene frame S has the axes of the tile frame (x right, y up, z out of the wall towards
the robot); its origin is the nominal tile's lower-left corner on the wall's surface.
Plain mutable dataclasses, filled by `painter.typed_yaml`.
"""

import dataclasses
from collections.abc import Iterator
from typing import Any

from perception.settings import Conflict, setting

# Numbers that describe the size of an object of each shape.
OBJECT_SIZES = {
    "box": ("length", "width", "height"),
    "cylinder": ("diameter", "length"),
    "sphere": ("diameter",),
}


# Red, green and blue.
_COLOUR: dict[str, Any] = {"least": 0.0, "most": 1.0, "length": 3}


@dataclasses.dataclass(kw_only=True)
class WallConfig:
    """The wall: a plate with its front at z = 0; its lower edge stands on the floor.

    Attributes:
        x: Left edge in S.
        y: Lower edge in S.
        width: Width.
        height: Height.
        thickness: Thickness.
        color: Red, green and blue.
        texture: A picture on the flat front.
    """

    x: float = setting(-0.6, "m", least=-10.0, most=10.0)
    y: float = setting(-0.2, "m", least=-10.0, most=10.0)
    width: float = setting(3.2, "m", least=0.2, most=20.0)
    height: float = setting(2.6, "m", least=0.2, most=20.0)
    thickness: float = setting(0.30, "m", least=0.02, most=1.0)
    color: list[float] = setting([0.86, 0.84, 0.79], "1", **_COLOUR)
    texture: str = setting("none", choices=("none", "plaster", "brick"))


@dataclasses.dataclass(kw_only=True)
class OpeningConfig:
    """A rectangular hole in the wall, closed by a frame with glass or a solid panel.

    Attributes:
        kind: What it is.
        x: Left edge of the hole in S.
        y: Lower edge of the hole in S; a door's may be the wall's lower edge.
        width: Width of the hole.
        height: Height of the hole.
        recess: From the wall's front back to the frame's front.
        frame_width: Visible width of the frame's bars.
        frame_depth: Depth of the frame along z.
        frame_color: Red, green and blue.
        panel_share: Lower share of the frame's clear height closed by a solid panel;
            the rest is glass, with a rail between the two. 0 = all glass, 1 = solid.
        panel_color: Red, green and blue.
        vertical_bars: Glazing bars that divide the glass from left to right.
        horizontal_bars: Glazing bars that divide it from bottom to top.
        bar_width: Visible width of a glazing bar.
    """

    kind: str = setting("window", choices=("window", "door"))
    x: float = setting(0.6, "m", least=-10.0, most=10.0)
    y: float = setting(0.7, "m", least=-10.0, most=10.0)
    width: float = setting(0.8, "m", least=0.1, most=10.0)
    height: float = setting(0.9, "m", least=0.1, most=10.0)
    recess: float = setting(0.10, "m", least=0.0, most=0.5)
    frame_width: float = setting(0.06, "m", least=0.005, most=0.3)
    frame_depth: float = setting(0.06, "m", least=0.01, most=0.3)
    frame_color: list[float] = setting([0.95, 0.95, 0.94], "1", **_COLOUR)
    panel_share: float = setting(0.0, "1", least=0.0, most=1.0)
    panel_color: list[float] = setting([0.55, 0.38, 0.24], "1", **_COLOUR)
    vertical_bars: int = setting(0, "1", least=0, most=10)
    horizontal_bars: int = setting(0, "1", least=0, most=10)
    bar_width: float = setting(0.03, "m", least=0.005, most=0.3)

    def conflicts(self) -> Iterator[Conflict]:
        """Yields sizes of which less than half is clear of frame, rail and bars."""
        across = 2 * self.frame_width + self.vertical_bars * self.bar_width
        along = 2 * self.frame_width + self.horizontal_bars * self.bar_width
        if 0.0 < self.panel_share < 1.0:
            along += self.frame_width
        for name, solid in (("width", across), ("height", along)):
            size = getattr(self, name)
            if solid > 0.5 * size:
                yield (
                    name,
                    f"at least twice its frame and bars, {2 * solid:.3f} m",
                    size,
                )


@dataclasses.dataclass(kw_only=True)
class ObjectConfig:
    """A solid body on the wall, not to be painted.

    Attributes:
        name: Name in pictures and geometry; empty = its shape and number.
        shape: What it is.
        size: Box: edges along its own x, y and z; cylinder: diameter and length along
            its own z; sphere: diameter.
        position: Its centre in S.
        rpy_deg: Roll, pitch and yaw of its axes in S.
        color: Red, green and blue.
    """

    name: str = ""
    shape: str = setting("box", choices=tuple(OBJECT_SIZES))
    size: list[float] = setting([0.1, 0.1, 0.1], "m", least=0.005, most=5.0)
    position: list[float] = setting(
        [1.0, 1.0, 0.05], "m", least=-10.0, most=10.0, length=3
    )
    rpy_deg: list[float] = setting(
        [0.0, 0.0, 0.0], "deg", least=-360.0, most=360.0, length=3
    )
    color: list[float] = setting([0.80, 0.15, 0.12], "1", **_COLOUR)

    def conflicts(self) -> Iterator[Conflict]:
        """Yields a size that is not one of the shape."""
        parts = OBJECT_SIZES[self.shape]
        if len(self.size) != len(parts):
            yield "size", f"{len(parts)} numbers: {', '.join(parts)}", self.size


@dataclasses.dataclass(kw_only=True)
class RoomConfig:
    """What is behind glass: a back wall parallel to the wall.

    Attributes:
        depth: From the wall's back to the back wall.
        color: Red, green and blue.
    """

    depth: float = setting(2.0, "m", least=0.1, most=10.0)
    color: list[float] = setting([0.60, 0.62, 0.66], "1", **_COLOUR)


@dataclasses.dataclass(kw_only=True)
class BaseErrorConfig:
    """Error of the base placement, as a motion of the real wall in W.

    The robot plans as if its base stood exactly where the job puts it. It does not, so
    the wall, expected at X_WT, is found moved: by a rotation about W's origin (the foot
    of the base axis), then a translation, both along the axes of W (x towards the wall,
    y to the robot's left, z up).

    Attributes:
        x: Wall farther away than expected.
        y: Wall farther to the left.
        z: Wall higher.
        roll_deg: Rotation about W's x.
        pitch_deg: Rotation about W's y.
        yaw_deg: Rotation about W's z.
    """

    x: float = setting(0.0, "m", least=-0.1, most=0.1)
    y: float = setting(0.0, "m", least=-0.1, most=0.1)
    z: float = setting(0.0, "m", least=-0.1, most=0.1)
    roll_deg: float = setting(0.0, "deg", least=-5.0, most=5.0)
    pitch_deg: float = setting(0.0, "deg", least=-5.0, most=5.0)
    yaw_deg: float = setting(0.0, "deg", least=-5.0, most=5.0)


@dataclasses.dataclass(kw_only=True)
class Scene:
    """Everything in front of the robot.

    Attributes:
        name: The scene's name, the top key of its file.
        description: What it is, in a sentence.
        wall: The wall.
        openings: Windows and doors; they lie in the wall and apart from each other.
        objects: Bodies on the wall.
        room: What is behind glass.
        base_error: How far the wall is from where the job expects it.
    """

    name: str = "scene"
    description: str = ""
    wall: WallConfig = dataclasses.field(default_factory=WallConfig)
    openings: list[OpeningConfig] = dataclasses.field(default_factory=list)
    objects: list[ObjectConfig] = dataclasses.field(default_factory=list)
    room: RoomConfig = dataclasses.field(default_factory=RoomConfig)
    base_error: BaseErrorConfig = dataclasses.field(default_factory=BaseErrorConfig)

    def opening_boxes(self) -> list[list[list[float]]]:
        """Returns corners [x, y] of each opening, m from the wall's lower left one."""
        boxes = []
        for opening in self.openings:
            x, y = opening.x - self.wall.x, opening.y - self.wall.y
            boxes.append([[x, y], [x + opening.width, y + opening.height]])
        return boxes

    def conflicts(self) -> Iterator[Conflict]:
        """Yields openings and objects that do not fit the wall or each other."""
        wall = self.wall
        for i, opening in enumerate(self.openings):
            where = f"openings[{i}]"
            deepest = wall.thickness - opening.frame_depth
            if opening.recess > deepest:
                bound = f"at most wall.thickness less frame_depth, {deepest:.3f} m"
                yield f"{where}.recess", bound, opening.recess
            for axis, size in (("x", "width"), ("y", "height")):
                low, length = getattr(opening, axis), getattr(opening, size)
                first = getattr(wall, axis)
                last = first + getattr(wall, size)
                if low < first - 1e-9 or low + length > last + 1e-9:
                    bound = f"{first:g} to {last - length:.3f} m to lie in the wall"
                    yield f"{where}.{axis}", bound, low
            for j, other in enumerate(self.openings[:i]):
                if _overlap(opening, other):
                    yield f"{where}.x", f"clear of openings[{j}]", opening.x
        spans = (
            (wall.x, wall.x + wall.width),
            (wall.y, wall.y + wall.height),
            (-wall.thickness, 0.5),
        )
        for i, body in enumerate(self.objects):
            for k, (value, (low, high)) in enumerate(
                zip(body.position, spans, strict=True)
            ):
                if not low <= value <= high:
                    bound = f"{low:g} to {high:g} m"
                    yield f"objects[{i}].position[{k}]", bound, value


def _overlap(a: OpeningConfig, b: OpeningConfig) -> bool:
    apart_x = a.x + a.width <= b.x or b.x + b.width <= a.x
    apart_y = a.y + a.height <= b.y or b.y + b.height <= a.y
    return not (apart_x or apart_y)
