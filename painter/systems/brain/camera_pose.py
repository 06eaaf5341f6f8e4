"""Pose of the depth camera at the time of its picture, from measured joints."""

from dataclasses import dataclass

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import Context, EventStatus, State

from painter.errors import PainterError
from painter.planning.arm.kinematics import NQ, ArmKinematics
from painter.systems.value_system import ValueSystem
from perception.ground import FloatArray, FrozenValue


class ImageTimeError(PainterError):
    """A picture's time lies outside the history of joint positions."""


@dataclass(frozen=True, eq=False)
class JointHistory(FrozenValue):
    """The latest joint positions.

    Attributes:
        time: (n,) s, strictly increasing.
        q: (n, 5) rad.
    """

    time: FloatArray
    q: FloatArray

    @classmethod
    def empty(cls) -> "JointHistory":
        """Makes an empty history."""
        return cls(time=np.zeros(0), q=np.zeros((0, NQ)))

    def append(self, time: float, q: FloatArray, *, length: float) -> "JointHistory":
        """Returns the history with `q` at `time`, s, back to `length` s before it.

        Samples from `time` on are replaced.
        """
        keep = (self.time >= time - length) & (self.time < time)
        return JointHistory(
            time=np.append(self.time[keep], time), q=np.vstack([self.q[keep], q])
        )

    def at(self, time: float) -> FloatArray:
        """Returns the (5,) joint positions at `time`, s, interpolated, rad."""
        return np.array([np.interp(time, self.time, joint) for joint in self.q.T])


class CameraPose(ValueSystem):
    """Gives the pose of the camera at the time of its last picture.

    .. pydrake_system::

        name: CameraPose
        input_ports:
        - state
        - image_time
        output_ports:
        - X_WC

    Ports:
        state: (10,): measured q, v of the arm; rad, rad/s.
        image_time: (1,) s; negative before the first picture.
        X_WC: RigidTransform at `image_time`; before the first picture, now.

    State is one JointHistory, to which q is added every `period` s from t = 0 on. Both
    bodies use this system: the pose comes from measured joints alone.
    """

    def __init__(
        self,
        *,
        kinematics: ArmKinematics,
        period: float = 0.01,
        length: float = 1.0,
        X_NC: RigidTransform | None = None,
    ) -> None:
        """Creates the system.

        Args:
            kinematics: Of the arm, with the camera's modelled mount.
            period: Time between samples of q, s.
            length: Age up to which samples are kept, s.
            X_NC: Calibrated camera frame C in the nominal one N of the model; None =
                as modelled.

        Raises:
            ValueError: `period` is not positive, or `length` shorter than it.
        """
        super().__init__()
        if not 0.0 < period <= length < np.inf:
            raise ValueError(
                "period must be > 0 s and length at least as long, "
                f"got {period!r} and {length!r}."
            )
        self._kinematics = kinematics
        self._X_NC = RigidTransform() if X_NC is None else X_NC
        self._length = length
        # Inputs.
        self._state_port = self.DeclareVectorInputPort("state", 2 * NQ)
        self._time_port = self.DeclareVectorInputPort("image_time", 1)
        # State.
        self.DeclareValue(JointHistory.empty())
        # Outputs.
        self.DeclareAbstractOutputPort(
            "X_WC",
            lambda: Value(RigidTransform()),
            self._CalcPose,
            prerequisites_of_calc={
                self._state_port.ticket(),
                self._time_port.ticket(),
                self.time_ticket(),
            }
            | self.value_tickets,
        )
        # Events.
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._UpdateHistory)

    def _History(self, context: Context) -> JointHistory:
        """Returns the history including the present sample."""
        history: JointHistory = self.GetValue(context)
        q = self._state_port.Eval(context)[:NQ]
        return history.append(context.get_time(), q, length=self._length)

    def _CalcPose(self, context: Context, output: Value) -> None:
        history = self._History(context)
        now = context.get_time()
        time = self._time_port.Eval(context)[0]
        if time < 0.0:
            time = now
        if not history.time[0] <= time <= now:
            name = self.GetSystemPathname()
            raise ImageTimeError(
                f"{name}: the picture is {now - time:.3f} s old, the oldest joint "
                f"positions {now - history.time[0]:.3f} s.",
                code="PNT-CYCLE-003",
            )
        R_WN, p_WN = self._kinematics.camera_poses(history.at(time)[np.newaxis])
        X_WN = RigidTransform(RotationMatrix(R_WN[0]), p_WN[0])
        output.set_value(X_WN @ self._X_NC)

    def _UpdateHistory(self, context: Context, state: State) -> EventStatus:
        return self.SetValue(state, self._History(context))
