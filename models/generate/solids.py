"""Solids that links are made of: primitive shapes along an axis, with mass."""

import math
from dataclasses import dataclass

import numpy as np
from pydrake.multibody.tree import RotationalInertia, SpatialInertia, UnitInertia

# URDF cylinders and capsules lie along z; these angles turn z onto the named axis.
AXIS_RPY = {
    "x": (0.0, math.pi / 2, 0.0),
    "y": (-math.pi / 2, 0.0, 0.0),
    "z": (0.0, 0.0, 0.0),
}


@dataclass(frozen=True, kw_only=True)
class Cylinder:
    """A cylinder, or a tube where `bore` > 0.

    Attributes:
        center: m, in the link.
        axis: "x", "y" or "z" of the link.
        radius: m.
        length: m.
        bore: Inner radius, m; of the mass only, a collision shape is full.
    """

    center: tuple[float, float, float]
    axis: str
    radius: float
    length: float
    bore: float = 0.0

    @property
    def urdf(self) -> str:
        """The shape as a URDF geometry."""
        return f'<cylinder radius="{self.radius:g}" length="{self.length:g}"/>'

    @property
    def rpy(self) -> tuple[float, float, float]:
        """Roll, pitch and yaw of the URDF shape in the link, rad."""
        return AXIS_RPY[self.axis]

    def central_moments(self) -> np.ndarray:
        """Returns moments of inertia about the centre for a mass of 1 kg, (3,) m²."""
        squares = self.radius**2 + self.bore**2
        across = squares / 4.0 + self.length**2 / 12.0
        moments = np.full(3, across)
        moments["xyz".index(self.axis)] = squares / 2.0
        return moments


@dataclass(frozen=True, kw_only=True)
class Box:
    """A box along the link's axes.

    Attributes:
        center: m, in the link.
        size: Edges along x, y and z, m.
    """

    center: tuple[float, float, float]
    size: tuple[float, float, float]
    rpy = AXIS_RPY["z"]

    @property
    def urdf(self) -> str:
        """The shape as a URDF geometry."""
        return '<box size="{:g} {:g} {:g}"/>'.format(*self.size)

    def central_moments(self) -> np.ndarray:
        """Returns moments of inertia about the centre for a mass of 1 kg, (3,) m²."""
        squares = np.square(self.size)
        return (squares.sum() - squares) / 12.0


Shape = Cylinder | Box


@dataclass(frozen=True)
class Part:
    """A piece of a link: what it is, its shape and its mass in kg."""

    what: str
    shape: Shape
    mass: float


def central_inertia(parts: list[Part]) -> tuple[float, np.ndarray, np.ndarray]:
    """Adds up the parts of a link.

    Returns:
        Mass (kg), centre of mass (3,) and inertia (3, 3) about it, kg m².
    """
    total = SpatialInertia.Zero()
    for part in parts:
        moments = part.shape.central_moments()
        total += SpatialInertia.MakeFromCentralInertia(
            mass=part.mass,
            p_PScm_E=np.array(part.shape.center),
            I_SScm_E=RotationalInertia(*(part.mass * moments)),
        )
    mass, p_LLcm = total.get_mass(), total.get_com()
    unit: UnitInertia = total.Shift(p_LLcm).get_unit_inertia()
    return mass, p_LLcm, mass * unit.CopyToFullMatrix3()
