"""Settings of perception: every field with its default, unit and bound.

Plain mutable dataclasses, because Drake's `yaml_load_typed` fills them field by field;
`validate()` is called when a scenario is loaded and by the functions that take them.
"""

import dataclasses

from perception.ground import check_positive


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
        edge_step: And next to one larger than this times the square of depth, 1/m;
            errors of stereo grow so, and 0.014 is 0.3 px of a D435's disparity.
        edge_window: Window within which they are, on the near side of the jump, px;
            as large as the block matcher's, which makes near surfaces grow by half.
        stride: Every so many-th pixel and row is used.
        min_count: Voxels with fewer pixels than this are not given out.
        outlier_share: Nor are those with less than this share of the pixels, or of the
            pictures, that the best voxel of the 3 x 3 columns around got.
    """

    voxel_size: float = 0.005
    layer: float = 0.015
    margin: float = 0.2
    depth_range: float = 1.5
    min_range: float = 0.25
    max_range: float = 3.0
    edge_jump: float = 0.02
    edge_step: float = 0.014
    edge_window: int = 7
    stride: int = 2
    min_count: int = 3
    outlier_share: float = 0.15

    def validate(self) -> None:
        """Raises ValueError for a value out of bounds."""
        check_positive("map", **dataclasses.asdict(self))
        if self.edge_window % 2 == 0:
            raise ValueError(f"map.edge_window must be odd, got {self.edge_window!r}.")
        if self.outlier_share >= 1.0:
            raise ValueError(
                f"map.outlier_share must be < 1, got {self.outlier_share!r}."
            )


@dataclasses.dataclass(kw_only=True)
class SegmentationConfig:
    """The six steps of the paper's section 4.4, with its values as defaults.

    Source: Tadic et al., "Painting Robot with RealSense D435", 2021, section 4.4.

    Attributes:
        neighbors: Neighbours of the statistical filter, k.
        std_multiplier: Its threshold in standard deviations, alpha.
        fast_filter: Let the filter prove dense places inside by bounds and estimate its
            threshold from a sample; see `statistical_filter`.
        distance_threshold: RANSAC inlier distance, m.
        stop_fraction: RANSAC stops when fewer points than this share remain.
        max_planes: RANSAC stops after so many planes.
        cell: Edge of a grid cell, m.
        cluster_tolerance: Regions farther apart than this are separate, m.
        min_region_area: Smaller regions inherit from the nearest larger one, m².
        wall_distance_tolerance: How far the wall may be from the expected one, m.
        wall_angle_tolerance_deg: How far its normal may be from the expected one.
        min_wall_share: Share of the points that the wall's plane has at least.
        min_step: Lower steps against the wall's own surface are painted over, m.
        step_significance: So many standard deviations of the residual make a step.
        min_object_area: Smaller parts off the wall's surface count as wall, m².
    """

    neighbors: int = 50
    std_multiplier: float = 3.5
    fast_filter: bool = False
    distance_threshold: float = 0.03
    stop_fraction: float = 0.005
    max_planes: int = 20
    cell: float = 0.01
    cluster_tolerance: float = 0.08
    min_region_area: float = 0.005
    wall_distance_tolerance: float = 0.15
    wall_angle_tolerance_deg: float = 10.0
    min_wall_share: float = 0.1
    min_step: float = 0.005
    step_significance: float = 5.0
    min_object_area: float = 0.0009

    def validate(self) -> None:
        """Raises ValueError for a value out of bounds."""
        numbers = dataclasses.asdict(self)
        del numbers["fast_filter"]
        check_positive("segmentation", **numbers)


@dataclasses.dataclass(kw_only=True)
class StereoConfig:
    """Geometry and errors of a D435-like stereo depth camera.

    Source: Intel, "Tuning depth cameras for best performance" (best resolution), "D400
    series data sheet", 337029 (field of view, baseline, range, left-imager reference)
    and "Subpixel linearity improvement" (1/32 px, ripple); Intel's Grunnet-Jepsen in
    librealsense issue 3904 (`subpixel`: 0.08 advised, 0.032 at best); `min_range` is
    f B / 126 px, the matcher's search range (librealsense issue 3039). The shares, the
    window and the grazing angle are assumptions until they are measured.

    Attributes:
        width: Depth image width, px.
        height: Depth image height, px.
        hfov_deg: Horizontal field of view.
        baseline: Distance of the two imagers, m; the right one lies along C's x.
        min_range: Nearest depth measured, m.
        max_range: Farthest depth measured, m.
        subpixel: Standard deviation of disparity, px.
        fixed_share: Share of the disparity variance that is a fixed pattern.
        ripple: Amplitude of the disparity error that repeats with every pixel, px.
        quantum: Disparity step, px.
        fattening: Window of the block matcher, px: near sides grow by half of it.
        fattening_share: Share of edges where they do.
        flying_share: Share of the pixels grown over that lie between near and far.
        grazing_deg: Angle between ray and surface normal beyond which pixels get lost.
        dropout: Share of pixels lost at random.
        hole_share: Share of a pane of glass that returns nothing.
        reflection_share: Share that returns a reflection; the rest sees through.
    """

    width: int = 848
    height: int = 480
    hfov_deg: float = 87.0
    baseline: float = 0.050
    min_range: float = 0.177
    max_range: float = 10.0
    subpixel: float = 0.08
    fixed_share: float = 0.5
    ripple: float = 0.02
    quantum: float = 0.03125
    fattening: int = 7
    fattening_share: float = 0.7
    flying_share: float = 0.15
    grazing_deg: float = 60.0
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
            grazing_deg=self.grazing_deg,
        )
        for name in (
            "fixed_share",
            "fattening_share",
            "flying_share",
            "dropout",
            "hole_share",
            "reflection_share",
        ):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ValueError(
                    f"stereo.{name} must be 0 to 1, got {getattr(self, name)!r}."
                )
        if self.hole_share + self.reflection_share > 1.0:
            raise ValueError("stereo.hole_share + reflection_share must be <= 1.")
        for name in ("subpixel", "ripple"):
            if not 0.0 <= getattr(self, name) < 1.0:
                raise ValueError(
                    f"stereo.{name} must be 0 to 1 px, got {getattr(self, name)!r}."
                )
        if self.fattening < 1 or self.fattening % 2 == 0:
            raise ValueError(
                f"stereo.fattening must be odd and >= 1, got {self.fattening!r}."
            )
        for name, bound in (("hfov_deg", 180.0), ("grazing_deg", 90.0)):
            if not getattr(self, name) < bound:
                raise ValueError(
                    f"stereo.{name} must be < {bound}, got {getattr(self, name)!r}."
                )
        if self.max_range > 65.535:
            raise ValueError(
                f"stereo.max_range must be <= 65.535 m, got {self.max_range!r}."
            )
