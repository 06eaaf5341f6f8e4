"""Settings of the real depth camera; a scenario holds them under `wall_camera`."""

import dataclasses
import math

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


@dataclasses.dataclass(kw_only=True)
class CameraDriverConfig:
    """How librealsense drives the camera; the simulated body reads nothing of it.

    Filters run in the order that librealsense's documentation of post-processing
    advises: threshold, to disparity, spatial, temporal, back to depth. Decimation stays
    off, because the map wants full pictures. Spatial and temporal filter are off by
    default: the first rounds steps of a few cm, the second smears while the camera
    moves, and the map averages many pictures anyhow.

    Attributes:
        serial: Serial number of the camera; empty takes the first one.
        recording: Plays this recording (.bag) instead of a device; empty does not.
        fps: Pictures a second that the camera takes.
        color: Whether colour pictures are taken too.
        preset: Depth preset, one of `PRESETS`.
        exposure: Of the depth imagers, s; 0 leaves it to the camera.
        emitter: Whether the infrared pattern is projected.
        threshold_min: Nearer depth is dropped, m.
        threshold_max: Farther depth is dropped, m.
        spatial: Whether the spatial filter runs.
        spatial_magnitude: Its passes, 1 to 5.
        spatial_alpha: Its weight of the pixel itself, 0.25 to 1.
        spatial_delta: Disparity step that it keeps, 1 to 50.
        temporal: Whether the temporal filter runs.
        temporal_alpha: Its weight of the newest picture, 0 to 1.
        temporal_delta: Disparity step that it keeps, 1 to 100.
        temporal_persistence: When it fills holes from earlier pictures, 0 (never) to 8.
        latency: Least time from the middle of the exposure to the arrival of a
            picture, s; docs/bring-up.md says how to measure it.
        max_age: Pictures that arrive older than this are dropped and counted, s.
        silence: Without a picture for so long the camera counts as missing, s.
        retries: How often a missing camera is opened again.
        retry_period: Time between these tries, s.
    """

    serial: str = ""
    recording: str = ""
    fps: int = 30
    color: bool = True
    preset: str = "high_accuracy"
    exposure: float = 0.0
    emitter: bool = True
    threshold_min: float = 0.15
    threshold_max: float = 4.0
    spatial: bool = False
    spatial_magnitude: int = 2
    spatial_alpha: float = 0.5
    spatial_delta: int = 20
    temporal: bool = False
    temporal_alpha: float = 0.4
    temporal_delta: int = 20
    temporal_persistence: int = 0
    latency: float = 0.0
    max_age: float = 0.5
    silence: float = 1.0
    retries: int = 5
    retry_period: float = 1.0

    def validate(self) -> None:
        """Raises ValueError for a value out of bounds.

        Source: bounds of the filters: librealsense 2.59, option ranges of its
        processing blocks.
        """
        if self.preset not in PRESETS:
            raise ValueError(
                f"driver.preset must be one of {', '.join(PRESETS)}, "
                f"got {self.preset!r}."
            )
        for name, low, high in (
            ("fps", 1, 90),
            ("exposure", 0.0, 0.2),
            ("threshold_min", 0.0, 16.0),
            ("threshold_max", 0.0, 16.0),
            ("spatial_magnitude", 1, 5),
            ("spatial_alpha", 0.25, 1.0),
            ("spatial_delta", 1, 50),
            ("temporal_alpha", 0.0, 1.0),
            ("temporal_delta", 1, 100),
            ("temporal_persistence", 0, 8),
            ("latency", 0.0, 1.0),
            ("max_age", 0.0, 1.0),
            ("retries", 0, 1000),
        ):
            if not low <= getattr(self, name) <= high:
                raise ValueError(
                    f"driver.{name} must be {low} to {high}, "
                    f"got {getattr(self, name)!r}."
                )
        for name in ("silence", "retry_period", "max_age"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ValueError(
                    f"driver.{name} must be > 0 s, got {getattr(self, name)!r}."
                )
        if not self.threshold_min < self.threshold_max:
            raise ValueError(
                f"driver.threshold_min must be < threshold_max "
                f"{self.threshold_max!r}, got {self.threshold_min!r}."
            )
