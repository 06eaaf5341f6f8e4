"""Settings of planning: tile, tip, raster, scan and motion; SI units.

Plain mutable dataclasses, because Drake's `yaml_load_typed` fills them field by field.
"""

import dataclasses
import math

from perception.ground import check_positive

MOST_COATS = 4


@dataclasses.dataclass(kw_only=True)
class TileConfig:
    """The piece of wall painted from one base placement, as the job expects it.

    The arm base stands upright on the floor at W's origin, W x towards the wall.

    Attributes:
        width: Width, m; the tile is centred on the arm's base axis.
        height: Height, m.
        bottom: Height of its lower edge over the floor (W z = 0), m.
        distance: Distance of the wall from the arm's base axis, m.
    """

    width: float = 2.0
    height: float = 2.0
    bottom: float = 0.2
    distance: float = 1.05

    def validate(self) -> None:
        """Raises ValueError for a value out of bounds."""
        check_positive(
            "tile", width=self.width, height=self.height, distance=self.distance
        )
        if not 0.0 <= self.bottom < math.inf:
            raise ValueError(f"tile.bottom must be >= 0 m, got {self.bottom!r}.")


@dataclasses.dataclass(kw_only=True)
class TipConfig:
    """Spray tip: an elliptical double-beta fan.

    Source: fan width and orifice: Graco tip guide (first digit x 5 cm at 30 cm); flow:
    orifice equation for a 0.015 inch tip; `transfer_efficiency`, `fan_thickness`:
    assumptions for flat walls, see docs of the gun model.

    Attributes:
        fan_width: Length of the fan's long axis at `fan_distance`, m.
        fan_thickness: Length of its short axis at `fan_distance`, m.
        fan_distance: Stand-off at which the fan has these sizes, m.
        gamma: Exponent of a stroke's cross profile (1 - x²/a²)^gamma; beta1 - 1/2.
        beta2: Exponent of the profile along the short axis.
        flow: Volume flow at trigger 1, m³/s.
        transfer_efficiency: Share of the flow that lands on the wall.
        valve_delay: Time from trigger to flow, opening and closing, s.
    """

    fan_width: float = 0.25
    fan_thickness: float = 0.05
    fan_distance: float = 0.30
    gamma: float = 2.0
    beta2: float = 2.0
    flow: float = 1.517e-5
    transfer_efficiency: float = 0.65
    valve_delay: float = 0.02

    def validate(self) -> None:
        """Raises ValueError for a value out of bounds."""
        values = dataclasses.asdict(self)
        delay = values.pop("valve_delay")
        check_positive("gun.tip", **values)
        if self.transfer_efficiency > 1.0:
            raise ValueError(
                "gun.tip.transfer_efficiency must be <= 1, got "
                f"{self.transfer_efficiency!r}."
            )
        if not 0.0 <= delay < 0.5:
            raise ValueError(f"gun.tip.valve_delay must be 0 to 0.5 s, got {delay!r}.")


@dataclasses.dataclass(kw_only=True)
class ZoneConfig:
    """A piece of the tile that the operator marks.

    Attributes:
        kind: "exclude": stays clean; "include": nothing outside such zones is painted.
        corners: x, y of its corners in T, m: at least three, or two opposite ones of a
            rectangle.
    """

    kind: str = "exclude"
    corners: list[list[float]] = dataclasses.field(default_factory=list)

    def validate(self, name: str) -> None:
        """Raises ValueError for a value out of bounds; `name` is the zone's."""
        if self.kind not in ("exclude", "include"):
            raise ValueError(
                f'{name}.kind must be "exclude" or "include", got {self.kind!r}.'
            )
        if len(self.corners) < 2 or not all(
            len(corner) == 2 and all(math.isfinite(value) for value in corner)
            for corner in self.corners
        ):
            raise ValueError(
                f"{name}.corners must be two or more pairs x, y, got {self.corners!r}."
            )
        x, y = zip(*self.corners, strict=True)
        if max(x) - min(x) <= 0.0 or max(y) - min(y) <= 0.0:
            raise ValueError(
                f"{name}.corners must enclose more than 0 m², got {self.corners!r}."
            )

    def require_on(self, width: float, height: float, name: str) -> None:
        """Raises ValueError for a corner that is not on a tile or wall, m."""
        for x, y in self.corners:
            for axis, value, bound in (("x", x, width), ("y", y, height)):
                if not 0.0 <= value <= bound:
                    raise ValueError(
                        f"{name}.corners: {axis} must be 0 to {bound:g} m, got "
                        f"{value!r}."
                    )


