"""Paths of the gun's nozzle in front of the wall, timed by construction.

The gun stays square to the wall, so a path is the nozzle's place before it over time:
x, y and distance, which are its position in T where the wall is flat, and are laid on
the wall's surface where it is not.
Passes run at constant speed; blends join two passes. A blend's duration is the shortest
that the joints allow, found on densely evaluated inverse kinematics instead of being
left to a time parametriser, which can fail without saying so.
"""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from pydrake.math import RigidTransform

from painter.planning.arm.kinematics import ArmKinematics, ArmLimits
from painter.planning.motion.blend import KNOTS, MovingState, Shares, evaluate
from painter.planning.motion.joint_motion import SEARCH_SHARE, shortest, within_limits
from painter.planning.motion.surface_frame import SurfaceFrame
from perception.ground import BoolArray, FloatArray, FrozenValue

# Where a blend's joint rates are looked at, with one sample before and one after, on
# the passes that the blend joins.
_STEP = 1.0 / 48
_SAMPLES = Shares.at(np.linspace(-_STEP, 1.0 + _STEP, 51))
# Three of these each in the middle of both halves and of all: most blends that are too
# fast are so there.
_FEW = Shares.at(_SAMPLES.s[[12, 13, 14, 24, 25, 26, 36, 37, 38]])
_LONGEST = 8.0  # s, of a blend.
_FASTEST = 4.0  # m/s, mean speed of a blend that no arm of this size exceeds.
_DIFFERENCE = 1e-3  # s, half width of the central differences for joint states.


@dataclass(frozen=True, eq=False)
class Pass(FrozenValue):
    """A straight piece of path at constant speed.

    Attributes:
        p0_TG: (3,) m, in T, its start.
        v_TG: (3,) m/s, in T.
        duration: s.
    """

    p0_TG: FloatArray
    v_TG: FloatArray
    duration: float

    @classmethod
    def between(cls, p0_TG: FloatArray, p1_TG: FloatArray, speed: float) -> "Pass":
        """Makes the pass between two points (3,), m, in T, at `speed`, m/s.

        Raises:
            ValueError: The points are one and the same.
        """
        travel = np.asarray(p1_TG, dtype=float) - p0_TG
        length = float(np.linalg.norm(travel))
        if length == 0.0:
            raise ValueError("a pass must have a length > 0 m, got 0.")
        start = np.array(p0_TG, dtype=float)
        return cls(start, travel * (speed / length), length / speed)

    @property
    def start(self) -> MovingState:
        """Nozzle in T at its start."""
        return MovingState.steady(self.p0_TG, self.v_TG)

    @property
    def end(self) -> MovingState:
        """Nozzle in T at its end."""
        return MovingState.steady(self.p0_TG + self.duration * self.v_TG, self.v_TG)

    @property
    def knots(self) -> FloatArray:
        """Its start and its end, s."""
        return np.array([0.0, self.duration])

    def p_TG(self, time: FloatArray) -> FloatArray:
        """Returns (n, 3) m, in T, at `time` (n,) s."""
        return self.p0_TG + np.asarray(time)[:, None] * self.v_TG


@dataclass(frozen=True, eq=False)
class ToolBlend(FrozenValue):
    """A blend of the nozzle's position, over an obstacle if it has a hop.

    Attributes:
        start: Nozzle in T at its start.
        end: Nozzle in T at its end.
        duration: s.
        hop: How far the gun draws back from the wall on the way, m.
        rise: Share of the duration for drawing back, and again for coming down.
    """

    start: MovingState
    end: MovingState
    duration: float
    hop: float = 0.0
    rise: float = 0.5

    @property
    def knots(self) -> FloatArray:
        """Times where its third derivative steps, s."""
        ends_of_hop = [self.rise, 1.0 - self.rise] if self.hop else []
        return self.duration * np.union1d(KNOTS, ends_of_hop)

    def p_TG(self, time: FloatArray) -> FloatArray:
        """Returns (n, 3) m, in T, at `time` (n,) s."""
        s = np.asarray(time) / self.duration
        shares = Shares.at(s)
        p_TG, _ = evaluate(self.start, self.end, np.array([self.duration]), shares)
        p_TG[..., 2] += _hop_height(s, self.hop, self.rise)
        return np.asarray(p_TG[0])


