"""Scenarios: one file describes a run on either body.

`load_scenario` reads a named scenario or a file, applies `key=value` overrides and
checks every range. Drake's `yaml_load_typed` refuses unknown keys.
"""

import dataclasses
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import yaml
from pydrake.common.yaml import yaml_dump_typed, yaml_load_typed
from pydrake.multibody.plant import MultibodyPlantConfig

from painter.camera.config import CameraDriverConfig
from painter.errors import InputError
from painter.planning.config import (
    MotionConfig,
    RasterConfig,
    ScanConfig,
    TileConfig,
    TipConfig,
)
from painter.resources import models_path, named_scenarios
from perception.config import MapConfig, SegmentationConfig, StereoConfig
from perception.ground import check_positive
from perception.mapping.config import PoseGraphConfig


@dataclasses.dataclass(kw_only=True)
class PidGains:
    """Joint position loop; per unit of inertia, so 1/s², 1/s³ and 1/s."""

    kp: float = 1600.0
    ki: float = 0.0
    kd: float = 80.0


@dataclasses.dataclass(kw_only=True)
class DriveFault:
    """A fault to inject in the simulated drives; `code` as in CiA 402, 603Fh."""

    time: float = 0.0
    joint: int = 1
    code: int = 0x7500


@dataclasses.dataclass(kw_only=True)
class ArmConfig:
    """One arm; the simulator reads `gains`, `encoder_bits` and `faults`.

    Attributes:
        model_name: Name of the model instance in the plant.
        gains: Joint position loop of the simulated drives.
        encoder_bits: Resolution of the joint-side encoders, bits a turn.
        faults: Drive faults to inject; simulation only.
    """

    model_name: str = "arm"
    gains: PidGains = dataclasses.field(default_factory=PidGains)
    encoder_bits: int = 19
    faults: list[DriveFault] = dataclasses.field(default_factory=list)


@dataclasses.dataclass(kw_only=True)
class WallCameraConfig:
    """The depth camera on the tool.

    Attributes:
        rate: Depth pictures a second.
        color_width: Width of colour pictures, px.
        color_height: Height of colour pictures, px.
        stereo: Geometry and errors of the depth sensor.
        mount_error_m: Offset of the real mount from the modelled one along C's x, y
            and z; simulation only.
        mount_error_deg: Its rotation, roll, pitch and yaw about the same axes.
        calibrated_m: What `painter calibrate` found of that offset, on either body.
        calibrated_deg: Of its rotation.
        driver: How librealsense drives the real camera; not read in simulation.
    """

    rate: float = 5.0
    color_width: int = 848
    color_height: int = 480
    stereo: StereoConfig = dataclasses.field(default_factory=StereoConfig)
    mount_error_m: list[float] = dataclasses.field(default_factory=lambda: [0.0] * 3)
    mount_error_deg: list[float] = dataclasses.field(default_factory=lambda: [0.0] * 3)
    calibrated_m: list[float] = dataclasses.field(default_factory=lambda: [0.0] * 3)
    calibrated_deg: list[float] = dataclasses.field(default_factory=lambda: [0.0] * 3)
    driver: CameraDriverConfig = dataclasses.field(default_factory=CameraDriverConfig)


@dataclasses.dataclass(kw_only=True)
class GunConfig:
    """The spray gun; `tip` is what is screwed on."""

    tip: TipConfig = dataclasses.field(default_factory=TipConfig)


@dataclasses.dataclass(kw_only=True)
class CycleConfig:
    """The paint cycle.

    Attributes:
        unattended: True skips the operator's approval in REVIEW.
        period: Time between the brain's decisions, s.
        time_limit: Robot time after which a cycle that has not ended is a fault, s.
    """

    unattended: bool = True
    period: float = 0.02
    time_limit: float = 600.0


