"""True pose of the gun; simulation only."""

from pydrake.common.value import Value
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import Context, LeafSystem

from painter.planning.arm.kinematics import NQ, ArmKinematics


class GunPose(LeafSystem):
    """Computes the nozzle's pose from the joints.

    .. pydrake_system::

        name: GunPose
        input_ports:
        - state
        output_ports:
        - X_WG

    Ports:
        state: (10,) q, v; rad, rad/s.
        X_WG: RigidTransform, nozzle frame G in W.
    """

    def __init__(self, *, kinematics: ArmKinematics) -> None:
        """Creates the system."""
        super().__init__()
        self._kinematics = kinematics
        # Inputs.
        self._state_port = self.DeclareVectorInputPort("state", 2 * NQ)
        # Outputs.
        self.DeclareAbstractOutputPort(
            "X_WG", lambda: Value(RigidTransform()), self._CalcPose
        )

    def _CalcPose(self, context: Context, output: Value) -> None:
        q = self._state_port.Eval(context)[:NQ]
        R_WG, p_WG = self._kinematics.gun_poses(q[None])
        output.set_value(RigidTransform(RotationMatrix(R_WG[0]), p_WG[0]))
