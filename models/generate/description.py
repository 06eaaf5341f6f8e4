"""Descriptions of the models: links, joints and frames, read from YAML files."""

from dataclasses import dataclass, field
from pathlib import Path

import cattrs
import yaml

from painter_models.generate.solids import Part, Shape


@dataclass(frozen=True, kw_only=True)
class Link:
    """One link of a model.

    Attributes:
        name: Its name, and that of its mesh.
        parts: What weighs something.
        collisions: Convex shapes around it.
    """

    name: str
    parts: list[Part]
    collisions: list[Shape]


@dataclass(frozen=True, kw_only=True)
class Joint:
    """A driven revolute joint.

    Attributes:
        name: Its name.
        parent: Link before it.
        child: Link after it; its frame is the joint's at zero.
        xyz: Where it sits in the parent, m.
        axis: Its axis in the child's frame.
        lower: Lowest position, rad.
        upper: Highest position, rad.
        velocity: Greatest speed, rad/s.
        acceleration: Greatest acceleration, rad/s².
        effort: Greatest torque at the joint, N m.
        gear_ratio: Turns of the motor a turn of the joint.
        rotor_inertia: Of all that turns at motor speed, kg m².
        damping: Viscous friction at the joint, N m s.
    """

    name: str
    parent: str
    child: str
    xyz: tuple[float, float, float]
    axis: str
    lower: float
    upper: float
    velocity: float
    acceleration: float
    effort: float
    gear_ratio: float
    rotor_inertia: float
    damping: float


@dataclass(frozen=True, kw_only=True)
class FixedFrame:
    """A named frame on a link; `xyz` in m, roll, pitch and yaw in degrees."""

    name: str
    link: str
    xyz: tuple[float, float, float]
    rpy_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, kw_only=True)
class Model:
    """A URDF file: models/`folder`/`folder`.urdf."""

    folder: str
    links: list[Link]
    joints: list[Joint] = field(default_factory=list)
    frames: list[FixedFrame] = field(default_factory=list)


def read_model(folder: str) -> Model:
    """Reads the description of models/`folder`."""
    text = Path(__file__).with_name(f"{folder}.yaml").read_text()
    return cattrs.Converter(forbid_extra_keys=True).structure(
        yaml.safe_load(text), Model
    )


MODELS = {folder: read_model(folder) for folder in ("arm", "gun", "camera", "frame")}
