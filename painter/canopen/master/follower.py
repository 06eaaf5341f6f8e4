"""The command of each cycle: from setpoints, on their underrun, on a stop ramp."""

from collections.abc import Sequence

import numpy as np

from painter.canopen.config.units import JointLimits
from painter.canopen.master.setpoints import (
    Sample,
    Setpoint,
    SetpointBuffer,
    SetpointGuard,
    StopRamp,
)
from perception.ground import FloatArray

# Drives take a target sent after SYNC k at SYNC k + 1 and reach it at SYNC k + 2.
# Setpoints are sampled that far ahead, so that the arm is there at the setpoint's time.
TARGET_CYCLES = 2
# The valve acts at once. Setpoints and cycles both round the time of an edge up, by
# half a cycle on average: sampled one cycle ahead, edges are on time on average.
TRIGGER_CYCLES = 1
# Share by which the arm is faster until it has caught up a skipped cycle; below the
# speed margin of the guard.
CATCH_UP = 0.02


class SetpointFollower:
    """Follows setpoints in joint space; brakes when they violate a limit.

    Attributes:
        q: (5,) commanded positions, rad.
        v: (5,) commanded speeds, rad/s.
        trigger: Commanded share of nominal flow, 0 to 1.
    """

    def __init__(
        self,
        joints: Sequence[JointLimits],
        *,
        cycle: float,
        timeout: float,
        sync_time: float = 0.0,
    ) -> None:
        """Creates a follower that holds zero.

        Args:
            joints: Limits in the order of `units.JOINTS`.
            cycle: Time between two steps, s.
            timeout: Longest time without a setpoint while moving or spraying, s.
            sync_time: Time a SYNC takes on the bus, s.
        """
        self._joints = joints
        self._cycle = cycle
        self._ahead = TARGET_CYCLES * cycle + sync_time
        self._guard = SetpointGuard(joints, timeout)
        self._buffer = SetpointBuffer()
        self._ramp: StopRamp | None = None
        self._behind = 0.0
        self.q, self.v, self.trigger = np.zeros(5), np.zeros(5), 0.0

    def __len__(self) -> int:
        """Number of setpoints held."""
        return len(self._buffer)

    @property
    def is_braking(self) -> bool:
        """Whether a stop ramp runs or is held at its end."""
        return self._ramp is not None

    @property
    def braking_time(self) -> float:
        """Duration of the stop ramp, s; 0 without one."""
        return 0.0 if self._ramp is None else self._ramp.duration

    def push(self, points: Sequence[Setpoint]) -> None:
        """Adds setpoints.

        Raises:
            ValueError: Times do not increase, or a value is not finite.
        """
        self._buffer.push(points)

    def hold(self, q: FloatArray) -> None:
        """Drops setpoints and ramp, and holds a position, (5,) rad."""
        self.release()
        self.q, self.v = q, np.zeros(5)

    def release(self) -> None:
        """Drops setpoints and ramp, and closes the gun."""
        self._buffer.clear()
        self._ramp = None
        self.trigger = 0.0

    def brake(self, now: float) -> None:
        """Starts a controlled stop from the present command; the gun closes."""
        self.release()
        self._ramp = StopRamp(now - self._behind, self.q, self.v, self._joints)

    def fall_behind(self, cycles: int) -> None:
        """Delays the setpoints by cycles that were skipped.

        Drives take one target a cycle: the distance of two cycles in one would double
        the speed. The delay is caught up slowly.
        """
        self._behind += cycles * self._cycle

    def step(self, now: float) -> str | None:
        """Sets the command of a cycle.

        Args:
            now: When the cycle was due, s.

        Returns:
            The limit that the setpoints violate (the arm brakes then), or None.
        """
        self._behind = max(0.0, self._behind - CATCH_UP * self._cycle)
        now -= self._behind
        if self._ramp is not None:
            self._take(self._ramp.sample(now))
            return None
        sample = self._buffer.sample(now + self._ahead)
        if sample is None:
            self._take(Sample(self.q, np.zeros(5), 0.0, 0.0))
            return None
        if sample.lag > 0.0 and sample.is_active:
            # Late, but within the time-out: extrapolate the last setpoint.
            moved = sample.q + sample.v * sample.lag
            sample = Sample(moved, sample.v, sample.trigger, sample.lag)
        problem = self._guard.violation(sample, self.q, self._cycle)
        if problem is not None:
            self.brake(now + self._behind)
            return problem
        self._take(sample)
        self.trigger = self._buffer.trigger(now + TRIGGER_CYCLES * self._cycle)
        self._buffer.forget(now)
        return None

    def _take(self, sample: Sample) -> None:
        self.q, self.v = self._guard.clip(sample.q), sample.v
        self.trigger = sample.trigger
