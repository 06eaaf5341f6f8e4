"""The joint encoders as the drives read them; simulation only."""

import numpy as np
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from painter.planning.arm.kinematics import NQ


class JointEncoder(LeafSystem):
    """Measures the joints with the resolution of their encoders.

    .. pydrake_system::

        name: JointEncoder
        input_ports:
        - state
        output_ports:
        - state_estimated

    Ports:
        state: (10,) true q, v; rad, rad/s.
        state_estimated: (10,) measured q, v; rad, rad/s. Position is rounded to whole
            encoder counts, velocity to one count per `velocity_window`, over which a
            drive differentiates.
    """

    def __init__(self, *, bits: int, velocity_window: float = 0.01) -> None:
        """Creates the encoders.

        Args:
            bits: Resolution, bits per turn of the joint.
            velocity_window: Time over which a drive differentiates, s.

        Raises:
            ValueError: `bits` is not 1 to 32 or the window is not positive.
        """
        super().__init__()
        if not 1 <= bits <= 32:
            raise ValueError(f"bits must be 1 to 32, got {bits!r}.")
        if not velocity_window > 0.0:
            raise ValueError(f"velocity_window must be > 0 s, got {velocity_window!r}.")
        count = 2.0 * np.pi / 2**bits
        self._step = np.repeat([count, count / velocity_window], NQ)
        # Inputs.
        self._state_port = self.DeclareVectorInputPort("state", 2 * NQ)
        # Outputs.
        self.DeclareVectorOutputPort(
            "state_estimated",
            2 * NQ,
            self._CalcEstimate,
            prerequisites_of_calc={self._state_port.ticket()},
        )

    def _CalcEstimate(self, context: Context, output: BasicVector) -> None:
        state = self._state_port.Eval(context)
        output.SetFromVector(np.round(state / self._step) * self._step)
