"""A motor with its load under a position loop: second order, with limits."""

from dataclasses import dataclass

# Natural frequency, rad/s, and damping ratio of the closed loop: our choice, of the
# order that servo drives with harmonic gears reach.
_FREQUENCY = 120.0
_DAMPING = 1.0


@dataclass
class Motor:
    """Position and velocity in counts and counts/s.

    Attributes:
        position: Of the axis.
        velocity: Of the axis.
        acceleration_limit: By the torque limit, counts/s².
        friction: Deceleration without power, counts/s².
        is_blocked: Whether an obstacle holds the axis; fault injection.
    """

    position: float = 0.0
    velocity: float = 0.0
    acceleration_limit: float = 1e9
    friction: float = 1e6
    is_blocked: bool = False

    def drive(self, demand: float, demand_velocity: float, dt: float) -> None:
        """Moves one step under power towards a demand.

        Source: PD with velocity feed-forward,
        a = w² (demand - x) + 2 d w (demand velocity - v), integrated semi-implicitly
        with x as it will be at the end of the step.
        """
        if self.is_blocked:
            self.velocity = 0.0
            return
        ahead = self.position + self.velocity * dt  # The demand is for the step's end.
        wanted = _FREQUENCY**2 * (demand - ahead)
        wanted += 2.0 * _DAMPING * _FREQUENCY * (demand_velocity - self.velocity)
        limit = self.acceleration_limit
        self.velocity += min(limit, max(-limit, wanted)) * dt
        self.position += self.velocity * dt

    def coast(self, dt: float, *, brake: bool) -> None:
        """Moves one step without power: the brake holds at once, friction slows."""
        if brake or self.is_blocked:
            self.velocity = 0.0
            return
        loss = min(abs(self.velocity), self.friction * dt)
        self.velocity -= loss if self.velocity > 0.0 else -loss
        self.position += self.velocity * dt


@dataclass
class LoadedMotor(Motor):
    """A motor whose motion is computed by a load; it only stores the demand.

    Attributes:
        demand: Demanded position, counts.
        demand_velocity: Demanded velocity, counts/s.
        is_held: Whether the brake or an obstacle holds the axis at `demand`.
    """

    demand: float = 0.0
    demand_velocity: float = 0.0
    is_held: bool = True

    def drive(self, demand: float, demand_velocity: float, dt: float) -> None:
        """Stores the demand under power."""
        if self.is_blocked:
            self._hold()
            return
        self.demand, self.demand_velocity = demand, demand_velocity
        self.is_held = False

    def coast(self, dt: float, *, brake: bool) -> None:
        """Holds the axis: the brake closes when power is removed."""
        self._hold()

    def _hold(self) -> None:
        if not self.is_held:
            self.demand, self.demand_velocity = self.position, 0.0
            self.is_held = True
