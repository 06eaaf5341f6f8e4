"""The robot's depth camera on the station's ports."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from pydrake.common.value import Value
from pydrake.systems.framework import Context, EventStatus, State
from pydrake.systems.sensors import ImageDepth16U, ImageRgba8U

from painter.camera.frames import CameraFrame
from painter.camera.reader import CameraHealth, Reading
from painter.systems.value_system import ValueSystem
from painter.systems.values import CameraStatus
from perception.ground import FrozenValue


@dataclass(frozen=True, eq=False)
class CameraPicture(FrozenValue):
    """The last picture and the state of the camera.

    Attributes:
        frame: From the driver; None before the first.
        time: When it was taken, by the diagram's clock, s; -1 = none yet.
        health: Of the camera.
    """

    frame: CameraFrame | None = None
    time: float = -1.0
    health: CameraHealth = field(default_factory=CameraHealth)


class RealsenseCamera(ValueSystem):
    """Depth camera of the robot; hardware only.

    .. pydrake_system::

        name: RealsenseCamera
        input_ports: []
        output_ports:
        - depth_image
        - color_image
        - image_time
        - status

    Ports:
        depth_image: ImageDepth16U, mm, 0 = no return; the last picture, all 0 before
            the first.
        color_image: ImageRgba8U, the last one; black if there is none.
        image_time: (1,) s, when the depth picture was taken, by the diagram's clock; -1
            before the first.
        status: CameraStatus; names the camera's fault.

    State is one CameraPicture, replaced every `period` s, first at t = 0, with the
    newest of the reading thread. A picture's age by this computer's clock gives its
    time by the diagram's: both run at the same rate.
    """

    def __init__(
        self,
        *,
        read: Callable[[], Reading],
        width: int,
        height: int,
        color_width: int,
        color_height: int,
        period: float,
        diagram_time: Callable[[float], float] | None = None,
    ) -> None:
        """Creates the system.

        Args:
            read: Returns the newest reading without waiting; `CameraReader.read`.
            width: Of depth pictures, px.
            height: Of depth pictures, px.
            color_width: Of colour pictures on the port, px; others are dropped.
            color_height: Of colour pictures on the port, px.
            period: Time between checks for a new picture, s.
            diagram_time: Maps this computer's clock, s, to the diagram's, s; None takes
                the diagram to be at the present time.

        Raises:
            ValueError: `period` is not a positive number.
        """
        super().__init__()
        if not (np.isfinite(period) and period > 0.0):
            raise ValueError(f"period must be > 0 s, got {period!r}.")
        self._read = read
        self._diagram_time = diagram_time
        self._color_shape = (color_height, color_width, 3)
        # State.
        self.DeclareValue(CameraPicture())
        # Outputs.
        self.DeclareAbstractOutputPort(
            "depth_image",
            lambda: Value(ImageDepth16U(width, height)),
            self._CalcDepthImage,
            prerequisites_of_calc=self.value_tickets,
        )
        self.DeclareAbstractOutputPort(
            "color_image",
            lambda: Value(ImageRgba8U(color_width, color_height)),
            self._CalcColorImage,
            prerequisites_of_calc=self.value_tickets,
        )
        self.DeclareValueVector("image_time", 1, lambda now: [now.time])
        self.DeclareValueOutput("status", lambda now: camera_status(now.health))
        # Events.
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._UpdatePicture)

    def _CalcDepthImage(self, context: Context, output: Value) -> None:
        frame = self.GetValue(context).frame
        data = output.get_mutable_value().mutable_data
        data[:, :, 0] = 0 if frame is None else frame.depth_mm

    def _CalcColorImage(self, context: Context, output: Value) -> None:
        frame = self.GetValue(context).frame
        data = output.get_mutable_value().mutable_data
        data[:, :, 3] = 255
        color = None if frame is None else frame.color
        is_shown = color is not None and color.shape == self._color_shape
        data[:, :, :3] = color if is_shown else 0

    def _UpdatePicture(self, context: Context, state: State) -> EventStatus:
        last: CameraPicture = self.GetValue(context)
        reading = self._read()
        if reading.frame is last.frame and reading.health == last.health:
            return EventStatus.DidNothing()
        picture = last.replace(health=reading.health)
        if reading.frame is not None and reading.frame is not last.frame:
            now = context.get_time()
            if self._diagram_time is None:
                taken = now - (time.monotonic() - reading.taken)
            else:
                taken = self._diagram_time(reading.taken)
            # A picture from before the diagram's start is not of this run; one from
            # after its present time is taken at the next check.
            if 0.0 <= taken <= now and taken > last.time:
                picture = picture.replace(frame=reading.frame, time=taken)
        return self.SetValue(state, picture)


def camera_status(health: CameraHealth) -> CameraStatus:
    """Returns the camera's health as the station reports it."""
    return CameraStatus(
        state=health.state.value,
        problem=health.problem,
        pictures=health.pictures,
        dropped=health.repeated + health.late,
    )
