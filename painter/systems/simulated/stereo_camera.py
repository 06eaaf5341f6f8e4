"""Simulated D435: takes pictures through the stereo model at its own rate."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from pydrake.common.value import Value
from pydrake.systems.framework import (
    Context,
    EventStatus,
    State,
)
from pydrake.systems.sensors import CameraInfo, ImageDepth16U, ImageDepth32F

from painter.systems.ports import EvalAs
from painter.systems.value_system import ValueSystem
from perception.config import StereoConfig
from perception.depth_camera.depth import CameraIntrinsics
from perception.depth_camera.stereo import StereoModel
from perception.ground import FrozenValue

# Time that paint mist hangs before the lens after the gun closes, s (assumption).
MIST_TIME = 2.0


def render_camera_info(intrinsics: CameraIntrinsics) -> CameraInfo:
    """Returns the Drake camera that renders pictures with these intrinsics.

    Drake's renderers count the principal point from the picture's corner: half a pixel
    more than from the first pixel's centre. A test measures it on a rendering.

    Args:
        intrinsics: Of the camera; (0, 0) is the centre of the upper left pixel.
    """
    return CameraInfo(
        width=intrinsics.width,
        height=intrinsics.height,
        focal_x=intrinsics.fx,
        focal_y=intrinsics.fy,
        center_x=intrinsics.cx + 0.5,
        center_y=intrinsics.cy + 0.5,
    )


@dataclass(frozen=True, eq=False)
class DepthPicture(FrozenValue):
    """The last picture taken.

    Attributes:
        depth_mm: (H, W) uint16, mm, 0 = no return.
        time: When it was taken, s; -1 = none yet.
        number: Pictures taken so far.
        spray_time: When the gun last sprayed, s.
    """

    depth_mm: npt.NDArray[np.uint16]
    time: float = -1.0
    number: int = 0
    spray_time: float = -math.inf


class StereoCamera(ValueSystem):
    """Depth camera of the simulated station; simulation only.

    .. pydrake_system::

        name: StereoCamera
        input_ports:
        - ideal_depth
        - ideal_depth_with_glass
        - gun_trigger
        output_ports:
        - depth_image
        - image_time

    Ports:
        ideal_depth: ImageDepth32F, m, without panes of glass; 0 = too near, inf = too
            far.
        ideal_depth_with_glass: The same with the panes as solid bodies.
        gun_trigger: (1,); while the gun sprays and MIST_TIME after, the lens cover is
            shut and no picture is taken. May be left unconnected: always open.
        depth_image: ImageDepth16U, mm, 0 = no return; the last picture, all 0 before
            the first.
        image_time: (1,) s, when it was taken; -1 before the first.

    State is one DepthPicture, replaced every 1 / `rate` s, first at t = 0. Noise is
    drawn from the seed and the picture's number: a replay repeats it.
    """

    def __init__(self, *, config: StereoConfig, seed: int, rate: float) -> None:
        """Creates the system.

        Args:
            config: Geometry and errors of the camera.
            seed: Seed of the fixed patterns and of each picture's noise.
            rate: Pictures a second.

        Raises:
            ValueError: A setting is out of bounds or `rate` not a positive number.
        """
        super().__init__()
        if not (np.isfinite(rate) and rate > 0.0):
            raise ValueError(f"rate must be > 0 Hz, got {rate!r}.")
        self._model = StereoModel(config, seed)
        self._seed = seed
        # Inputs.
        image = Value(ImageDepth32F(config.width, config.height))
        self._depth_port = self.DeclareAbstractInputPort("ideal_depth", image)
        self._glass_port = self.DeclareAbstractInputPort(
            "ideal_depth_with_glass", image
        )
        self._trigger_port = self.DeclareVectorInputPort("gun_trigger", 1)
        # State.
        blank = np.zeros((config.height, config.width), dtype=np.uint16)
        self.DeclareValue(DepthPicture(blank))
        # Outputs.
        self.DeclareAbstractOutputPort(
            "depth_image",
            lambda: Value(ImageDepth16U(config.width, config.height)),
            self._CalcDepthImage,
            prerequisites_of_calc=self.value_tickets,
        )
        self.DeclareValueVector("image_time", 1, lambda now: [now.time])
        # Events.
        self.DeclarePeriodicUnrestrictedUpdateEvent(
            1.0 / rate, 0.0, self._UpdatePicture
        )

    def _CalcDepthImage(self, context: Context, output: Value) -> None:
        image = output.get_mutable_value()
        image.mutable_data[:, :, 0] = self.GetValue(context).depth_mm

    def _UpdatePicture(self, context: Context, state: State) -> EventStatus:
        last: DepthPicture = self.GetValue(context)
        now = context.get_time()
        if self._trigger_port.HasValue(context) and self._trigger_port.Eval(context)[0]:
            return self.SetValue(state, last.replace(spray_time=now))
        if now < last.spray_time + MIST_TIME:
            return EventStatus.DidNothing()
        number = last.number + 1
        depth, depth_with_glass = (
            EvalAs(port, context, ImageDepth32F).data[:, :, 0]
            for port in (self._depth_port, self._glass_port)
        )
        picture = last.replace(
            depth_mm=self._model.measure(
                depth, depth_with_glass, np.random.default_rng([self._seed, number])
            ),
            time=now,
            number=number,
        )
        return self.SetValue(state, picture)
