"""Settings of planning: tile, tip, raster, scan and motion; see `perception.settings`.

Plain mutable dataclasses, filled by `painter.typed_yaml`.
"""

import dataclasses
from collections.abc import Iterator

from perception.settings import Conflict, setting

_TIP_GUIDE = "Graco tip guide: first digit x 5 cm at 30 cm"
_ORIFICE = "orifice equation for a 0.015 inch tip, water at 138 bar"
_ASSUMED = "assumption for flat walls, see models/gun/README.md"


@dataclasses.dataclass(kw_only=True)
class TileConfig:
    """The rectangle of wall painted from one base position, as the job expects it.

    The arm base stands upright on the floor at W's origin, W x towards the wall.

    Attributes:
        width: Width; the tile is centred on the arm's base axis.
        height: Height.
        bottom: Height of its lower edge above the floor, W z = 0.
        distance: Distance of the wall from the arm's base axis.
    """

    width: float = setting(2.0, "m", least=0.1, most=5.0)
    height: float = setting(2.0, "m", least=0.1, most=5.0)
    bottom: float = setting(0.2, "m", least=0.0, most=5.0)
    distance: float = setting(1.05, "m", least=0.3, most=5.0)


@dataclasses.dataclass(kw_only=True)
class TipConfig:
    """Spray tip: an elliptical double-beta fan.

    Attributes:
        fan_width: Length of the fan's long axis at `fan_distance`.
        fan_thickness: Length of its short axis at `fan_distance`.
        fan_distance: Stand-off at which the fan has these sizes.
        gamma: Exponent of a stroke's cross profile (1 - x²/a²)^gamma; beta1 - 1/2.
        beta2: Exponent of the profile along the short axis.
        flow: Volume flow at trigger 1.
        transfer_efficiency: Share of the flow that lands on the wall.
        valve_delay: Time from trigger to flow, opening and closing.
    """

    fan_width: float = setting(0.25, "m", least=0.02, most=1.0, source=_TIP_GUIDE)
    fan_thickness: float = setting(0.05, "m", least=0.005, most=1.0, source=_ASSUMED)
    fan_distance: float = setting(0.30, "m", least=0.05, most=1.0, source=_TIP_GUIDE)
    gamma: float = setting(2.0, "1", above=0.0, most=20.0, source=_ASSUMED)
    beta2: float = setting(2.0, "1", above=0.0, most=20.0, source=_ASSUMED)
    flow: float = setting(1.517e-5, "m³/s", above=0.0, most=1e-3, source=_ORIFICE)
    transfer_efficiency: float = setting(
        0.65, "1", above=0.0, most=1.0, source=_ASSUMED
    )
    valve_delay: float = setting(0.02, "s", least=0.0, below=0.5)


@dataclasses.dataclass(kw_only=True)
class ZoneConfig:
    """A piece of the tile that the operator marks.

    Attributes:
        kind: "exclude" keeps paint off the zone; with "include", nothing outside such
            zones is painted.
        corners: x, y of its corners in T: three or more, or two opposite ones of a
            rectangle.
    """

    kind: str = setting("exclude", choices=("exclude", "include"))
    corners: list[list[float]] = setting([], "m")

    def conflicts(self) -> Iterator[Conflict]:
        """Yields corners that make no zone."""
        if len(self.corners) < 2 or any(len(corner) != 2 for corner in self.corners):
            yield "corners", "two or more pairs x, y", self.corners
        elif any(max(axis) == min(axis) for axis in zip(*self.corners, strict=True)):
            yield "corners: area", "> 0 m²", self.corners

    def beyond(self, width: float, height: float) -> Iterator[Conflict]:
        """Yields coordinates that are not on a tile or wall of this size, m."""
        for x, y in self.corners:
            for axis, value, most in (("x", x, width), ("y", y, height)):
                if not 0.0 <= value <= most:
                    yield f"corners: {axis}", f"0 to {most:g} m", value


