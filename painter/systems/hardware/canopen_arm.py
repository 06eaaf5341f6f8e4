"""The robot's arm and gun on the station's ports; hardware only."""

from dataclasses import dataclass

import numpy as np
from pydrake.common.value import Value
from pydrake.systems.framework import Context, EventStatus, State

from painter.canopen.master.feedback import BusState, Feedback
from painter.canopen.master.setpoints import Setpoint
from painter.canopen.process.robot_clock import Bus, RobotClock
from painter.errors import BusError
from painter.planning.arm.kinematics import NQ
from painter.systems.ports import EvalAs
from painter.systems.value_system import ValueSystem
from painter.systems.values import ArmStatus, CameraStatus, DriveStatus, Fault
from perception.ground import FloatArray, FrozenValue

# Age up to which samples are read: the diagram's delay and a few cycles, s.
_HISTORY = 2.0


@dataclass(frozen=True, eq=False)
class ArmReading(FrozenValue):
    """The last reading of the bus.

    Attributes:
        state: (10,) q, v as measured at the diagram's time; rad, rad/s.
        status: Of the drives now.
    """

    state: FloatArray
    status: ArmStatus


class CanopenArm(ValueSystem):
    """Sends setpoints to the bus and reads its measurements.

    .. pydrake_system::

        name: CanopenArm
        input_ports:
        - desired_state
        - trigger
        - camera_status
        output_ports:
        - state_estimated
        - status

    Ports:
        desired_state: (10,) q, v; rad, rad/s.
        trigger: (1,) 0 to 1 of the nominal flow.
        camera_status: CameraStatus; a camera fault stops the arm. May be unconnected.
        state_estimated: (10,) measured q, v at the diagram's time; rad, rad/s.
        status: ArmStatus; a stop of the bus comes before drive faults.

    State is one ArmReading, replaced every `period` s. Setpoints are sent at the same
    times, stamped with their time of execution. Nothing here waits for the bus.
    """

    def __init__(
        self,
        *,
        bus: Bus,
        clock: RobotClock,
        period: float = 0.005,
        gun_off: bool = False,
    ) -> None:
        """Creates the system.

        Args:
            bus: With its drives enabled.
            clock: The diagram's time on the bus.
            period: Time between setpoints, s; the bus's cycle.
            gun_off: Whether the gun stays closed, whatever the `trigger`.

        Raises:
            BusError: The bus has ended, or its drives are not enabled.
        """
        super().__init__()
        report = bus.report()
        if report is None or report.feedback.bus_state != BusState.ENABLED:
            raise BusError(
                "the drives are not enabled; bring them up first.", code="PNT-CYCLE-009"
            )
        self._bus = bus
        self._clock = clock
        self._gun_off = gun_off
        feedback = report.feedback
        first = ArmReading(
            np.concatenate([feedback.q, np.zeros(NQ)]), arm_status(feedback)
        )
        # Inputs.
        self._desired_port = self.DeclareVectorInputPort("desired_state", 2 * NQ)
        self._trigger_port = self.DeclareVectorInputPort("trigger", 1)
        self._camera_port = self.DeclareAbstractInputPort(
            "camera_status", Value(CameraStatus())
        )
        # State.
        self.DeclareValue(first)
        # Outputs.
        self.DeclareValueVector("state_estimated", 2 * NQ, lambda now: now.state)
        self.DeclareValueOutput("status", lambda now: now.status)
        # Events.
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._UpdateFromBus)
        self.DeclarePeriodicPublishEvent(period, 0.0, self._PublishSetpoint)

    def _UpdateFromBus(self, context: Context, state: State) -> EventStatus:
        last: ArmReading = self.GetValue(context)
        try:
            report = self._bus.report()
        except BusError as error:
            stopped = Fault(str(error), code=error.code)
            after = last.replace(status=last.status.replace(stopped=stopped))
        else:
            when = self._clock.bus_time(context.get_time())
            samples = self._bus.samples(when - _HISTORY)
            after = last
            if samples.time.size:
                after = after.replace(state=np.concatenate(samples.at(when)))
            if report is not None:
                camera = self._CameraFault(context)
                after = after.replace(status=arm_status(report.feedback, camera))
        return self.SetValue(state, after)

    def _PublishSetpoint(self, context: Context) -> EventStatus:
        if self.GetValue(context).status.stopped:
            return EventStatus.DidNothing()
        desired = self._desired_port.Eval(context)
        trigger = float(self._trigger_port.Eval(context)[0])
        point = Setpoint(
            time=self._clock.execution(context.get_time()),
            q=np.array(desired[:NQ]),
            v=np.array(desired[NQ:]),
            trigger=0.0 if self._gun_off else trigger,
        )
        try:
            camera = self._CameraFault(context)
            if camera is None:
                self._bus.push([point])
            else:
                self._bus.stop(camera)
        except BusError:
            # The next update reads the cause, and the brain ends the cycle.
            return EventStatus.DidNothing()
        return EventStatus.Succeeded()

    def _CameraFault(self, context: Context) -> str | None:
        if not self._camera_port.HasValue(context):
            return None
        return EvalAs(self._camera_port, context, CameraStatus).fault


def arm_status(feedback: Feedback, camera_fault: str | None = None) -> ArmStatus:
    """Returns the bus's feedback as the brain sees it.

    Args:
        feedback: Of the master.
        camera_fault: Why the camera cannot be used, or None.
    """
    stopped = None
    if feedback.reason and feedback.reason == camera_fault:
        stopped = Fault(feedback.reason, code="PNT-CYCLE-019")
    elif feedback.reason or feedback.bus_state != BusState.ENABLED:
        cause = feedback.reason or f"the bus is {feedback.bus_state}."
        stopped = Fault(cause, code="PNT-CYCLE-020")
    return ArmStatus(
        drives=tuple(
            DriveStatus(
                state=axis.state,
                fault_code=axis.code,
                following_error=axis.following_error,
            )
            for axis in feedback.axes
        ),
        stopped=stopped,
    )
