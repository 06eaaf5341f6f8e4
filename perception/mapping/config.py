"""Settings of the mapper: every field with its default, unit and bound."""

import dataclasses
import math

from perception.ground import check_positive


@dataclasses.dataclass(kw_only=True)
class PoseGraphConfig:
    """How frames become keyframes, and keyframes a pose graph.

    The defaults are those of the arm's own scan: its poses are good, the wall's planes
    correct them, and links between keyframes would cost ten times as much.

    The first block of sigmas is what is known before anything was measured: how far the
    arm's poses may be off. The second is what measurements are good for at best, since
    errors that frames share (the sensor's ripple, calibration) do not average out.

    Attributes:
        keyframe_distance: A frame becomes a keyframe when the camera moved so far, m.
        keyframe_angle_deg: Or turned so far.
        keyframe_coverage: Or when the last keyframe did not see this share of it.
        arm_sigma: Standard deviation of the arm's position, m, frame by frame.
        arm_sigma_deg: The same in rotation.
        mount_sigma: Of the camera's mount, m, the same for all frames.
        mount_sigma_deg: The same in rotation.
        base_sigma: Of a step of the base between two keyframes, m; steps are rare.
        base_sigma_deg: The same in rotation.
        plane_sigma: Floor of a plane's distance, m.
        plane_sigma_deg: Floor of its tilt.
        link_sigma: Floor of a link between two keyframes, m.
        link_sigma_deg: The same in rotation.
        pixel_sigma: Of a feature's place in the picture, px.
        plane_threshold: Points this close belong to a plane at 0.7 m, m; grows with the
            square of the range.
        plane_share: Planes with a smaller share of the points are left out.
        features: Corners looked for in a keyframe.
        min_inliers: A link by appearance has so many matches at least.
        max_links: Older keyframes that a new one is registered to, at most; 0 = none,
            so that planes alone correct the arm.
        observed_ratio: A direction is observed if links and planes cut its standard
            deviation to this share of the arm's.
        optimize_every: Keyframes between optimisations while frames come in.
        max_range: Farthest depth used, m.
        mount_limit_deg: A camera whose mount is found to be tilted by more is to be
            calibrated anew; the map is right all the same.
        refuse_distance: A map that is corrected while the arm scans is fused again if
            the correction moves the surface farther than this, m, root mean square.
    """

    keyframe_distance: float = 0.20
    keyframe_angle_deg: float = 6.0
    keyframe_coverage: float = 0.25
    arm_sigma: float = 0.001
    arm_sigma_deg: float = 0.05
    mount_sigma: float = 0.005
    mount_sigma_deg: float = 0.5
    base_sigma: float = 0.0001
    base_sigma_deg: float = 0.003
    plane_sigma: float = 0.0003
    plane_sigma_deg: float = 0.02
    link_sigma: float = 0.0002
    link_sigma_deg: float = 0.01
    pixel_sigma: float = 0.7
    plane_threshold: float = 0.006
    plane_share: float = 0.08
    features: int = 500
    min_inliers: int = 25
    max_links: int = 0
    observed_ratio: float = 0.1
    optimize_every: int = 5
    max_range: float = 3.0
    mount_limit_deg: float = 0.1
    refuse_distance: float = 0.001

    def validate(self) -> None:
        """Raises ValueError for a value out of bounds."""
        numbers = dataclasses.asdict(self)
        if not 0 <= numbers.pop("max_links") < math.inf:
            raise ValueError(f"mapping.max_links must be >= 0, got {self.max_links!r}.")
        check_positive("mapping", **numbers)
        for name in ("keyframe_coverage", "plane_share", "observed_ratio"):
            if getattr(self, name) >= 1.0:
                raise ValueError(
                    f"mapping.{name} must be < 1, got {getattr(self, name)!r}."
                )


@dataclasses.dataclass(kw_only=True)
class MapperConfig(PoseGraphConfig):
    """How a sequence becomes poses and one surface.

    Attributes:
        cell: Edge of a voxel in the map, m.
        layer: Its height along the main plane's normal, m.
        stride: Every so many-th pixel and row is fused.
        keyframe_distance: As in `PoseGraphConfig`; nearer, so that a camera without
            poses is followed.
        max_links: As in `PoseGraphConfig`.
        working_set: Keyframes in memory and solved for while frames come, at most.
    """

    keyframe_distance: float = 0.10
    max_links: int = 5
    cell: float = 0.005
    layer: float = 0.015
    stride: int = 3
    working_set: int = 60
