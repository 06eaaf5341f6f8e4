"""Settings of the real depth camera; a scenario holds them under `wall_camera`."""

import dataclasses
from collections.abc import Iterator

from perception.settings import Conflict, setting

# Source: librealsense 2.59, rs_advanced_mode_command.h, rs2_rs400_visual_preset.
PRESETS = (
    "custom",
    "default",
    "hand",
    "high_accuracy",
    "high_density",
    "medium_density",
    "remove_ir_pattern",
)
_FILTERS = "bounds and default: librealsense 2.59, options of its processing blocks"


@dataclasses.dataclass(kw_only=True)
class CameraDriverConfig:
    """How librealsense drives the camera; the simulated body reads none of it.

    Filters run in the order that librealsense's documentation of post-processing
    advises: threshold, to disparity, spatial, temporal, back to depth. Decimation stays
    off, because the map needs full images. The spatial and temporal filters are off by
    default: the first rounds steps of a few cm, the second smears while the camera
    moves, and the map averages many images anyway.

    Attributes:
        serial: Serial number of the camera; empty takes the first one found.
        recording: Plays this recording (.bag) instead of a device; empty = the device.
        fps: Frame rate of the camera.
        color: Whether it takes colour images, too.
        preset: Depth preset of librealsense.
        exposure: Exposure time of the depth imagers; 0 leaves it to the camera.
        emitter: Whether the infrared pattern is projected.
        threshold_min: Nearer depth is dropped.
        threshold_max: Farther depth is dropped.
        spatial: Whether the spatial filter runs.
        spatial_magnitude: Number of its passes.
        spatial_alpha: Weight of the pixel itself in it.
        spatial_delta: Disparity step that it keeps.
        temporal: Whether the temporal filter runs.
        temporal_alpha: Weight of the newest image in it.
        temporal_delta: Disparity step that it keeps.
        temporal_persistence: When it fills holes from earlier images, 0 = never.
        latency: Shortest time from the middle of the exposure to the arrival of the
            image; docs/bring-up.md says how to measure it.
        max_age: Images that arrive older than this are dropped and counted.
        silence: After this time without an image the camera counts as missing.
        retries: How often a missing camera is opened again.
        retry_period: Time between two retries.
    """

    serial: str = setting("")
    recording: str = setting("")
    fps: int = setting(30, "Hz", least=1, most=90)
    color: bool = setting(True)
    preset: str = setting("high_accuracy", choices=PRESETS)
    exposure: float = setting(0.0, "s", least=0.0, most=0.2)
    emitter: bool = setting(True)
    threshold_min: float = setting(0.15, "m", least=0.0, most=16.0, source=_FILTERS)
    threshold_max: float = setting(4.0, "m", least=0.0, most=16.0, source=_FILTERS)
    spatial: bool = setting(False)
    spatial_magnitude: int = setting(2, "1", least=1, most=5, source=_FILTERS)
    spatial_alpha: float = setting(0.5, "1", least=0.25, most=1.0, source=_FILTERS)
    spatial_delta: int = setting(20, "1", least=1, most=50, source=_FILTERS)
    temporal: bool = setting(False)
    temporal_alpha: float = setting(0.4, "1", least=0.0, most=1.0, source=_FILTERS)
    temporal_delta: int = setting(20, "1", least=1, most=100, source=_FILTERS)
    temporal_persistence: int = setting(0, "1", least=0, most=8, source=_FILTERS)
    latency: float = setting(0.0, "s", least=0.0, most=1.0)
    max_age: float = setting(0.5, "s", above=0.0, most=1.0)
    silence: float = setting(1.0, "s", above=0.0, most=60.0)
    retries: int = setting(5, "1", least=0, most=1000)
    retry_period: float = setting(1.0, "s", above=0.0, most=60.0)

    def conflicts(self) -> Iterator[Conflict]:
        """Yields values that do not fit together."""
        if self.threshold_min >= self.threshold_max:
            bound = f"< threshold_max, {self.threshold_max!r} m"
            yield "threshold_min", bound, self.threshold_min
