"""State of the simulated drives, with injected faults; simulation only."""

from collections.abc import Sequence

import numpy as np
from pydrake.common.value import Value
from pydrake.systems.framework import Context, LeafSystem

from painter.planning.arm.kinematics import NQ
from painter.systems.values import ArmStatus, DriveStatus


class SimulatedDrives(LeafSystem):
    """Reports the drives' states: operational, unless a fault is injected.

    .. pydrake_system::

        name: SimulatedDrives
        input_ports:
        - desired_state
        - state_estimated
        output_ports:
        - status

    Ports:
        desired_state: (10,) q, v; rad, rad/s.
        state_estimated: (10,) q, v; rad, rad/s.
        status: ArmStatus.
    """

    def __init__(self, *, faults: Sequence[tuple[float, int, int]] = ()) -> None:
        """Creates the drives.

        Args:
            faults: (time s, joint 1-5, code) of each fault to inject; faults last.
        """
        super().__init__()
        self._faults = tuple(faults)
        # Inputs.
        self._desired_port = self.DeclareVectorInputPort("desired_state", 2 * NQ)
        self._state_port = self.DeclareVectorInputPort("state_estimated", 2 * NQ)
        # Outputs.
        self.DeclareAbstractOutputPort(
            "status", lambda: Value(ArmStatus()), self._CalcStatus
        )

    def _CalcStatus(self, context: Context, output: Value) -> None:
        error = self._desired_port.Eval(context) - self._state_port.Eval(context)
        codes = np.zeros(NQ, dtype=int)
        for time, joint, code in self._faults:
            if context.get_time() >= time:
                codes[joint - 1] = code
        output.set_value(
            ArmStatus(
                drives=tuple(
                    DriveStatus(
                        state="FAULT" if code else "OPERATION ENABLED",
                        fault_code=int(code),
                        following_error=float(following),
                    )
                    for code, following in zip(codes, error[:NQ], strict=True)
                )
            )
        )