@dataclasses.dataclass(kw_only=True)
class RasterConfig:
    """Strokes of a tile.

    Attributes:
        speed: Gun speed on a stroke, m/s.
        standoff: Distance from nozzle to wall along the spray axis, m. From 0.315 m a
            fan of 25 cm at 0.30 m fills 2 m in 14 strokes at its best pitch, not 15.
        overlap_pitch: Distance between strokes, m; 0 = the pitch of least variance for
            the tip, 2 pi a / j(gamma + 1/2, 1), spread to fill the tile's width.
        lead: Gun stays on this far beyond the edge of what is to be painted, m.
        keepout_margin: Grown around what must stay clean, m.
        min_stroke: Shorter strokes are dropped, m.
        wall_share: Without cut-in, the gun is on where at least this share of the
            fan's flow lands on wall that is to be painted.
        cut_in: Fit the strokes to the film that they leave, with strokes nearer to the
            wall beside edges; False = the raster alone.
        cut_in_standoff: Nearest stand-off of such strokes, m; the fan is narrower by
            as much. None are made where it is not below `standoff`.
        coats: Coats that the film is laid in, each with the same share of it; more
            than one are cut in.
        flash_off: Rest between two coats, for which the first dries, s; what a paint
            wants stands in its data sheet.
        direction: Of the strokes; "vertical" alone can be.
        zones: What the operator wants painted or left.
    """

    speed: float = 0.6
    standoff: float = 0.315
    overlap_pitch: float = 0.0
    lead: float = 0.005
    keepout_margin: float = 0.0
    min_stroke: float = 0.03
    wall_share: float = 0.5
    cut_in: bool = True
    cut_in_standoff: float = 0.06
    coats: int = 1
    flash_off: float = 60.0
    direction: str = "vertical"
    zones: list[ZoneConfig] = dataclasses.field(default_factory=list)

    def validate(self) -> None:
        """Raises ValueError for a value out of bounds."""
        check_positive("raster", speed=self.speed, standoff=self.standoff)
        if self.direction != "vertical":
            raise ValueError(
                'raster.direction must be "vertical": the fan\'s long axis is '
                "horizontal, fixed by how the gun is bolted on, and an arm of five "
                f"joints cannot roll it; got {self.direction!r}."
            )
        for number, zone in enumerate(self.zones):
            zone.validate(f"raster.zones[{number}]")
        if not 1 <= self.coats <= MOST_COATS:
            raise ValueError(
                f"raster.coats must be 1 to {MOST_COATS}, so that the valve can dose "
                f"them, got {self.coats!r}."
            )
        if self.coats > 1 and not self.cut_in:
            raise ValueError(
                f"raster.coats must be 1 without raster.cut_in, got {self.coats!r}."
            )
        if not 0.0 <= self.flash_off < math.inf:
            raise ValueError(
                f"raster.flash_off must be >= 0 s, got {self.flash_off!r}."
            )
        if not 0.05 <= self.cut_in_standoff < 1.0:
            raise ValueError(
                "raster.cut_in_standoff must be 0.05 to 1 m, got "
                f"{self.cut_in_standoff!r}."
            )
        for name in ("overlap_pitch", "lead", "keepout_margin", "min_stroke"):
            if not 0.0 <= getattr(self, name) < 1.0:
                raise ValueError(
                    f"raster.{name} must be 0 to 1 m, got {getattr(self, name)!r}."
                )
        if not 0.0 < self.wall_share < 1.0:
            raise ValueError(
                f"raster.wall_share must be between 0 and 1, got {self.wall_share!r}."
            )


