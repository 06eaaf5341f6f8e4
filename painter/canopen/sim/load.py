"""Interface of the load that simulated motors move."""

from typing import Protocol

from perception.ground import FloatArray


class Load(Protocol):
    """The arm on the motors; axes in the order of `units.AXES`."""

    def axes(self) -> tuple[FloatArray, FloatArray]:
        """Returns positions, (5,) rad, and speeds, (5,) rad/s, of the axes."""

    def step(self, demand: FloatArray, velocity: FloatArray, dt: float) -> None:
        """Advances by one step.

        Args:
            demand: (5,) positions demanded by the drives, rad.
            velocity: (5,) speeds demanded by the drives, rad/s.
            dt: Duration of the step, s.
        """
