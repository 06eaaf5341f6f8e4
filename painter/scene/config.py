"""Scene descriptions: what stands in front of the simulated robot.

Scene frame S has the axes of the tile frame (x right, y up, z out of the wall towards
the robot); its origin is the nominal tile's lower-left corner on the wall's surface.
Plain mutable dataclasses, because Drake's `yaml_load_typed` fills them field by field.
"""

import dataclasses
import math

OPENING_KINDS = ("window", "door")
TEXTURES = ("none", "plaster", "brick")
# Numbers that describe the size of an object of each shape.
OBJECT_SIZES = {
    "box": ("length", "width", "height"),
    "cylinder": ("diameter", "length"),
    "sphere": ("diameter",),
}


@dataclasses.dataclass(kw_only=True)
class WallConfig:
    """The wall: a plate with its front at z = 0; its lower edge stands on the floor.

    Attributes:
        x: Left edge in S, m.
        y: Lower edge in S, m.
        width: Width, m.
        height: Height, m.
        thickness: Thickness, m.
        color: Red, green and blue, 0 to 1.
        texture: "none", "plaster" or "brick"; a picture on the flat front.
    """

    x: float = -0.6
    y: float = -0.2
    width: float = 3.2
    height: float = 2.6
    thickness: float = 0.30
    color: list[float] = dataclasses.field(default_factory=lambda: [0.86, 0.84, 0.79])
    texture: str = "none"

    def validate(self, where: str) -> None:
        """Raises ValueError for a value out of bounds, named after `where`."""
        _check_range(where, "m", -10.0, 10.0, x=self.x, y=self.y)
        _check_range(where, "m", 0.2, 20.0, width=self.width, height=self.height)
        _check_range(where, "m", 0.02, 1.0, thickness=self.thickness)
        _check_color(where, self.color)
        _check_word(where, TEXTURES, texture=self.texture)


@dataclasses.dataclass(kw_only=True)
class OpeningConfig:
    """A rectangular hole in the wall, closed by a frame with glass or a solid panel.

    Attributes:
        kind: "window" or "door".
        x: Left edge of the hole in S, m.
        y: Lower edge of the hole in S, m; a door's may be the wall's lower edge.
        width: Width of the hole, m.
        height: Height of the hole, m.
        recess: From the wall's front back to the frame's front, m.
        frame_width: Visible width of the frame's bars, m.
        frame_depth: Depth of the frame along z, m.
        frame_color: Red, green and blue, 0 to 1.
        panel_share: Lower share of the frame's clear height closed by a solid panel;
            the rest is glass, with a rail between the two. 0 = all glass, 1 = solid.
        panel_color: Red, green and blue, 0 to 1.
        vertical_bars: Glazing bars that divide the glass from left to right.
        horizontal_bars: Glazing bars that divide it from bottom to top.
        bar_width: Visible width of a glazing bar, m.
    """

    kind: str = "window"
    x: float = 0.6
    y: float = 0.7
    width: float = 0.8
    height: float = 0.9
    recess: float = 0.10
    frame_width: float = 0.06
    frame_depth: float = 0.06
    frame_color: list[float] = dataclasses.field(
        default_factory=lambda: [0.95, 0.95, 0.94]
    )
    panel_share: float = 0.0
    panel_color: list[float] = dataclasses.field(
        default_factory=lambda: [0.55, 0.38, 0.24]
    )
    vertical_bars: int = 0
    horizontal_bars: int = 0
    bar_width: float = 0.03

    def validate(self, where: str) -> None:
        """Raises ValueError for a value out of bounds, named after `where`."""
        _check_word(where, OPENING_KINDS, kind=self.kind)
        _check_range(where, "m", -10.0, 10.0, x=self.x, y=self.y)
        _check_range(where, "m", 0.1, 10.0, width=self.width, height=self.height)
        _check_range(where, "m", 0.0, 0.5, recess=self.recess)
        widths = {"frame_width": self.frame_width, "bar_width": self.bar_width}
        _check_range(where, "m", 0.005, 0.3, **widths)
        _check_range(where, "m", 0.01, 0.3, frame_depth=self.frame_depth)
        _check_range(where, "", 0.0, 1.0, panel_share=self.panel_share)
        bars = {
            "vertical_bars": self.vertical_bars,
            "horizontal_bars": self.horizontal_bars,
        }
        _check_range(where, "", 0, 10, **bars)
        for color in (self.frame_color, self.panel_color):
            _check_color(where, color)
        # At least half of the hole is to be clear of frame, rail and bars.
        for size, count in (("width", "vertical_bars"), ("height", "horizontal_bars")):
            solid = 2 * self.frame_width + bars[count] * self.bar_width
            if size == "height" and 0.0 < self.panel_share < 1.0:
                solid += self.frame_width
            if solid > 0.5 * getattr(self, size):
                raise ValueError(
                    f"{where}.{size} must be at least twice its frame and bars, "
                    f"{2 * solid:.3f} m, got {getattr(self, size)!r}."
                )