class ToolPath(Protocol):
    """What `Pass` and `ToolBlend` have in common."""

    @property
    def duration(self) -> float:
        """Length in time, s."""

    @property
    def knots(self) -> FloatArray:
        """Times from 0 to `duration` between which it is smooth throughout, s."""

    def p_TG(self, time: FloatArray) -> FloatArray:
        """Returns (n, 3) m, in T, at `time` (n,) s."""


@dataclass(frozen=True, eq=False)
class WallIk(FrozenValue):
    """Inverse kinematics with the gun square to one wall, on one arm configuration.

    Attributes:
        kinematics: Of the arm.
        X_WT: Tile frame T in W.
        surface: Of the wall; None = T's plane.
    """

    kinematics: ArmKinematics
    X_WT: RigidTransform
    surface: SurfaceFrame | None = None

    def inverse_kinematics(self, p_TGs: FloatArray) -> FloatArray:
        """Returns joint angles with the nozzle at points before the wall.

        Args:
            p_TGs: (..., 3) m, in T; before a `surface`, places on it.

        Returns:
            (..., 5) rad, elbow up; NaN where the arm does not reach.
        """
        points = np.reshape(p_TGs, (-1, 3))
        axis_W = -self.X_WT.rotation().col(2)
        if self.surface is not None:
            points, normals = self.surface.points(points)
            axis_W = -(self.X_WT.rotation().matrix() @ normals.T).T
        p_WGs = (self.X_WT @ points.T).T
        q = self.kinematics.solve(p_WGs, axis_W)
        return q.reshape((*np.shape(p_TGs)[:-1], 5))

    def place(self, p_WG: FloatArray) -> FloatArray:
        """Returns where a nozzle (3,), m in W, is before the wall, as `solve` takes it.

        Near a `surface` this is its foot there and its distance; see
        `SurfaceFrame.places`.
        """
        p_TG = np.asarray(self.X_WT.inverse() @ p_WG)
        return p_TG if self.surface is None else self.surface.places(p_TG[None])[0]

    def keeps_rates(
        self, p_TGs: FloatArray, v_TGs: FloatArray, limits: ArmLimits
    ) -> BoolArray:
        """Tells where the joints can follow a nozzle that goes over the wall.

        Args:
            p_TGs: (n, 3) m, as `solve` takes them.
            v_TGs: (n, 3) or (3,) m/s, rates of these.
            limits: Of the joints, as far as the plan may use them.

        Returns:
            (n,) bool; False also where the arm does not reach.
        """
        before, q, after = (
            self.inverse_kinematics(p_TGs + time * v_TGs)
            for time in (-_DIFFERENCE, 0, _DIFFERENCE)
        )
        v = (after - before) / (2.0 * _DIFFERENCE)
        a = (after - 2.0 * q + before) / _DIFFERENCE**2
        with np.errstate(invalid="ignore"):
            keeps = np.abs(v) <= SEARCH_SHARE * limits.v_max
            keeps &= np.abs(a) <= SEARCH_SHARE * limits.a_max
        if limits.torques is not None:
            known = np.flatnonzero(np.isfinite(q).all(axis=1))
            torques = limits.torques(q[known], v[known], a[known])
            keeps[known] &= np.abs(torques) <= limits.effort_max
        return np.asarray(keeps.all(axis=1))

    def joint_states(self, *nozzles: MovingState) -> list[MovingState]:
        """Returns the joints' states for nozzles in T at constant velocities.

        NaN where the arm does not reach. The rates are central differences.
        """
        times = np.array([[-_DIFFERENCE], [0.0], [_DIFFERENCE]])
        places = np.array([nozzle.x + times * nozzle.v for nozzle in nozzles])
        return [
            MovingState(
                q,
                (after - before) / (2.0 * _DIFFERENCE),
                (after - 2.0 * q + before) / _DIFFERENCE**2,
            )
            for before, q, after in self.inverse_kinematics(places)
        ]


