"""Demand positions of a simulated drive, by mode of operation.

Source: CiA 402-2 v4.0.0, clauses of profile position, homing, interpolated position and
cyclic synchronous position mode.
"""

import math
from dataclasses import dataclass

# Homing methods that take the present position as zero.
_HERE = (35, 37)


@dataclass
class Demand:
    """Input of the position loop, counts and counts/s."""

    position: float = 0.0
    velocity: float = 0.0

    def hold(self, position: float) -> None:
        """Demands standstill at a position."""
        self.position, self.velocity = position, 0.0

    def brake(self, deceleration: float, dt: float) -> bool:
        """Ramps down by one step; returns whether it has stopped."""
        step = deceleration * dt
        if abs(self.velocity) <= step:
            self.velocity = 0.0
            return True
        self.velocity -= math.copysign(step, self.velocity)
        self.position += self.velocity * dt
        return False

    def approach(
        self, target: float, speed: float, acceleration: float, dt: float
    ) -> bool:
        """Moves one step on a trapezoidal profile; returns whether it has arrived."""
        distance = target - self.position
        step = acceleration * dt
        if abs(distance) <= max(1.0, step * dt) and abs(self.velocity) <= 2.0 * step:
            self.hold(target)
            return True
        # The velocity whose ramp ends at the target, one step ahead.
        allowed = math.sqrt(2.0 * acceleration * abs(distance)) - step / 2.0
        allowed = min(max(allowed, 0.0), speed, abs(distance) / dt)
        wanted = math.copysign(allowed, distance)
        self.velocity += min(step, max(-step, wanted - self.velocity))
        self.position += self.velocity * dt
        return False


class SyncedTarget:
    """Linear interpolation between the targets of SYNCs (CSP and IP)."""

    def __init__(self) -> None:
        """Creates it without a target."""
        self._start = 0.0
        self._target = 0.0
        self._since = 0.0
        self._period = 0.0

    def reset(self, position: float, now: float) -> None:
        """Holds a position until the next target."""
        self._start = self._target = position
        self._since, self._period = now, 0.0

    def take(
        self, demand: Demand, target: float, *, now: float, period: float, speed: float
    ) -> bool:
        """Takes a target for one period; returns whether the speed limit cuts it."""
        # A SYNC slightly early or late still continues the last segment.
        is_next = 0.5 * self._period < now - self._since < 1.5 * self._period
        start = self._target if is_next else demand.position
        step = target - start
        most = speed * period
        cut = abs(step) > most * 1.01 + 1.0
        if cut:
            step = math.copysign(most, step)
        self._start, self._target = start, start + step
        self._since, self._period = now, period
        return cut

    def follow(self, demand: Demand, now: float) -> None:
        """Sets the demand to the interpolated target."""
        elapsed = now - self._since
        if self._period <= 0.0:
            demand.hold(self._target)
            return
        slope = (self._target - self._start) / self._period
        if elapsed >= 1.5 * self._period:  # The next SYNC is overdue: hold.
            demand.hold(self._target)
            return
        demand.position = self._start + slope * min(elapsed, self._period)
        demand.velocity = slope


@dataclass
class HomingRun:
    """One run of homing, which ends at the home switch.

    Attributes:
        method: 6098h.
        switch: Raw position of the switch, counts.
        is_done: Whether the zero was found.
    """

    method: int
    switch: float
    is_done: bool = False

    def step(
        self, demand: Demand, speed: float, acceleration: float, dt: float
    ) -> None:
        """Moves one step; methods 35 and 37 finish at the present position."""
        if self.method in _HERE or demand.approach(
            self.switch, speed, acceleration, dt
        ):
            self.is_done = True
