"""librealsense: a device on USB, or a recording.

Both, and the software device, are librealsense devices. The same code opens, configures
and filters all three, so that tests without a camera run the robot's code.
"""

import logging
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pyrealsense2 as rs

from painter.camera.config import CameraDriverConfig
from painter.camera.frames import CameraError, CameraFrame, ColorArray
from perception.depth_camera.depth import CameraIntrinsics
from perception.depth_camera.pinhole import PinholeMap

_LOGGER = logging.getLogger(__name__)
_QUEUE = 4
_TRY_TIME = 25.0  # s


def open_device(config: CameraDriverConfig, wanted: CameraIntrinsics) -> "RealSense":
    """Opens a camera on USB.

    Raises:
        CameraError: None is connected, or none with the serial number.
    """
    devices = list(rs.context().query_devices())
    serials = [device.get_info(rs.camera_info.serial_number) for device in devices]
    if not devices:
        raise CameraError(
            "camera: no RealSense device is connected.", code="PNT-CAMERA-005"
        )
    if config.serial and config.serial not in serials:
        raise CameraError(
            f"camera: serial number {config.serial} is not connected; "
            f"connected are {', '.join(serials)}.",
            code="PNT-CAMERA-006",
        )
    number = serials.index(config.serial) if config.serial else 0
    return RealSense(devices[number], config, wanted, name=serials[number])


def open_recording(config: CameraDriverConfig, wanted: CameraIntrinsics) -> "RealSense":
    """Opens a recording, played in real time.

    Raises:
        CameraError: It is missing, damaged, or has no depth.
    """
    if not Path(config.recording).is_file():
        raise CameraError(
            f"camera: {config.recording}: no such recording.", code="PNT-CAMERA-007"
        )
    _try_recording(config.recording)
    try:
        device = rs.context().load_device(config.recording)
    except RuntimeError as error:
        raise CameraError(
            f"camera: {config.recording}: {_line(error)}", code="PNT-CAMERA-008"
        ) from error
    return RealSense(device, config, wanted, name=config.recording)


class RealSense:
    """An open librealsense device; a `Camera`."""

    def __init__(
        self, device: Any, config: CameraDriverConfig, wanted: CameraIntrinsics, *,
        name: str,
    ) -> None:  # fmt: skip
        """Configures the device and starts its streams.

        Args:
            device: A librealsense device.
            config: Preset, exposure, filters.
            wanted: Intrinsics that pictures are mapped to.
            name: Of the device, in messages.

        Raises:
            CameraError: It has no depth stream of this size, or rejects a setting.
        """
        self._device = device
        self._name = name
        self._config = config
        self._filters = make_filters(config)
        self._open: list[Any] = []
        self._color: ColorArray | None = None
        self._colors = rs.frame_queue(_QUEUE, True)
        self._depths = rs.frame_queue(_QUEUE, True)
        try:
            sensor, profile = self._find(rs.stream.depth, rs.format.z16, wanted)
            apply_options(sensor, config)
            self._map = PinholeMap(_intrinsics(name, profile), wanted)
            self._unit_mm = 1e3 * sensor.get_option(rs.option.depth_units)
            self._start(sensor, profile, self._depths)
            if config.color:
                found = self._find_color(wanted)
                if found is None:
                    _LOGGER.info("camera %s has no colour stream of this size.", name)
                else:
                    self._start(*found, self._colors)
        except RuntimeError as error:
            self.close()
            raise CameraError(
                f"camera {name}: {_line(error)}", code="PNT-CAMERA-009"
            ) from error
        except CameraError:
            self.close()
            raise

    def wait(self, timeout: float) -> CameraFrame | None:
        """Returns the next picture; None if none came within `timeout` s.

        Raises:
            CameraError: The camera is lost.
        """
        try:
            there, frame = self._depths.try_wait_for_frame(max(1, int(1e3 * timeout)))
            if not there:
                if self._device.is_playback() or self._device.is_connected():
                    return None
                raise CameraError(
                    f"camera {self._name}: was unplugged.", code="PNT-CAMERA-010"
                )
            for step in self._filters:
                frame = step.process(frame)
            while (color := self._colors.poll_for_frame()).is_frame():
                self._color = np.array(color.get_data())
            depth = np.array(frame.get_data())
        except RuntimeError as error:
            raise CameraError(
                f"camera {self._name}: {_line(error)}", code="PNT-CAMERA-011"
            ) from error
        if self._unit_mm != 1.0:
            scaled = np.rint(depth * self._unit_mm)
            depth = np.where(scaled > 65535, 0, scaled).astype(np.uint16)
        return CameraFrame(
            depth_mm=self._map.apply(depth),
            color=self._color,
            time=1e-3 * frame.get_timestamp(),
            number=frame.get_frame_number(),
        )

    def close(self) -> None:
        """Stops the streams and releases the device."""
        while self._open:
            sensor = self._open.pop()
            with suppress(RuntimeError):  # An unplugged device has stopped.
                sensor.stop()
            with suppress(RuntimeError):
                sensor.close()

    def _start(self, sensor: Any, profile: Any, queue: Any) -> None:
        sensor.open(profile)
        self._open.append(sensor)
        sensor.start(queue)

    def _find(
        self, stream: Any, form: Any, wanted: CameraIntrinsics
    ) -> tuple[Any, Any]:
        """Returns the sensor and profile of a stream of this size and rate."""
        offers = []
        for sensor in self._device.query_sensors():
            for profile in sensor.get_stream_profiles():
                if profile.stream_type() != stream or profile.format() != form:
                    continue
                video = profile.as_video_stream_profile()
                offers.append((video.width(), video.height(), video.fps()))
                if offers[-1] == (wanted.width, wanted.height, self._config.fps):
                    return sensor, profile
        shown = ", ".join(sorted({f"{w} x {h} at {fps} Hz" for w, h, fps in offers}))
        raise CameraError(
            f"camera {self._name}: no {stream.name} stream of {wanted.width} x "
            f"{wanted.height} at {self._config.fps} Hz; it has {shown or 'none'}.",
            code="PNT-CAMERA-012",
        )

    def _find_color(self, wanted: CameraIntrinsics) -> tuple[Any, Any] | None:
        try:
            return self._find(rs.stream.color, rs.format.rgb8, wanted)
        except CameraError:
            return None


