"""Settings of the mapper; see `perception.settings`."""

import dataclasses

from perception.settings import setting


@dataclasses.dataclass(kw_only=True)
class PoseGraphConfig:
    """How frames become keyframes, and keyframes a pose graph.

    The defaults are those of the arm's own scan: its poses are good, the wall's planes
    correct them, and constraints between keyframes would cost ten times as much.

    The sigmas of arm, mount and base are what is known beforehand: how far the arm's
    poses may be off. Those of plane, link and pixel are the best that measurements can
    do, because errors that frames share (the sensor's ripple, calibration) do not
    average out.

    Attributes:
        keyframe_distance: A frame becomes a keyframe when the camera has moved by this.
        keyframe_angle_deg: Or has turned by this.
        keyframe_coverage: Or when the last keyframe did not see this share of it.
        arm_sigma: Standard deviation of the arm's position, frame by frame.
        arm_sigma_deg: The same in rotation.
        mount_sigma: Standard deviation of the camera's mount, the same for all frames.
        mount_sigma_deg: The same in rotation.
        base_sigma: Standard deviation of a step of the base between two keyframes;
            such steps are rare.
        base_sigma_deg: The same in rotation.
        plane_sigma: Floor of the standard deviation of a plane's distance.
        plane_sigma_deg: Floor of that of its tilt.
        link_sigma: Floor of the standard deviation of a pose constraint.
        link_sigma_deg: The same in rotation.
        pixel_sigma: Standard deviation of a feature's position in the image.
        plane_threshold: Inlier distance of a plane at a range of 0.7 m; grows with the
            range squared.
        plane_share: Leaves out planes with a smaller share of the points.
        features: Corners extracted from a keyframe.
        min_inliers: Least number of matches of a pose constraint by appearance.
        max_links: Most older keyframes that a new one is registered to; 0 = none, so
            that planes alone correct the arm.
        observed_ratio: A direction is observed if constraints and planes cut its
            standard deviation to this share of the arm's.
        max_range: Farthest depth used.
        mount_limit_deg: A camera whose mount turns out to be tilted by more needs
            calibration; the map is right all the same.
        refuse_distance: While the arm scans, a corrected map is fused again if the
            correction moves the surface by more than this, root mean square.
    """

    keyframe_distance: float = setting(0.20, "m", above=0.0, most=5.0)
    keyframe_angle_deg: float = setting(6.0, "deg", above=0.0, most=90.0)
    keyframe_coverage: float = setting(0.25, "1", above=0.0, below=1.0)
    arm_sigma: float = setting(0.001, "m", above=0.0, most=1.0)
    arm_sigma_deg: float = setting(0.05, "deg", above=0.0, most=45.0)
    mount_sigma: float = setting(0.005, "m", above=0.0, most=1.0)
    mount_sigma_deg: float = setting(0.5, "deg", above=0.0, most=45.0)
    base_sigma: float = setting(0.0001, "m", above=0.0, most=1.0)
    base_sigma_deg: float = setting(0.003, "deg", above=0.0, most=45.0)
    plane_sigma: float = setting(0.0003, "m", above=0.0, most=0.1)
    plane_sigma_deg: float = setting(0.02, "deg", above=0.0, most=10.0)
    link_sigma: float = setting(0.0002, "m", above=0.0, most=0.1)
    link_sigma_deg: float = setting(0.01, "deg", above=0.0, most=10.0)
    pixel_sigma: float = setting(0.7, "px", above=0.0, most=10.0)
    plane_threshold: float = setting(0.006, "m", above=0.0, most=0.1)
    plane_share: float = setting(0.08, "1", above=0.0, below=1.0)
    features: int = setting(500, "1", least=10, most=10_000)
    min_inliers: int = setting(25, "1", least=4, most=1000)
    max_links: int = setting(0, "1", least=0, most=100)
    observed_ratio: float = setting(0.1, "1", above=0.0, below=1.0)
    max_range: float = setting(3.0, "m", above=0.0, most=65.535)
    mount_limit_deg: float = setting(0.1, "deg", above=0.0, most=10.0)
    refuse_distance: float = setting(0.001, "m", above=0.0, most=1.0)


@dataclasses.dataclass(kw_only=True)
class MapperConfig(PoseGraphConfig):
    """How a sequence becomes poses and one surface.

    Keyframes are closer together than on the arm and registered to each other, so that
    a camera without poses is tracked.

    Attributes:
        optimize_every: Keyframes between two optimisations while frames come in.
        cell: Edge of a voxel in the map.
        layer: Height of a voxel along the main plane's normal.
        stride: Fuses every n-th pixel of every n-th row.
        working_set: Most keyframes in memory, and solved for, while frames come in.
    """

    keyframe_distance: float = setting(0.10, "m", above=0.0, most=5.0)
    max_links: int = setting(5, "1", least=0, most=100)
    optimize_every: int = setting(5, "1", least=1, most=1000)
    cell: float = setting(0.005, "m", above=0.0, most=1.0)
    layer: float = setting(0.015, "m", above=0.0, most=1.0)
    stride: int = setting(3, "px", least=1, most=16)
    working_set: int = setting(60, "1", least=2, most=100_000)
