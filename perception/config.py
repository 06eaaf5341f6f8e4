"""Settings of perception: every field with its default, unit and bound.

Plain mutable dataclasses, because Drake's `yaml_load_typed` fills them field by field;
`validate()` is called when a scenario is loaded and by the functions that take them.
"""

import dataclasses
import math


def check_positive(owner: str, **values: float) -> None:
    """Raises if a value is not a finite number above zero.

    Args:
        owner: What the fields belong to, for the message.
        values: Field names and values.

    Raises:
        ValueError: A value is not finite or not > 0; names the field and the value.
    """
    for name, value in values.items():
        if not (math.isfinite(value) and value > 0):
            raise ValueError(f"{owner}.{name} must be > 0, got {value!r}.")


@dataclasses.dataclass(kw_only=True)
class MapConfig:
    """How depth images become one surface map.

    Attributes:
        voxel_size: Edge of a voxel in the plane of the expected wall, m.
        layer: Height of a voxel along the expected wall's normal, m; points of one wall
            spread over a few mm of depth noise and are to meet in one voxel.
        margin: Kept around the tile in its plane, m.
        depth_range: Kept in front of and behind the expected wall, m.
        min_range: Nearest depth used, m.
        max_range: Farthest depth used, m.
        edge_jump: Pixels next to a jump larger than this share of depth are dropped.
        min_count: Voxels with fewer pixels than this are not given out.
    """

    voxel_size: float = 0.005
    layer: float = 0.015
    margin: float = 0.2
    depth_range: float = 1.5
    min_range: float = 0.25
    max_range: float = 3.0
    edge_jump: float = 0.02
    min_count: int = 3

    def validate(self) -> None:
        """Raises ValueError for a value out of bounds."""
        check_positive("map", **dataclasses.asdict(self))


@dataclasses.dataclass(kw_only=True)
class SegmentationConfig:
    """The six steps of the paper's section 4.4, with its values as defaults.

    Source: Tadic et al., "Painting Robot with RealSense D435", 2021, section 4.4.

    Attributes:
        neighbors: Neighbours of the statistical filter, k.
        std_multiplier: Its threshold in standard deviations, alpha.
        distance_threshold: RANSAC inlier distance, m.
        stop_fraction: RANSAC stops when fewer points than this share remain.
        max_planes: RANSAC stops after so many planes.
        cell: Edge of a grid cell, m.
        cluster_tolerance: Regions farther apart than this are separate, m.
        min_region_area: Smaller regions inherit from the nearest larger one, m².
        wall_distance_tolerance: How far the wall may be from the expected one, m.
        wall_angle_tolerance_deg: How far its normal may be from the expected one.
    """

    neighbors: int = 50
    std_multiplier: float = 3.5
    distance_threshold: float = 0.03
    stop_fraction: float = 0.005
    max_planes: int = 20
    cell: float = 0.01
    cluster_tolerance: float = 0.08
    min_region_area: float = 0.005
    wall_distance_tolerance: float = 0.15
    wall_angle_tolerance_deg: float = 10.0

    def validate(self) -> None:
        """Raises ValueError for a value out of bounds."""
        check_positive("segmentation", **dataclasses.asdict(self))


@dataclasses.dataclass(kw_only=True)
class StereoConfig:
    """Geometry and errors of a D435-like stereo depth camera.

    Source: `perception/stereo.py` cites each value.

    Attributes:
        width: Depth image width, px.
        height: Depth image height, px.
        hfov_deg: Horizontal field of view.
        baseline: Distance of the two imagers, m.
        min_range: Nearest depth measured, m.
        max_range: Farthest depth measured, m.
        subpixel: Standard deviation of disparity, px.
        fixed_share: Share of the disparity variance that is a fixed pattern.
        quantum: Disparity step, px.
        fattening: Window of the block matcher at depth edges, px.
        dropout: Share of pixels lost at random.
        hole_share: Share of a pane of glass that returns nothing.
        reflection_share: Share that returns a reflection; the rest sees through.
    """

    width: int = 848
    height: int = 480
    hfov_deg: float = 87.0
    baseline: float = 0.050
    min_range: float = 0.17
    max_range: float = 10.0
    subpixel: float = 0.05
    fixed_share: float = 0.5
    quantum: float = 0.03125
    fattening: int = 7
    dropout: float = 0.01
    hole_share: float = 0.5
    reflection_share: float = 0.2

    def validate(self) -> None:
        """Raises ValueError for a value out of bounds."""
        check_positive(
            "stereo",
            width=self.width,
            height=self.height,
            hfov_deg=self.hfov_deg,
            baseline=self.baseline,
            min_range=self.min_range,
            max_range=self.max_range,
            quantum=self.quantum,
        )
        shares = ("fixed_share", "dropout", "hole_share", "reflection_share")
        for name in shares:
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ValueError(
                    f"stereo.{name} must be 0 to 1, got {getattr(self, name)!r}."
                )