def make_filters(config: CameraDriverConfig) -> list[Any]:
    """Returns librealsense's filters in their order of execution."""
    filters = [rs.threshold_filter(config.threshold_min, config.threshold_max)]
    middle = []
    if config.spatial:
        middle.append(
            rs.spatial_filter(
                config.spatial_alpha, config.spatial_delta, config.spatial_magnitude, 0
            )
        )
    if config.temporal:
        middle.append(
            rs.temporal_filter(
                config.temporal_alpha,
                config.temporal_delta,
                config.temporal_persistence,
            )
        )
    if middle:
        filters += [
            rs.disparity_transform(True), *middle, rs.disparity_transform(False)
        ]  # fmt: skip
    return filters


def apply_options(sensor: Any, config: CameraDriverConfig) -> None:
    """Sets preset, exposure and emitter, reads back and compares.

    The preset comes first, since it changes the others. Options that a sensor lacks,
    such as that of a recording, are logged.

    Raises:
        CameraError: A value is out of range or reads back differently; names the option
            and the values.
    """
    preset = int(getattr(rs.rs400_visual_preset, config.preset))
    values = [(rs.option.visual_preset, preset)]
    if config.exposure > 0.0:
        values.append((rs.option.enable_auto_exposure, 0))
        values.append((rs.option.exposure, round(1e6 * config.exposure)))
    else:
        values.append((rs.option.enable_auto_exposure, 1))
    values.append((rs.option.emitter_enabled, int(config.emitter)))
    for option, value in values:
        if not sensor.supports(option) or sensor.is_option_read_only(option):
            _LOGGER.info("camera: %s cannot be set.", option.name)
            continue
        limits = sensor.get_option_range(option)
        if not limits.min <= value <= limits.max:
            raise CameraError(
                f"camera: {option.name} must be {limits.min:g} to {limits.max:g}, "
                f"got {value}.",
                code="PNT-CAMERA-013",
            )
        sensor.set_option(option, value)
        found = sensor.get_option(option)
        if abs(found - value) > max(limits.step, 0.5):
            raise CameraError(
                f"camera: {option.name} was set to {value} and reads {found:g}.",
                code="PNT-CAMERA-014",
            )


def _try_recording(path: str) -> None:
    """Opens a recording in a separate process: a damaged one may crash librealsense.

    Raises:
        CameraError: It cannot be opened.
    """
    code = (
        "import sys, pyrealsense2 as rs\n"
        "try: rs.context().load_device(sys.argv[1])\n"
        "except RuntimeError as error: sys.exit(str(error))"
    )
    try:
        done = subprocess.run(
            [sys.executable, "-c", code, path],
            capture_output=True,
            timeout=_TRY_TIME,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        raise CameraError(
            f"camera: {path}: librealsense did not open it within {_TRY_TIME:g} s.",
            code="PNT-CAMERA-015",
        ) from error
    if done.returncode != 0:
        words = done.stderr.decode(errors="replace").split()
        reason = " ".join(words) or f"it ended with {done.returncode}"
        raise CameraError(
            f"camera: {path}: librealsense cannot open it: {reason}.",
            code="PNT-CAMERA-016",
        )


def _intrinsics(name: str, profile: Any) -> CameraIntrinsics:
    lens = profile.as_video_stream_profile().get_intrinsics()
    try:
        return CameraIntrinsics.from_librealsense(lens)
    except ValueError as error:
        raise CameraError(f"camera {name}: {error}.", code="PNT-CAMERA-017") from error


def _line(error: Exception) -> str:
    return " ".join(str(error).split())