@dataclass(frozen=True, eq=False)
class ToolMove(FrozenValue):
    """A `Segment` that follows a tool path.

    Attributes:
        path: The nozzle over time.
        gun: Turns it into joint angles.
    """

    path: ToolPath
    gun: WallIk

    @property
    def duration(self) -> float:
        """Length in time, s."""
        return self.path.duration

    @property
    def knots(self) -> FloatArray:
        """See `Segment.knots`."""
        return self.path.knots

    def q(self, time: FloatArray) -> FloatArray:
        """See `Segment.q`."""
        return self.gun.inverse_kinematics(self.path.p_TG(time))


def fastest_tool_blend(
    start: MovingState,
    end: MovingState,
    *,
    gun: WallIk,
    limits: ArmLimits,
    hop: float = 0.0,
    rise: float = 0.5,
    longest: float = math.inf,
) -> ToolBlend | None:
    """Finds the tool blend of shortest duration that the joints can follow.

    Args:
        start: Nozzle in T at the start, at constant velocity.
        end: Nozzle in T at the end, at constant velocity.
        gun: Inverse kinematics.
        limits: Of the joints, as far as the plan may use them.
        hop: See `ToolBlend`.
        rise: See `ToolBlend`.
        longest: Only shorter blends are of use, s.

    Returns:
        The blend, or None if no duration of use, up to 8 s, keeps reach and limits.
    """
    few, heights = (_hop_height(samples.s, hop, rise) for samples in (_FEW, _SAMPLES))

    def possible(durations: FloatArray) -> BoolArray:
        return kept(durations, _FEW, few, every=3)

    def allowed(durations: FloatArray) -> BoolArray:
        return kept(durations, _SAMPLES, heights, every=1)

    def kept(
        durations: FloatArray, samples: Shares, heights: FloatArray, *, every: int
    ) -> BoolArray:
        """Looks at samples; at every third one if they come in threes."""
        p_TGs, _ = evaluate(start, end, durations, samples)
        p_TGs[..., 2] += heights
        q = gun.inverse_kinematics(p_TGs)
        before, at, after = (
            q[:, first : first + q.shape[1] - 2 : every] for first in range(3)
        )
        dt = (durations * _STEP)[:, None, None]
        v = (after - before) / (2.0 * dt)
        a = (after - 2.0 * at + before) / dt**2
        with np.errstate(invalid="ignore"):
            keeps = np.abs(v) <= SEARCH_SHARE * limits.v_max
            keeps &= np.abs(a) <= SEARCH_SHARE * limits.a_max
        return np.asarray(keeps.all(axis=(1, 2)) & limits.contains(q).all(axis=1))

    travel = float(np.linalg.norm(end.x - start.x))
    durations = np.geomspace(max(0.02, travel / _FASTEST), _LONGEST, 28)
    speed = float(np.linalg.norm(start.v + end.v)) / 2.0
    if speed > 0.0 and travel > 0.0:
        # Going straight on at constant speed needs no acceleration of the gun at all.
        durations = np.sort(np.append(durations, travel / speed))

    def certain(duration: float) -> bool:
        blend = ToolBlend(start, end, duration, hop, rise)
        return within_limits(ToolMove(blend, gun).q, duration, limits)

    duration = shortest(allowed, durations, certain, longest=longest, possible=possible)
    return None if duration is None else ToolBlend(start, end, duration, hop, rise)


def _hop_height(s: FloatArray, hop: float, rise: float) -> FloatArray:
    """Returns the hop's height (n,), m, at shares `s` (n,): up, along, down again."""
    if not hop:
        return np.zeros_like(s)

    def smooth_step(u: FloatArray) -> FloatArray:
        u = np.clip(u, 0.0, 1.0)
        return u**3 * (10.0 - 15.0 * u + 6.0 * u**2)

    return hop * smooth_step(s / rise) * smooth_step((1.0 - s) / rise)
