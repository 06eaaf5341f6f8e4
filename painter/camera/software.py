"""librealsense's software device, fed with rendered or recorded pictures."""

import math
import time
from typing import Any

import numpy as np
import pyrealsense2 as rs

from painter.camera.config import CameraDriverConfig
from painter.camera.frames import CameraError, CameraFrame, FrameSource
from painter.camera.realsense import RealSense
from perception.depth_camera.depth import CameraIntrinsics

_DEPTH_UNIT = 0.001


class SoftwareCamera:
    """librealsense's software device, fed from a source; a `Camera`."""

    def __init__(
        self,
        source: FrameSource,
        config: CameraDriverConfig,
        wanted: CameraIntrinsics,
        *,
        baseline: float,
    ) -> None:
        """Creates the device and opens it like one on USB.

        Args:
            source: Source of pictures.
            config: Preset, exposure, filters.
            wanted: Intrinsics of the source's pictures.
            baseline: Of the stereo imagers, m; the filters work in disparity.

        Raises:
            CameraError: The device rejects a setting.
        """
        self._source = source
        self._shape = (wanted.height, wanted.width)
        self._number = 0
        self._device = rs.software_device()
        self._depth = self._device.add_sensor("Stereo Module")
        self._depth_profile = self._depth.add_video_stream(
            _stream(rs.stream.depth, rs.format.z16, 2, wanted, config.fps), True
        )
        self._depth.add_read_only_option(rs.option.depth_units, _DEPTH_UNIT)
        self._depth.add_read_only_option(rs.option.stereo_baseline, 1e3 * baseline)
        for option, most in (
            (rs.option.visual_preset, 6),
            (rs.option.exposure, 200_000),
            (rs.option.enable_auto_exposure, 1),
            (rs.option.emitter_enabled, 2),
        ):
            limits = rs.option_range()
            limits.min, limits.max, limits.step, limits.default = 0, most, 1, 0
            self._depth.add_option(option, limits, True)
        self._rgb = self._device.add_sensor("RGB Camera")
        self._rgb_profile = self._rgb.add_video_stream(
            _stream(rs.stream.color, rs.format.rgb8, 3, wanted, config.fps), True
        )
        self._has_color = config.color
        self._camera = RealSense(self._device, config, wanted, name="software device")

    def wait(self, timeout: float) -> CameraFrame | None:
        """Feeds the next picture of the source to the device and returns its output.

        Raises:
            CameraError: The source is lost, or its picture has another size.
        """
        start = time.monotonic()
        found = self._source.wait_frame(timeout)
        if found is None:
            return None
        depth, color, when = found
        self._number += 1
        if color is not None and self._has_color:
            self._push(self._rgb, self._rgb_profile, color, when)
        self._push(self._depth, self._depth_profile, depth, when)
        return self._camera.wait(max(0.1, timeout - (time.monotonic() - start)))

    def close(self) -> None:
        """Stops the device."""
        self._camera.close()

    def _push(
        self, sensor: Any, profile: Any, pixels: np.ndarray[Any, Any], when: float
    ) -> None:
        if pixels.shape[:2] != self._shape:
            raise CameraError(
                f"camera source: picture must be {self._shape} px (rows, columns), "
                f"got {pixels.shape[:2]}.",
                code="PNT-CAMERA-018",
            )
        frame = rs.software_video_frame()
        frame.pixels = np.ascontiguousarray(pixels)
        frame.bpp = pixels.itemsize * math.prod(pixels.shape[2:])
        frame.stride = frame.bpp * pixels.shape[1]
        frame.timestamp = 1e3 * when
        frame.domain = rs.timestamp_domain.hardware_clock
        frame.frame_number = self._number
        frame.profile = profile.as_video_stream_profile()
        if pixels.ndim == 2:
            frame.depth_units = _DEPTH_UNIT
        sensor.on_video_frame(frame)


def _stream(kind: Any, form: Any, size: int, camera: CameraIntrinsics, fps: int) -> Any:
    stream = rs.video_stream()
    stream.type, stream.fmt, stream.bpp = kind, form, size
    stream.uid, stream.index, stream.fps = int(kind), 0, fps
    stream.width, stream.height = camera.width, camera.height
    lens = rs.intrinsics()
    lens.width, lens.height = camera.width, camera.height
    lens.fx, lens.fy, lens.ppx, lens.ppy = camera.fx, camera.fy, camera.cx, camera.cy
    lens.model, lens.coeffs = rs.distortion.none, [0.0] * 5
    stream.intrinsics = lens
    return stream