@dataclasses.dataclass(kw_only=True)
class ObjectConfig:
    """A solid body on the wall, not to be painted.

    Attributes:
        name: Name in pictures and geometry; empty = its shape and number.
        shape: "box", "cylinder" or "sphere".
        size: Box: edges along its own x, y and z, m; cylinder: diameter and length
            along its own z, m; sphere: diameter, m.
        position: Its centre in S, m.
        rpy_deg: Roll, pitch and yaw of its axes in S.
        color: Red, green and blue, 0 to 1.
    """

    name: str = ""
    shape: str = "box"
    size: list[float] = dataclasses.field(default_factory=lambda: [0.1, 0.1, 0.1])
    position: list[float] = dataclasses.field(default_factory=lambda: [1.0, 1.0, 0.05])
    rpy_deg: list[float] = dataclasses.field(default_factory=lambda: [0.0, 0.0, 0.0])
    color: list[float] = dataclasses.field(default_factory=lambda: [0.80, 0.15, 0.12])

    def validate(self, where: str) -> None:
        """Raises ValueError for a value out of bounds, named after `where`."""
        _check_word(where, tuple(OBJECT_SIZES), shape=self.shape)
        parts = OBJECT_SIZES[self.shape]
        _check_list(where, "m", 0.005, 5.0, len(parts), size=self.size)
        _check_list(where, "m", -10.0, 10.0, 3, position=self.position)
        _check_list(where, "deg", -360.0, 360.0, 3, rpy_deg=self.rpy_deg)
        _check_color(where, self.color)


@dataclasses.dataclass(kw_only=True)
class RoomConfig:
    """What is behind glass: a back wall parallel to the wall.

    Attributes:
        depth: From the wall's back to the back wall, m.
        color: Red, green and blue, 0 to 1.
    """

    depth: float = 2.0
    color: list[float] = dataclasses.field(default_factory=lambda: [0.60, 0.62, 0.66])

    def validate(self, where: str) -> None:
        """Raises ValueError for a value out of bounds, named after `where`."""
        _check_range(where, "m", 0.1, 10.0, depth=self.depth)
        _check_color(where, self.color)