@dataclasses.dataclass(kw_only=True)
class Scenario:
    """Everything a run needs; the same file drives the simulated and the real body.

    Attributes:
        name: The scenario's name, the top key of its file.
        scene: Scene in front of the robot: a name in models/scenes, a file, or
            "random" for one drawn from `random_seed`; simulation only.
        random_seed: Seed of every random draw.
        directives: Model directives of the robot's cell, package:// or a path.
        plant_config: Drake's plant settings; simulation only.
    """

    name: str = "default"
    scene: str = "cubes"
    random_seed: int = 1
    directives: str = "package://painter_models/painter_cell.dmd.yaml"
    plant_config: MultibodyPlantConfig = dataclasses.field(
        default_factory=lambda: MultibodyPlantConfig(time_step=0.001)
    )
    arm: ArmConfig = dataclasses.field(default_factory=ArmConfig)
    wall_camera: WallCameraConfig = dataclasses.field(default_factory=WallCameraConfig)
    gun: GunConfig = dataclasses.field(default_factory=GunConfig)
    tile: TileConfig = dataclasses.field(default_factory=TileConfig)
    scan: ScanConfig = dataclasses.field(default_factory=ScanConfig)
    map: MapConfig = dataclasses.field(default_factory=MapConfig)
    pose_graph: PoseGraphConfig = dataclasses.field(default_factory=PoseGraphConfig)
    segmentation: SegmentationConfig = dataclasses.field(
        default_factory=SegmentationConfig
    )
    raster: RasterConfig = dataclasses.field(default_factory=RasterConfig)
    motion: MotionConfig = dataclasses.field(default_factory=MotionConfig)
    cycle: CycleConfig = dataclasses.field(default_factory=CycleConfig)

    def validate(self) -> None:
        """Raises ValueError for the first value out of bounds."""
        check_positive("plant_config", time_step=self.plant_config.time_step)
        check_positive("wall_camera", rate=self.wall_camera.rate)
        for name, gain in dataclasses.asdict(self.arm.gains).items():
            if not 0.0 <= gain < math.inf:
                raise ValueError(f"arm.gains.{name} must be >= 0, got {gain!r}.")
        check_positive("cycle", period=self.cycle.period)
        check_positive("cycle", time_limit=self.cycle.time_limit)
        if not 8 <= self.arm.encoder_bits <= 32:
            raise ValueError(
                f"arm.encoder_bits must be 8 to 32, got {self.arm.encoder_bits!r}."
            )
        for fault in self.arm.faults:
            if not 1 <= fault.joint <= 5:
                raise ValueError(
                    f"arm.faults: joint must be 1 to 5, got {fault.joint!r}."
                )
        for name in (
            "mount_error_m",
            "mount_error_deg",
            "calibrated_m",
            "calibrated_deg",
        ):
            if len(getattr(self.wall_camera, name)) != 3:
                raise ValueError(f"wall_camera.{name} must have 3 numbers.")
        fastest = self.motion.limit_share * self.motion.nozzle_speed
        if self.raster.speed > fastest:
            raise ValueError(
                f"raster.speed must be <= {fastest:g} m/s, motion.limit_share of "
                f"motion.nozzle_speed, got {self.raster.speed!r}."
            )
        drying = (self.raster.coats - 1) * self.raster.flash_off
        if drying >= self.cycle.time_limit:
            raise ValueError(
                f"cycle.time_limit must be > {drying:g} s, raster.flash_off of all "
                f"coats but the last, got {self.cycle.time_limit!r}."
            )
        for number, zone in enumerate(self.raster.zones):
            name = f"raster.zones[{number}]"
            zone.validate(name)
            zone.require_on(self.tile.width, self.tile.height, name)
        for part in (
            self.wall_camera.stereo,
            self.wall_camera.driver,
            self.gun.tip,
            self.tile,
            self.scan,
            self.map,
            self.pose_graph,
            self.segmentation,
            self.raster,
            self.motion,
        ):
            part.validate()


def load_scenario(name: str, overrides: Sequence[str] = ()) -> Scenario:
    """Loads a scenario by name or from a file.

    Args:
        name: A name from `named_scenarios()` or the path of a YAML file, whose single
            top key is the scenario's name.
        overrides: Words "key=value" with dotted keys, e.g. "raster.speed=0.5"; the
            value is read as YAML.

    Returns:
        The scenario, checked.

    Raises:
        InputError: There is no such scenario, a key is unknown or a value is not
            allowed; names the file, the key and the bound.
    """
    path = Path(name)
    if path.suffix not in (".yaml", ".yml"):
        path = models_path("scenarios", f"{name}.scenario.yaml")
        if not path.is_file():
            known = ", ".join(named_scenarios())
            raise InputError(
                f"scenario {name!r} is unknown; known are: {known}.",
                code="PNT-SCENARIO-001",
            )
    try:
        document = yaml.safe_load(path.read_text())
    except FileNotFoundError:
        raise InputError(
            f"{path}: no such scenario file.", code="PNT-SCENARIO-002"
        ) from None
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise InputError(
            f"{path}: {_one_line(error)}", code="PNT-SCENARIO-003"
        ) from error
    if not isinstance(document, dict) or len(document) != 1:
        raise InputError(
            f"{path}: expected one top key, the scenario's name.",
            code="PNT-SCENARIO-004",
        )
    ((top, fields),) = document.items()
    if not isinstance(fields, dict | None):
        raise InputError(
            f"{path}: expected fields below {top!r}, got {fields!r}.",
            code="PNT-SCENARIO-005",
        )
    fields = dict(fields or {})
    fields.setdefault("name", str(top))
    for word in overrides:
        _override(fields, word)
    try:
        scenario: Scenario = yaml_load_typed(
            schema=Scenario, data=yaml.safe_dump(fields), defaults=Scenario()
        )
        scenario.validate()
    except (RuntimeError, ValueError, TypeError, KeyError, AssertionError) as error:
        raise InputError(
            f"{path}: {_one_line(error)}", code="PNT-SCENARIO-006"
        ) from error
    return scenario


def dump_scenario(scenario: Scenario) -> str:
    """Returns the whole scenario as YAML that `load_scenario` reads back."""
    text: str = yaml_dump_typed({scenario.name: scenario}, schema=dict[str, Scenario])
    return text


def _override(fields: dict[str, Any], word: str) -> None:
    key, separator, text = word.partition("=")
    if not separator or not key:
        raise InputError(
            f"--set {word!r}: expected key=value.", code="PNT-SCENARIO-007"
        )
    *parents, last = key.split(".")
    for parent in parents:
        fields = fields.setdefault(parent, {})
        if not isinstance(fields, dict):
            raise InputError(
                f"--set {word!r}: {parent!r} has no fields.", code="PNT-SCENARIO-008"
            )
    try:
        fields[last] = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise InputError(
            f"--set {word!r}: {_one_line(error)}", code="PNT-SCENARIO-009"
        ) from error


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())
