"""What the simulated motors move: anything that turns demands into motion."""

from typing import Protocol

from perception.ground import FloatArray


class Load(Protocol):
    """The arm that hangs on the motors; axes in the order of `units.AXES`."""

    def axes(self) -> tuple[FloatArray, FloatArray]:
        """Returns where the axes are, (5,) rad, and how fast they turn, (5,) rad/s."""

    def step(self, demand: FloatArray, velocity: FloatArray, dt: float) -> None:
        """Moves on.

        Args:
            demand: (5,) where the drives' position loops want the axes, rad.
            velocity: (5,) how fast, rad/s.
            dt: Time, s.
        """
