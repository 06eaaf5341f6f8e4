"""Paths of the gun's nozzle in front of the wall, timed by construction.

The gun stays square to the wall, so a path is a position over time: x, y and distance.
On a flat wall these are the nozzle's coordinates in T; elsewhere they follow the wall's
surface. Passes run at constant speed; blends join two passes. A blend takes the
shortest duration that the joints allow, found on densely sampled inverse kinematics:
a time parametriser can fail without saying so.
"""

import math
from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform

from painter.planning.arm.kinematics import ArmKinematics, ArmLimits
from painter.planning.motion.blend import KNOTS, MovingState, Shares, evaluate
from painter.planning.motion.joint_motion import SEARCH_SHARE, shortest, within_limits
from painter.planning.motion.surface_frame import SurfaceFrame
from perception.ground import BoolArray, FloatArray, FrozenValue

# Where a blend's joint rates are sampled, with one sample before and one after, on the
# passes that the blend joins.
_STEP = 1.0 / 48
_SAMPLES = Shares.at(np.linspace(-_STEP, 1.0 + _STEP, 51))
# Three of these in the middle of each half and of the whole: most blends that are too
# fast exceed their limits there.
_FEW = Shares.at(_SAMPLES.s[[12, 13, 14, 24, 25, 26, 36, 37, 38]])
_LONGEST = 8.0  # s, longest blend tried.
_FASTEST = 4.0  # m/s; no arm of this size has a blend of a higher mean speed.
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
            ValueError: The points coincide.
        """
        travel = np.asarray(p1_TG, dtype=float) - p0_TG
        length = float(np.linalg.norm(travel))
        if length == 0.0:
            raise ValueError("a pass must have a length > 0 m, got 0.")
        start = np.array(p0_TG, dtype=float)
        return cls(start, travel * (speed / length), length / speed)

    @property
    def start(self) -> MovingState:
        """State of the nozzle in T at its start."""
        return MovingState.steady(self.p0_TG, self.v_TG)

    @property
    def end(self) -> MovingState:
        """State of the nozzle in T at its end."""
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
    """A blend of the nozzle's position; a retract takes it over an obstacle.

    Attributes:
        start: State of the nozzle in T at its start.
        end: State of the nozzle in T at its end.
        duration: s.
        retract: How far the gun retracts from the wall on the way, m.
        ramp_share: Share of the duration for the retract, and again for the return.
    """

    start: MovingState
    end: MovingState
    duration: float
    retract: float = 0.0
    ramp_share: float = 0.5

    @property
    def knots(self) -> FloatArray:
        """Times where its third derivative steps, s."""
        ramps = [self.ramp_share, 1.0 - self.ramp_share] if self.retract else []
        return self.duration * np.union1d(KNOTS, ramps)

    def p_TG(self, time: FloatArray) -> FloatArray:
        """Returns (n, 3) m, in T, at `time` (n,) s."""
        s = np.asarray(time) / self.duration
        shares = Shares.at(s)
        p_TG, _ = evaluate(self.start, self.end, np.array([self.duration]), shares)
        p_TG[..., 2] += _retraction(s, self.retract, self.ramp_share)
        return np.asarray(p_TG[0])


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
            p_TGs: (..., 3) m, in T; with a `surface`, coordinates on it.

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
        """Returns a nozzle (3,), m in W, as `inverse_kinematics` takes it.

        With a `surface` this is its foot there and its distance; see
        `SurfaceFrame.places`.
        """
        p_TG = np.asarray(self.X_WT.inverse() @ p_WG)
        return p_TG if self.surface is None else self.surface.places(p_TG[None])[0]

    def within_rates(
        self, p_TGs: FloatArray, v_TGs: FloatArray, limits: ArmLimits
    ) -> BoolArray:
        """Tells where the joints can follow a moving nozzle.

        Args:
            p_TGs: (n, 3) m, as `inverse_kinematics` takes them.
            v_TGs: (n, 3) or (3,) m/s, rates of these.
            limits: Of the joints, as far as the plan may use them.

        Returns:
            (n,) bool; False also out of reach.
        """
        before, q, after = (
            self.inverse_kinematics(p_TGs + time * v_TGs)
            for time in (-_DIFFERENCE, 0, _DIFFERENCE)
        )
        v = (after - before) / (2.0 * _DIFFERENCE)
        a = (after - 2.0 * q + before) / _DIFFERENCE**2
        within = _within_rates(v, a, limits)
        if limits.torques is not None:
            known = np.flatnonzero(np.isfinite(q).all(axis=1))
            torques = limits.torques(q[known], v[known], a[known])
            within[known] &= np.abs(torques) <= limits.effort_max
        return np.asarray(within.all(axis=1))

    def joint_states(self, *nozzles: MovingState) -> list[MovingState]:
        """Returns joint states for nozzles in T at constant velocities.

        NaN out of reach. The rates are central differences.
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
        ik: Turns it into joint angles.
    """

    path: Pass | ToolBlend
    ik: WallIk

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
        return self.ik.inverse_kinematics(self.path.p_TG(time))


def fastest_tool_blend(
    start: MovingState,
    end: MovingState,
    *,
    ik: WallIk,
    limits: ArmLimits,
    retract: float = 0.0,
    ramp_share: float = 0.5,
    longest: float = math.inf,
) -> ToolMove | None:
    """Finds the tool blend of shortest duration that the joints can follow.

    Args:
        start: State of the nozzle in T at the start, at constant velocity.
        end: The same at the end.
        ik: Inverse kinematics.
        limits: Of the joints, as far as the plan may use them.
        retract: See `ToolBlend`.
        ramp_share: See `ToolBlend`.
        longest: Only shorter blends are of use, s.

    Returns:
        The blend as a move; None if no duration of use, up to 8 s, is within reach and
        limits.
    """

    def quick_check(durations: FloatArray) -> BoolArray:
        return kept(durations, _FEW, every=3)

    def feasible(durations: FloatArray) -> BoolArray:
        return kept(durations, _SAMPLES, every=1)

    def kept(durations: FloatArray, samples: Shares, *, every: int) -> BoolArray:
        """Checks the limits at samples; at every third one if they come in threes."""
        p_TGs, _ = evaluate(start, end, durations, samples)
        p_TGs[..., 2] += _retraction(samples.s, retract, ramp_share)
        q = ik.inverse_kinematics(p_TGs)
        before, at, after = (
            q[:, first : first + q.shape[1] - 2 : every] for first in range(3)
        )
        dt = (durations * _STEP)[:, None, None]
        v = (after - before) / (2.0 * dt)
        a = (after - 2.0 * at + before) / dt**2
        within = _within_rates(v, a, limits).all(axis=(1, 2))
        return np.asarray(within & limits.contains(q).all(axis=1))

    def move(duration: float) -> ToolMove:
        return ToolMove(ToolBlend(start, end, duration, retract, ramp_share), ik)

    def verified(duration: float) -> bool:
        return within_limits(move(duration).q, duration, limits)

    travel = float(np.linalg.norm(end.x - start.x))
    durations = np.geomspace(max(0.02, travel / _FASTEST), _LONGEST, 28)
    speed = float(np.linalg.norm(start.v + end.v)) / 2.0
    if speed > 0.0 and travel > 0.0:
        # Going straight on at constant speed needs no acceleration of the gun at all.
        durations = np.sort(np.append(durations, travel / speed))
    duration = shortest(
        feasible, durations, verified, longest=longest, quick_check=quick_check
    )
    return None if duration is None else move(duration)


def _within_rates(v: FloatArray, a: FloatArray, limits: ArmLimits) -> BoolArray:
    """Tells which joint rates (..., 5) and accelerations a search accepts."""
    with np.errstate(invalid="ignore"):
        within = np.abs(v) <= SEARCH_SHARE * limits.v_max
        within &= np.abs(a) <= SEARCH_SHARE * limits.a_max
    return np.asarray(within)


def _retraction(s: FloatArray, retract: float, ramp_share: float) -> FloatArray:
    """Returns how far the gun is retracted (n,), m, at shares `s` (n,)."""
    if not retract:
        return np.zeros_like(s)

    def smooth_step(u: FloatArray) -> FloatArray:
        u = np.clip(u, 0.0, 1.0)
        return u**3 * (10.0 - 15.0 * u + 6.0 * u**2)

    return retract * smooth_step(s / ramp_share) * smooth_step((1.0 - s) / ramp_share)
