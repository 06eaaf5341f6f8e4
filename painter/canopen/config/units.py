"""Joint units to drive units and back: gear, sign, encoder, and the wrist's coupling.

Joints are what the rest of Painter knows: base yaw, shoulder, elbow and wrist pitch,
wrist yaw. Axes are what the drives turn, counted after the gear: the first three joints
and the left and right shaft of the wrist's differential.

Drive limits are boxes, one interval an axis, while the differential turns the joints'
box into a diamond. Which box stands for it:

- positions (607Dh), speeds (607Fh, 6080h) and acceleration (60C5h) take the smallest
  box that holds every state the joints may have, so a drive never refuses a permitted
  motion; joint states outside that the box lets pass are stopped by the host, which
  clamps in joint space;
- the following error window (6065h) and the quick stop ramp (6085h) take the largest
  box inside, so that two axes at their bounds never add up to more at a joint than the
  joint's own bound.
"""

import enum
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from perception.ground import FloatArray

JOINTS = ("base_yaw", "shoulder_pitch", "elbow_pitch", "wrist_pitch", "wrist_yaw")
AXES = ("base_yaw", "shoulder_pitch", "elbow_pitch", "wrist_left", "wrist_right")

# axes = COUPLING @ joints: left = pitch + yaw, right = pitch - yaw.
# Source: models/arm/README.md, "Differential wrist".
COUPLING = np.eye(5)
COUPLING[3:, 3:] = [[1.0, 1.0], [1.0, -1.0]]
COUPLING.flags.writeable = False
INVERSE_COUPLING = np.linalg.inv(COUPLING)
INVERSE_COUPLING.flags.writeable = False

_TURN = 2.0 * math.pi


class VelocityUnit(enum.StrEnum):
    """Units that drives give velocities in."""

    COUNTS_PER_S = "counts/s"
    RPM = "rpm"


class AccelerationUnit(enum.StrEnum):
    """Units that drives give accelerations in."""

    COUNTS_PER_S2 = "counts/s2"
    RPM_PER_S = "rpm/s"


@dataclass(frozen=True)
class AxisUnits:
    """One drive's units.

    Attributes:
        counts_per_turn: Encoder counts a turn of the motor.
        gear: Motor turns a turn of the axis.
        sign: +1 if both turn the same way, -1 if not.
        zero: Axis angle at drive position 0, rad.
        velocity: Unit of velocities.
        acceleration: Unit of accelerations.
    """

    counts_per_turn: float
    gear: float
    sign: int = 1
    zero: float = 0.0
    velocity: VelocityUnit = VelocityUnit.COUNTS_PER_S
    acceleration: AccelerationUnit = AccelerationUnit.COUNTS_PER_S2

    @property
    def counts_per_rad(self) -> float:
        """Counts a radian of the axis, without sign."""
        return self.counts_per_turn * self.gear / _TURN

    def counts(self, angle: float) -> int:
        """Drive position of an axis angle, rad."""
        return round(self.sign * (angle - self.zero) * self.counts_per_rad)

    def angle(self, counts: float) -> float:
        """Axis angle, rad, of a drive position."""
        return self.sign * counts / self.counts_per_rad + self.zero

    def speed_scale(self) -> float:
        """Drive units of velocity per rad/s of the axis, without sign."""
        if self.velocity == VelocityUnit.RPM:
            return self.rpm_per_rad_s
        return self.counts_per_rad

    def acceleration_scale(self) -> float:
        """Drive units of acceleration per rad/s² of the axis."""
        if self.acceleration == AccelerationUnit.RPM_PER_S:
            return self.rpm_per_rad_s
        return self.counts_per_rad

    @property
    def rpm_per_rad_s(self) -> float:
        """Motor turns a minute per rad/s of the axis."""
        return self.gear * 60.0 / _TURN

    def speed(self, value: float) -> float:
        """Axis speed, rad/s, of a signed velocity in drive units."""
        return self.sign * value / self.speed_scale()