@dataclasses.dataclass(kw_only=True)
class RasterConfig:
    """Strokes of a tile.

    Strokes are vertical: the fan's long axis is horizontal, fixed by how the gun is
    bolted on, and an arm of five joints cannot roll it.

    Attributes:
        speed: Gun speed on a stroke.
        standoff: Stand-off of body strokes. From 0.315 m a fan of 25 cm at 0.30 m fills
            2 m in 14 strokes at its best pitch, not 15.
        overlap_pitch: Pitch of the raster; 0 = the pitch of least variance for the tip,
            2 pi a / j(gamma + 1/2, 1), spread to fill the tile's width.
        lead: The gun stays on this far beyond the edge of the paintable wall.
        keepout_margin: Grown around keep-out.
        min_stroke: Shorter strokes are dropped.
        wall_share: Without cut-in, the gun is on where at least this share of the fan's
            flow lands on paintable wall.
        cut_in: Fits the strokes to the film that they leave, with cut-ins beside edges;
            False = the raster alone.
        cut_in_standoff: Smallest stand-off of cut-ins, where the fan is narrower. There
            are none where it is not below `standoff`.
        coats: Coats that the film is applied in, each with the same share of it: few,
            so that the valve can dose them. Two or more need `cut_in`.
        flash_off: Flash-off time between two coats; see the paint's data sheet.
        zones: What the operator includes or excludes.
    """

    speed: float = setting(0.6, "m/s", above=0.0, most=5.0)
    standoff: float = setting(0.315, "m", least=0.05, most=1.0)
    overlap_pitch: float = setting(0.0, "m", least=0.0, below=1.0)
    lead: float = setting(0.005, "m", least=0.0, below=1.0)
    keepout_margin: float = setting(0.0, "m", least=0.0, below=1.0)
    min_stroke: float = setting(0.03, "m", least=0.0, below=1.0)
    wall_share: float = setting(0.5, "1", above=0.0, below=1.0)
    cut_in: bool = setting(True)
    cut_in_standoff: float = setting(0.06, "m", least=0.05, below=1.0)
    coats: int = setting(1, "1", least=1, most=4)
    flash_off: float = setting(60.0, "s", least=0.0, most=86_400.0)
    zones: list[ZoneConfig] = setting([])

    def conflicts(self) -> Iterator[Conflict]:
        """Yields values that do not fit together."""
        if self.coats > 1 and not self.cut_in:
            yield "coats", "1 without cut_in", self.coats


@dataclasses.dataclass(kw_only=True)
class ScanConfig:
    """First look at the wall, the zig-zag scan and the looks after it.

    Attributes:
        look_distance: Camera to expected wall at the first look; from here the arm has
            less far to fold, and to turn from side to side, than from farther off.
        look_time: How long the arm holds still for the first look.
        distance: Camera to wall during the scan; up to a fifth less where the arm
            cannot fold back so far, but within the camera's range.
        speed: Camera speed on the rows.
        overlap: Share of an image's height that neighbouring rows share, and least
            share of its width that neighbouring images of a row do.
        margin: How far beyond the tile's edge the images reach.
        more_looks: Most looks after the scan, into the shadows that it left. Every
            order is tried to find the shortest path.
        more_look_time: How long the arm holds still for each of them: two images,
            without those before and after.
    """

    look_distance: float = setting(0.6, "m", least=0.05, most=5.0)
    look_time: float = setting(0.6, "s", above=0.0, most=60.0)
    distance: float = setting(0.70, "m", least=0.05, most=5.0)
    speed: float = setting(0.25, "m/s", above=0.0, most=2.0)
    overlap: float = setting(0.3, "1", above=0.0, below=0.9)
    margin: float = setting(0.05, "m", above=0.0, most=1.0)
    more_looks: int = setting(4, "1", least=0, most=6)
    more_look_time: float = setting(0.4, "s", above=0.0, most=60.0)


@dataclasses.dataclass(kw_only=True)
class MotionConfig:
    """Arm motion.

    Attributes:
        limit_share: Share of the joints' velocity and acceleration limits that plans
            use, so that tracking has a reserve.
        nozzle_speed: Speed limit of the gun's nozzle; plans use `limit_share` of it.
            Joint limits alone would allow 2.2 m/s in transitions of the named scenes.
        clearance: Least clearance of arm and gun from wall and obstacles.
        floor_clearance: Least clearance from the floor and the arm's own frame. Both
            are known better than what was mapped, and the gun turns close to the floor.
        sample_period: Time between samples of a planned motion.
        wall_keepout: Until the wall has been scanned, the arm stays this far and the
            clearance from it, since what hangs on it is not known yet. On the lower
            rows of a scan the bent elbow leaves no more than 0.10 m.
        home_deg: HOME: joint angles, base yaw first, of the folded pose where every
            program ends and over which detours go; gun ahead, half a metre off the
            wall.
    """

    limit_share: float = setting(0.9, "1", above=0.0, most=1.0)
    nozzle_speed: float = setting(2.5, "m/s", above=0.0, most=5.0)
    clearance: float = setting(0.04, "m", above=0.0, most=0.5)
    floor_clearance: float = setting(0.01, "m", above=0.0, most=0.5)
    sample_period: float = setting(0.01, "s", least=0.001, most=0.1)
    wall_keepout: float = setting(0.10, "m", above=0.0, most=1.0)
    home_deg: list[float] = setting(
        [0.0, -111.0, 155.0, -44.0, 0.0], "deg", least=-180.0, most=180.0, length=5
    )

    def conflicts(self) -> Iterator[Conflict]:
        """Yields values that do not fit together."""
        if self.floor_clearance > self.clearance:
            bound = f"<= clearance, {self.clearance!r} m"
            yield "floor_clearance", bound, self.floor_clearance
