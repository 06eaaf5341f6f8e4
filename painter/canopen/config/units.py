"""Joint units to drive units and back: gear, sign, encoder, and the wrist's coupling.

Joints are those of the arm model: base yaw, shoulder, elbow and wrist pitch, wrist yaw.
Axes are the output shafts of the drives' gears: the first three joints, and the left
and right shaft of the wrist's differential.

Drive limits are boxes, one interval an axis, while the differential maps the joints'
box to a diamond. These boxes replace it:

- positions (607Dh), speeds (607Fh, 6080h) and acceleration (60C5h): the smallest
  enclosing box, so that a drive never rejects a permitted motion. The host clips in
  joint space, which excludes the corners of the box;
- the following error window (6065h) and the quick stop ramp (6085h): the largest
  inscribed box, so that two axes at their bounds never exceed the bound of a joint.
"""

import enum
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from perception.ground import FloatArray
from perception.settings import Conflict, required

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
    """Units of velocities in a drive."""

    COUNTS_PER_S = "counts/s"
    RPM = "rpm"


class AccelerationUnit(enum.StrEnum):
    """Units of accelerations in a drive."""

    COUNTS_PER_S2 = "counts/s2"
    RPM_PER_S = "rpm/s"


@dataclass(frozen=True)
class AxisUnits:
    """One drive's units.

    Attributes:
        counts_per_turn: Encoder counts a turn of the motor.
        gear: Motor turns a turn of the axis.
        sign: +1 if motor and axis turn in the same sense, -1 if not.
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
        """Counts per radian of the axis, without sign."""
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
        """Motor speed in rpm per rad/s of the axis."""
        return self.gear * 60.0 / _TURN

    def speed(self, value: float) -> float:
        """Axis speed, rad/s, of a signed velocity in drive units."""
        return self.sign * value / self.speed_scale()


@dataclass(frozen=True)
class JointLimits:
    """Bounds of one joint.

    Attributes:
        q_min: Lower position limit, rad.
        q_max: Upper position limit, rad.
        v_max: Speed limit, rad/s.
        a_max: Acceleration limit of planned motions, rad/s².
        stop: Deceleration of any stop, rad/s².
        following_error: Following error that is a fault, rad.
    """

    q_min: float = required("rad")
    q_max: float = required("rad")
    v_max: float = required("rad/s", above=0.0)
    a_max: float = required("rad/s2", above=0.0)
    stop: float = required("rad/s2", above=0.0)
    following_error: float = required("rad", above=0.0)

    def conflicts(self) -> Iterator[Conflict]:
        """Checks the limits against each other."""
        if not self.q_min < self.q_max:
            yield "q_min", f"< q_max {self.q_max!r}", self.q_min


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
    """Converts joint limits to drive limits.

    Args:
        joints: Limits in the order of `JOINTS`.
        units: Units of the drives in the order of `AXES`.

    Returns:
        Limits in the order of `AXES`; see the module for the boxes.

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
    """Interval arithmetic: range of axis values over the joints' box."""
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
