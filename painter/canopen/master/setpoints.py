"""Time-stamped setpoints: buffer with interpolation, stop ramp, limit checks."""

import bisect
import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from painter.canopen.config.units import JOINTS, JointLimits
from perception.ground import FloatArray

_MOST = 4096
_STILL = 1e-6
# How far a setpoint may be outside a joint's range, rad: rounding of a planned path.
_TOLERANCE = 1e-6
# Factor by which a step between two cycles may exceed the joint's speed limit.
_SPEED_MARGIN = 1.05


@dataclass(frozen=True)
class Setpoint:
    """Commanded joint state at a time.

    Attributes:
        time: Clock of the bus, s.
        q: (5,) rad.
        v: (5,) rad/s.
        trigger: 0 to 1 of nominal flow.
    """

    time: float
    q: FloatArray
    v: FloatArray
    trigger: float = 0.0


@dataclass(frozen=True)
class Sample:
    """Command of one cycle.

    Attributes:
        q: (5,) rad.
        v: (5,) rad/s.
        trigger: 0 to 1 of nominal flow.
        lag: Time since the last setpoint, s; 0 inside the buffer.
    """

    q: FloatArray
    v: FloatArray
    trigger: float
    lag: float

    @property
    def is_active(self) -> bool:
        """Whether it moves or sprays, so that the next setpoint must be on time."""
        return self.trigger > 0.0 or bool(np.any(np.abs(self.v) > _STILL))


class SetpointBuffer:
    """Setpoints ahead of now, with cubic Hermite interpolation between them."""

    def __init__(self) -> None:
        """Creates an empty buffer."""
        self._points: list[Setpoint] = []

    def __len__(self) -> int:
        """Number of setpoints held."""
        return len(self._points)

    def clear(self) -> None:
        """Drops all setpoints."""
        self._points = []

    def push(self, points: Sequence[Setpoint]) -> None:
        """Adds setpoints; they replace all held ones from their first time on.

        Raises:
            ValueError: Times do not increase, or a value is not finite.
        """
        times = [point.time for point in points]
        if any(b <= a for a, b in itertools.pairwise(times)):
            raise ValueError("times of setpoints must increase.")
        for point in points:
            values = np.concatenate([point.q, point.v, [point.time, point.trigger]])
            if values.shape != (12,) or not np.isfinite(values).all():
                raise ValueError(
                    f"setpoint at {point.time!r} s must be 5 finite q and 5 finite v."
                )
            if not 0.0 <= point.trigger <= 1.0:
                raise ValueError(f"trigger must be 0 to 1, got {point.trigger!r}.")
        if points:
            keep = bisect.bisect_left(self._points, times[0], key=lambda p: p.time)
            self._points = [*self._points[:keep], *points][-_MOST:]

    def sample(self, time: float) -> Sample | None:
        """Returns the command at a time, s; None before the first setpoint."""
        after = bisect.bisect_right(self._points, time, key=lambda p: p.time)
        if after == 0:
            return None
        first = self._points[after - 1]
        if after == len(self._points):
            return Sample(first.q, first.v, first.trigger, time - first.time)
        q, v = _cubic(first, self._points[after], time)
        return Sample(q, v, first.trigger, 0.0)

    def trigger(self, time: float) -> float:
        """Returns the trigger of the last setpoint before a time, s."""
        after = bisect.bisect_right(self._points, time, key=lambda p: p.time)
        return self._points[after - 1].trigger if after else 0.0

    def forget(self, time: float) -> None:
        """Drops setpoints that no command from `time`, s, on needs."""
        after = bisect.bisect_right(self._points, time, key=lambda p: p.time)
        del self._points[: max(0, after - 1)]


def _cubic(a: Setpoint, b: Setpoint, now: float) -> tuple[FloatArray, FloatArray]:
    """Hermite's cubic between two setpoints."""
    h = b.time - a.time
    s = (now - a.time) / h
    q = (
        (1 + 2 * s) * (1 - s) ** 2 * a.q
        + s * (1 - s) ** 2 * h * a.v
        + s * s * (3 - 2 * s) * b.q
        + s * s * (s - 1) * h * b.v
    )
    v = (
        6 * s * (s - 1) / h * (a.q - b.q)
        + (3 * s - 1) * (s - 1) * a.v
        + s * (3 * s - 2) * b.v
    )
    return q, v


class StopRamp:
    """A controlled stop: all joints decelerate evenly and stop at the same time."""

    def __init__(
        self, now: float, q: FloatArray, v: FloatArray, limits: Sequence[JointLimits]
    ) -> None:
        """Creates the ramp.

        Args:
            now: Start, s.
            q: (5,) commanded positions at the start, rad.
            v: (5,) commanded speeds at the start, rad/s.
            limits: Of each joint; `stop` gives the duration.
        """
        self._start, self._q, self._v = now, q.copy(), v.copy()
        stop = np.array([limit.stop for limit in limits])
        self.duration = float(np.max(np.abs(v) / stop, initial=0.0))
        self._low = np.array([limit.q_min for limit in limits])
        self._high = np.array([limit.q_max for limit in limits])

    def sample(self, now: float) -> Sample:
        """Returns the command at `now`, s, within the joints' ranges."""
        t = min(now - self._start, self.duration)
        if self.duration <= 0.0:
            return Sample(self._q, np.zeros(5), 0.0, 0.0)
        q = self._q + self._v * (t - t * t / (2.0 * self.duration))
        v = self._v * (1.0 - t / self.duration)
        return Sample(np.clip(q, self._low, self._high), v, 0.0, 0.0)


class SetpointGuard:
    """Checks samples against the limits of the joints."""

    def __init__(self, joints: Sequence[JointLimits], timeout: float) -> None:
        """Creates the guard.

        Args:
            joints: Limits in the order of `JOINTS`.
            timeout: Time without a setpoint while moving or spraying, s.
        """
        self._timeout = timeout
        self._low = np.array([joint.q_min for joint in joints])
        self._high = np.array([joint.q_max for joint in joints])
        self._v_max = np.array([joint.v_max for joint in joints])

    def clip(self, q: FloatArray) -> FloatArray:
        """Clips positions to the joints' ranges."""
        return np.clip(q, self._low, self._high)

    def violation(self, sample: Sample, q: FloatArray, elapsed: float) -> str | None:
        """Returns the limit that a sample violates, or None.

        Args:
            sample: The command.
            q: (5,) previous command, rad.
            elapsed: Time since then, s.
        """
        if sample.lag > self._timeout and sample.is_active:
            return (
                f"setpoints: none for {sample.lag:.3f} s while moving or spraying "
                f"(limit {self._timeout:g} s)."
            )
        outside = np.maximum(self._low - sample.q, sample.q - self._high)
        worst = int(np.argmax(outside))
        if outside[worst] > _TOLERANCE:
            return (
                f"setpoints: {JOINTS[worst]} must be {self._low[worst]:g} to "
                f"{self._high[worst]:g} rad, got {sample.q[worst]:.4f} rad."
            )
        speed = np.abs(sample.q - q) / elapsed
        worst = int(np.argmax(speed / self._v_max))
        if speed[worst] > _SPEED_MARGIN * self._v_max[worst]:
            return (
                f"setpoints: speed of {JOINTS[worst]} must be <= "
                f"{self._v_max[worst]:g} rad/s, got {speed[worst]:.3f} rad/s."
            )
        return None
