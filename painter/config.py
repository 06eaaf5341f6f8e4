"""Scenarios: one file describes a run on either body.

`load_scenario` reads a named scenario or a file, applies `key=value` overrides and
checks every value; see `perception.settings`.
"""

import dataclasses
from collections.abc import Iterator, Sequence
from typing import Any

import yaml
from pydrake.common.yaml import yaml_dump_typed, yaml_load_typed
from pydrake.multibody.plant import MultibodyPlantConfig

from painter.camera.config import CameraDriverConfig
from painter.errors import InputError
from painter.named_yaml import read_named
from painter.planning.config import (
    MotionConfig,
    RasterConfig,
    ScanConfig,
    TileConfig,
    TipConfig,
)
from painter.resources import named_scenarios
from painter.typed_yaml import CONVERTER, read_typed
from perception.config import MapConfig, SegmentationConfig, StereoConfig
from perception.mapping.config import PoseGraphConfig
from perception.settings import Conflict, setting, validate


@dataclasses.dataclass(kw_only=True)
class PidGains:
    """Joint position loop, per unit of inertia.

    Attributes:
        kp: Gain on the position error.
        ki: Gain on its integral.
        kd: Gain on the velocity error.
    """

    kp: float = setting(1600.0, "1/s²", least=0.0, most=1e6)
    ki: float = setting(0.0, "1/s³", least=0.0, most=1e8)
    kd: float = setting(80.0, "1/s", least=0.0, most=1e4)


@dataclasses.dataclass(kw_only=True)
class DriveFault:
    """A fault to inject in the simulated drives.

    Attributes:
        time: When it happens.
        joint: Joint of the drive, base yaw first.
        code: Error code that the drive reports.
    """

    time: float = setting(0.0, "s", least=0.0, most=86_400.0)
    joint: int = setting(1, "1", least=1, most=5)
    code: int = setting(0x7500, "1", least=0, most=0xFFFF, source="CiA 402, 603Fh")


@dataclasses.dataclass(kw_only=True)
class ArmConfig:
    """The arm; simulation only.

    Attributes:
        gains: Joint position loop of the simulated drives.
        encoder_bits: Resolution of the joint-side encoders, bits per turn.
        faults: Drive faults to inject.
    """

    gains: PidGains = setting(PidGains())
    encoder_bits: int = setting(19, "1", least=8, most=32)
    faults: list[DriveFault] = setting([])


@dataclasses.dataclass(kw_only=True)
class WallCameraConfig:
    """The depth camera on the tool.

    Attributes:
        rate: Depth images per second.
        color_width: Width of colour images.
        color_height: Height of colour images.
        mount_error_m: Offset of the real mount from the modelled one along C's x, y and
            z; simulation only.
        mount_error_deg: Its rotation: roll, pitch and yaw about the same axes;
            simulation only.
        calibrated_m: Offset of the mount as `painter calibrate` found it, on either
            body.
        calibrated_deg: Rotation of the mount as `painter calibrate` found it.
    """

    rate: float = setting(5.0, "Hz", above=0.0, most=90.0)
    color_width: int = setting(848, "px", least=16, most=4096)
    color_height: int = setting(480, "px", least=16, most=4096)
    stereo: StereoConfig = setting(StereoConfig())
    mount_error_m: list[float] = setting([0.0] * 3, "m", least=-0.5, most=0.5, length=3)
    mount_error_deg: list[float] = setting(
        [0.0] * 3, "deg", least=-180.0, most=180.0, length=3
    )
    calibrated_m: list[float] = setting([0.0] * 3, "m", least=-0.5, most=0.5, length=3)
    calibrated_deg: list[float] = setting(
        [0.0] * 3, "deg", least=-180.0, most=180.0, length=3
    )
    driver: CameraDriverConfig = setting(CameraDriverConfig())


@dataclasses.dataclass(kw_only=True)
class GunConfig:
    """The spray gun."""

    tip: TipConfig = setting(TipConfig())


@dataclasses.dataclass(kw_only=True)
class CycleConfig:
    """The paint cycle.

    Attributes:
        unattended: True skips the operator's approval in REVIEW.
        period: Time between two decisions of the brain.
        time_limit: A cycle that has not ended after this robot time is a fault.
    """

    unattended: bool = setting(True)
    period: float = setting(0.02, "s", above=0.0, most=1.0)
    time_limit: float = setting(600.0, "s", above=0.0, most=604_800.0)