@dataclasses.dataclass(kw_only=True)
class ScanConfig:
    """First sight of the wall and the zig-zag scan.

    Attributes:
        look_distance: Camera to expected wall at first sight, m; the arm has less far
            to fold, and to turn from side to side, than for a look from farther off.
        look_time: How long the arm holds still for first sight, s.
        distance: Camera to wall during the scan, m; up to a fifth less where the arm
            cannot fold back so far.
        speed: Camera speed on the rows, m/s.
        overlap: Share of a picture's height that neighbouring rows share.
        margin: How far beyond the tile's edge the pictures reach, m.
        more_looks: After the scan, at most so many looks into the shadows that it has
            left.
        more_look_time: How long the arm holds still for each of them, s: two pictures,
            those before and after not counted.
    """

    look_distance: float = 0.6
    look_time: float = 0.6
    distance: float = 0.70
    speed: float = 0.25
    overlap: float = 0.3
    margin: float = 0.05
    more_looks: int = 4
    more_look_time: float = 0.4

    def validate(self) -> None:
        """Raises ValueError for a value out of bounds."""
        values = dataclasses.asdict(self)
        looks = values.pop("more_looks")
        check_positive("scan", **values)
        # They are tried in every order to find the shortest.
        if not 0 <= looks <= 6:
            raise ValueError(f"scan.more_looks must be 0 to 6, got {looks!r}.")
        if self.overlap >= 0.9:
            raise ValueError(f"scan.overlap must be < 0.9, got {self.overlap!r}.")


@dataclasses.dataclass(kw_only=True)
class MotionConfig:
    """Arm motion.

    Attributes:
        limit_share: Share of the joints' velocity and acceleration limits that plans
            may use, so that tracking has something in hand.
        nozzle_speed: Most speed of the gun's nozzle, m/s; plans use `limit_share` of
            it, too. The joints alone let it have 2.2 m/s in transits of the named
            scenes.
        clearance: Least distance of the arm and gun from wall and obstacles, m.
        floor_clearance: Least distance from the floor and the arm's own frame, m; they
            are known better than what was mapped, and the gun turns close to the floor.
        sample_period: Spacing of a planned motion's samples, s.
        wall_keepout: The arm stays this far and the clearance from the wall until the
            wall has been scanned, m; what hangs on it is not known before. On the lower
            rows of a scan the bent elbow leaves no more than 0.10 m.
        home_deg: Joint angles, base yaw first, of the folded pose where every program
            ends and over which detours go: gun ahead, half a metre off the wall.
    """

    limit_share: float = 0.9
    nozzle_speed: float = 2.5
    clearance: float = 0.04
    floor_clearance: float = 0.01
    sample_period: float = 0.01
    wall_keepout: float = 0.10
    home_deg: list[float] = dataclasses.field(
        default_factory=lambda: [0.0, -111.0, 155.0, -44.0, 0.0]
    )

    def validate(self) -> None:
        """Raises ValueError for a value out of bounds."""
        values = dataclasses.asdict(self)
        home = values.pop("home_deg")
        check_positive("motion", **values)
        if self.floor_clearance > self.clearance:
            raise ValueError(
                f"motion.floor_clearance must be <= motion.clearance "
                f"({self.clearance!r} m), got {self.floor_clearance!r}."
            )
        if len(home) != 5 or not all(abs(angle) <= 180.0 for angle in home):
            raise ValueError(
                f"motion.home_deg must have 5 angles of -180 to 180, got {home!r}."
            )
        if self.limit_share > 1.0:
            raise ValueError(
                f"motion.limit_share must be <= 1, got {self.limit_share!r}."
            )