@dataclass(frozen=True)
class JointLimits:
    """Bounds of one joint.

    Attributes:
        q_min: Lowest position, rad.
        q_max: Highest position, rad.
        v_max: Greatest speed, rad/s.
        a_max: Greatest acceleration of planned motions, rad/s².
        stop: Deceleration of any stop, rad/s².
        following_error: Difference of commanded and actual position that is a fault,
            rad.
    """

    q_min: float
    q_max: float
    v_max: float
    a_max: float
    stop: float
    following_error: float


@dataclass(frozen=True)
class DriveLimits:
    """Bounds of one drive, in its own units.

    Attributes:
        position: 607Dh:1 and :2.
        profile_velocity: 607Fh.
        motor_speed: 6080h, always rpm.
        acceleration: 60C5h.
        quick_stop: 6085h.
        following_error: 6065h, counts.
    """

    position: tuple[int, int]
    profile_velocity: int
    motor_speed: int
    acceleration: int
    quick_stop: int
    following_error: int


def axes_from_joints(q: FloatArray) -> FloatArray:
    """Axis values (..., 5) of joint values (..., 5); positions, speeds or steps."""
    return q @ COUPLING.T


def joints_from_axes(axes: FloatArray) -> FloatArray:
    """Joint values (..., 5) of axis values (..., 5)."""
    return axes @ INVERSE_COUPLING.T


def drive_limits(
    joints: Sequence[JointLimits], units: Sequence[AxisUnits]
) -> list[DriveLimits]:
    """Turns the joints' limits into the drives'.

    Args:
        joints: Limits in the order of `JOINTS`.
        units: Units of the drives in the order of `AXES`.

    Returns:
        Limits in the order of `AXES`; the module says which boxes they are.

    Source: CiA 402-2 v4.0.0, objects 607Dh, 607Fh, 6080h (r/min), 60C5h, 6085h, 6065h.
    """
    low, high = _enclosing_box(
        np.array([j.q_min for j in joints]), np.array([j.q_max for j in joints])
    )
    speed = np.abs(COUPLING) @ [j.v_max for j in joints]
    acceleration = np.abs(COUPLING) @ [j.a_max for j in joints]
    stop = _inscribed_bound([j.stop for j in joints])
    error = _inscribed_bound([j.following_error for j in joints])
    limits = []
    for i, unit in enumerate(units):
        ends = sorted((unit.counts(low[i]), unit.counts(high[i])))
        limits.append(
            DriveLimits(
                position=(ends[0], ends[1]),
                profile_velocity=math.ceil(speed[i] * unit.speed_scale()),
                motor_speed=math.ceil(speed[i] * unit.rpm_per_rad_s),
                acceleration=math.ceil(acceleration[i] * unit.acceleration_scale()),
                quick_stop=math.floor(stop[i] * unit.acceleration_scale()),
                following_error=math.floor(error[i] * unit.counts_per_rad),
            )
        )
    return limits


def _enclosing_box(low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Interval arithmetic: least and greatest axis values over the joints' box."""
    middle, half = (low + high) / 2.0, (high - low) / 2.0
    centre = COUPLING @ middle
    reach = np.abs(COUPLING) @ half
    return centre - reach, centre + reach


def _inscribed_bound(bound: Sequence[float]) -> FloatArray:
    """Largest equal bounds of coupled axes that keep each joint within its own.

    |joint_j| <= sum_i |INVERSE_COUPLING[j, i]| * b, so b is the least of
    bound_j / that sum over the joints that the axis moves.
    """
    row_sums = np.abs(INVERSE_COUPLING).sum(axis=1)
    per_joint = np.asarray(bound) / row_sums
    moves = INVERSE_COUPLING.T != 0.0
    bounds: FloatArray = np.where(moves, per_joint[None, :], np.inf).min(axis=1)
    return bounds