@dataclasses.dataclass(kw_only=True)
class Scenario:
    """Everything a run needs; the same file drives the simulated and the real body.

    Attributes:
        name: The scenario's name, the top key of its file.
        scene: Scene in front of the robot: a name in models/scenes, a file, or
            "random" for one drawn from `random_seed`; simulation only.
        random_seed: Seed of every random draw.
        directives: Model directives of the robot's cell, package:// or a path.
        plant_config: Drake's plant settings, `MultibodyPlantConfig`; simulation only.
    """

    name: str = setting("default")
    scene: str = setting("cubes")
    random_seed: int = setting(1, "1", least=0, most=2**32 - 1)
    directives: str = setting("package://painter_models/painter_cell.dmd.yaml")
    plant_config: MultibodyPlantConfig = setting(MultibodyPlantConfig(time_step=0.001))
    arm: ArmConfig = setting(ArmConfig())
    wall_camera: WallCameraConfig = setting(WallCameraConfig())
    gun: GunConfig = setting(GunConfig())
    tile: TileConfig = setting(TileConfig())
    scan: ScanConfig = setting(ScanConfig())
    map: MapConfig = setting(MapConfig())
    pose_graph: PoseGraphConfig = setting(PoseGraphConfig())
    segmentation: SegmentationConfig = setting(SegmentationConfig())
    raster: RasterConfig = setting(RasterConfig())
    motion: MotionConfig = setting(MotionConfig())
    cycle: CycleConfig = setting(CycleConfig())

    def conflicts(self) -> Iterator[Conflict]:
        """Yields values that do not fit together, across parts."""
        time_step = self.plant_config.time_step
        if not 0.0 < time_step <= 0.01:
            yield "plant_config.time_step", "> 0 and <= 0.01 s", time_step
        fastest = self.motion.limit_share * self.motion.nozzle_speed
        if self.raster.speed > fastest:
            bound = f"<= {fastest:g} m/s, motion.limit_share of motion.nozzle_speed"
            yield "raster.speed", bound, self.raster.speed
        drying = (self.raster.coats - 1) * self.raster.flash_off
        if drying >= self.cycle.time_limit:
            bound = f"> {drying:g} s, raster.flash_off of all coats but the last"
            yield "cycle.time_limit", bound, self.cycle.time_limit
        for i, zone in enumerate(self.raster.zones):
            for field, bound, x in zone.beyond(self.tile.width, self.tile.height):
                yield f"raster.zones[{i}].{field}", bound, x
        stereo = self.wall_camera.stereo
        nearest = max(stereo.min_range, self.map.min_range)
        farthest = min(stereo.max_range, self.map.max_range)
        for name in ("look_distance", "distance"):
            distance = getattr(self.scan, name)
            if not nearest < distance <= farthest:
                bound = (
                    f"> {nearest:g} m and <= {farthest:g} m, the range of "
                    "wall_camera.stereo (min_range, max_range) and of map"
                )
                yield f"scan.{name}", bound, distance


def _read_plant(data: object, _: type) -> MultibodyPlantConfig:
    # Drake's own reader, whose errors are of many types and name no field.
    try:
        return yaml_load_typed(
            schema=MultibodyPlantConfig,
            data=yaml.safe_dump(data),
            defaults=Scenario().plant_config,
        )
    except (RuntimeError, ValueError, TypeError, AssertionError) as error:
        raise ValueError(f"cannot be read: {' '.join(str(error).split())}") from error


CONVERTER.register_structure_hook(MultibodyPlantConfig, _read_plant)


# Settings of older files, which run folders keep.
_REMOVED = ("arm.model_name", "pose_graph.optimize_every", "raster.direction")


def load_scenario(name: str, overrides: Sequence[str] = ()) -> Scenario:
    """Loads a scenario by name or from a file.

    Args:
        name: A name from `named_scenarios()` or the path of a YAML file, whose single
            top key is the scenario's name.
        overrides: Settings "key=value" with dotted keys, e.g. "raster.speed=0.5"; the
            value is read as YAML, and a later one wins.

    Returns:
        The scenario, checked.

    Raises:
        InputError: There is no such scenario, a key is unknown or a value is out of
            bounds; names the file, the field, the value and the bound.
    """
    path, fields = read_named("scenario", name, named_scenarios())
    for override in overrides:
        _override(fields, override)
    try:
        scenario = read_typed(Scenario, fields)
        validate(scenario)
    except ValueError as error:
        # A value of --set is not in the file.
        field = str(error).partition(" ")[0]
        given = [o for o in overrides if o.partition("=")[0] == field]
        source = f"--set {given[-1]}" if given else path
        cure = " It was removed; delete the line." if field in _REMOVED else ""
        raise InputError(f"{source}: {error}{cure}", code="PNT-SCENARIO-001") from error
    return scenario


def dump_scenario(scenario: Scenario) -> str:
    """Returns the whole scenario as YAML that `load_scenario` reads back."""
    text: str = yaml_dump_typed({scenario.name: scenario}, schema=dict[str, Scenario])
    return text


def _override(fields: dict[str, Any], override: str) -> None:
    key, separator, text = override.partition("=")
    if not separator or not key:
        raise InputError(
            f"--set {override!r}: expected key=value.", code="PNT-SCENARIO-002"
        )
    *parents, last = key.split(".")
    for parent in parents:
        fields = fields.setdefault(parent, {})
        if not isinstance(fields, dict):
            raise InputError(
                f"--set {override!r}: {parent!r} has no fields.",
                code="PNT-SCENARIO-003",
            )
    try:
        fields[last] = yaml.safe_load(text)
    except yaml.YAMLError as error:
        reason = " ".join(str(error).split())
        raise InputError(
            f"--set {override!r}: {reason}", code="PNT-SCENARIO-004"
        ) from error