@dataclasses.dataclass(kw_only=True)
class BaseErrorConfig:
    """Error of the base placement, as a motion of the real wall in W.

    The robot believes that its base stands exactly where the job put it. It does not,
    so the wall, expected at X_WT, is found moved: by a rotation about W's origin (the
    foot of the base axis), then a translation, both along the axes of W (x towards the
    wall, y to the robot's left, z up).

    Attributes:
        x: Wall farther away than expected, m.
        y: Wall farther to the left, m.
        z: Wall higher, m.
        roll_deg: Rotation about W's x.
        pitch_deg: Rotation about W's y.
        yaw_deg: Rotation about W's z.
    """

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    roll_deg: float = 0.0
    pitch_deg: float = 0.0
    yaw_deg: float = 0.0

    def validate(self, where: str) -> None:
        """Raises ValueError for a value out of bounds, named after `where`."""
        _check_range(where, "m", -0.1, 0.1, x=self.x, y=self.y, z=self.z)
        angles = {
            "roll_deg": self.roll_deg,
            "pitch_deg": self.pitch_deg,
            "yaw_deg": self.yaw_deg,
        }
        _check_range(where, "deg", -5.0, 5.0, **angles)


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

    def validate(self) -> None:
        """Raises ValueError for the first value out of bounds."""
        self.wall.validate("wall")
        self.room.validate("room")
        self.base_error.validate("base_error")
        for i, opening in enumerate(self.openings):
            where = f"openings[{i}]"
            opening.validate(where)
            self._check_place(opening, where)
            for j, other in enumerate(self.openings[:i]):
                if _overlap(opening, other):
                    raise ValueError(f"{where} must not overlap openings[{j}].")
        for i, body in enumerate(self.objects):
            where = f"objects[{i}]"
            body.validate(where)
            x, y, z = body.position
            wall = self.wall
            _check_range(f"{where}.position", "m", wall.x, wall.x + wall.width, x=x)
            _check_range(f"{where}.position", "m", wall.y, wall.y + wall.height, y=y)
            _check_range(f"{where}.position", "m", -wall.thickness, 0.5, z=z)

    def opening_boxes(self) -> list[list[list[float]]]:
        """Returns corners [x, y] of each opening, m from the wall's lower left one."""
        boxes = []
        for opening in self.openings:
            x, y = opening.x - self.wall.x, opening.y - self.wall.y
            boxes.append([[x, y], [x + opening.width, y + opening.height]])
        return boxes

    def _check_place(self, opening: OpeningConfig, where: str) -> None:
        wall = self.wall
        depth = opening.recess + opening.frame_depth
        if depth > wall.thickness:
            raise ValueError(
                f"{where}: recess + frame_depth must be at most wall.thickness, "
                f"{wall.thickness} m, got {depth:.3f}."
            )
        sides = (
            ("x", opening.x, opening.width, wall.x, wall.width),
            ("y", opening.y, opening.height, wall.y, wall.height),
        )
        for axis, low, size, wall_low, wall_size in sides:
            spare = low - wall_low, wall_low + wall_size - low - size
            if min(spare) < -1e-9:
                raise ValueError(
                    f"{where}: {axis} must lie in the wall's {wall_low} to "
                    f"{wall_low + wall_size:.3f} m, got {low} to {low + size:.3f}."
                )


def _overlap(a: OpeningConfig, b: OpeningConfig) -> bool:
    apart_x = a.x + a.width <= b.x or b.x + b.width <= a.x
    apart_y = a.y + a.height <= b.y or b.y + b.height <= a.y
    return not (apart_x or apart_y)


def _check_range(
    where: str, unit: str, low: float, high: float, **values: float
) -> None:
    for name, value in values.items():
        if not (math.isfinite(value) and low <= value <= high):
            bounds = f"{low:g} to {high:g} {unit}".rstrip()
            raise ValueError(f"{where}.{name} must be {bounds}, got {value!r}.")


def _check_list(
    where: str, unit: str, low: float, high: float, count: int, **lists: list[float]
) -> None:
    for name, values in lists.items():
        if len(values) != count:
            raise ValueError(f"{where}.{name} must be {count} numbers, got {values!r}.")
        for i, value in enumerate(values):
            _check_range(where, unit, low, high, **{f"{name}[{i}]": value})


def _check_color(where: str, color: list[float]) -> None:
    _check_list(where, "", 0.0, 1.0, 3, color=color)


def _check_word(where: str, words: tuple[str, ...], **values: str) -> None:
    for name, value in values.items():
        if value not in words:
            allowed = ", ".join(words)
            raise ValueError(f"{where}.{name} must be one of {allowed}, got {value!r}.")
