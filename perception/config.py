"""Settings of perception; see `perception.settings`.

Plain mutable dataclasses with real types, so that a reader of typed YAML can fill them.
"""

import dataclasses
from collections.abc import Iterator

from perception.settings import Conflict, setting

# Depth images hold millimetres in 16 bits.
MOST_DEPTH = 65.535

_PAPER = 'Tadic et al., "Painting Robot with RealSense D435", 2021, section 4.4'
_TUNING = 'Intel, "Tuning depth cameras for best performance": the best resolution'
_D400 = 'Intel, "D400 series data sheet", 337029'
_LINEARITY = 'Intel, "Subpixel linearity improvement"'
_SUBPIXEL = "Grunnet-Jepsen (Intel), librealsense issue 3904: 0.08 advised, 0.032 best"
_SEARCH = "f B / 126 px, the matcher's search range: librealsense issue 3039"
_ASSUMED = "assumption, not measured yet"


@dataclasses.dataclass(kw_only=True)
class MapConfig:
    """How depth images become one surface map.

    Attributes:
        voxel_size: Edge of a voxel in the plane of the expected wall.
        layer: Height of a voxel along the expected wall's normal. Depth noise spreads
            the points of one wall over a few mm, and they should share one voxel.
        margin: The map reaches this far beyond the tile in its plane.
        depth_range: The map reaches this far in front of and behind the expected wall.
        min_range: Nearest depth used.
        max_range: Farthest depth used.
        edge_jump: Drops pixels beside a depth jump larger than this share of depth.
        edge_step: Drops pixels beside a depth jump larger than this times depth
            squared, as stereo errors grow; 0.014 is 0.3 px of a D435's disparity.
        edge_window: Window beside the jump, on its near side, in which pixels are
            dropped. As large as the block matcher's, which grows near surfaces by half
            of it.
        stride: Uses every n-th pixel of every n-th row.
        min_count: Leaves out voxels with fewer pixels than this.
        outlier_share: Leaves out voxels with less than this share of the pixels, or of
            the images, of the best voxel in the 3 x 3 columns around.
    """

    voxel_size: float = setting(0.005, "m", least=0.001, most=0.1)
    layer: float = setting(0.015, "m", least=0.001, most=0.2)
    margin: float = setting(0.2, "m", above=0.0, most=2.0)
    depth_range: float = setting(1.5, "m", above=0.0, most=10.0)
    min_range: float = setting(0.25, "m", above=0.0, most=10.0)
    max_range: float = setting(3.0, "m", above=0.0, most=MOST_DEPTH)
    edge_jump: float = setting(0.02, "1", above=0.0, most=1.0)
    edge_step: float = setting(0.014, "1/m", above=0.0, most=1.0)
    edge_window: int = setting(7, "px", least=1, most=51, odd=True)
    stride: int = setting(2, "px", least=1, most=16)
    min_count: int = setting(3, "1", least=1, most=1000)
    outlier_share: float = setting(0.15, "1", above=0.0, below=1.0)

    def conflicts(self) -> Iterator[Conflict]:
        """Yields values that do not fit together."""
        if self.min_range >= self.max_range:
            yield "min_range", f"< max_range, {self.max_range!r} m", self.min_range


@dataclasses.dataclass(kw_only=True)
class SegmentationConfig:
    """The six steps of the paper's section 4.4, and the fine steps after them.

    Attributes:
        neighbors: Neighbours of the statistical filter, k.
        std_multiplier: Threshold of the statistical filter in standard deviations,
            alpha.
        fast_filter: Lets the filter prove by bounds that dense places are inliers, and
            estimate its threshold from a sample; see `statistical_filter`.
        distance_threshold: RANSAC inlier distance.
        stop_fraction: RANSAC stops when fewer points than this share remain.
        max_planes: RANSAC stops after this many planes.
        cell: Edge of a grid cell.
        cluster_tolerance: Regions farther apart than this are separate.
        min_region_area: Smaller regions take the label of the nearest larger one.
        wall_distance_tolerance: How far the wall may be from the expected one.
        wall_angle_tolerance_deg: How far its normal may be from the expected one.
        min_wall_share: Least share of the points that the wall's plane must have.
        min_step: Lower steps against the wall's own surface are painted over.
        step_significance: A step is at least this many standard deviations of the
            residual high.
        min_object_area: Smaller parts off the wall's surface count as wall.
    """

    neighbors: int = setting(50, "1", least=1, most=1000, source=_PAPER)
    std_multiplier: float = setting(3.5, "1", above=0.0, most=100.0, source=_PAPER)
    fast_filter: bool = setting(False)
    distance_threshold: float = setting(0.03, "m", above=0.0, most=1.0, source=_PAPER)
    stop_fraction: float = setting(0.005, "1", above=0.0, below=1.0, source=_PAPER)
    max_planes: int = setting(20, "1", least=1, most=1000, source=_PAPER)
    cell: float = setting(0.01, "m", above=0.0, most=1.0, source=_PAPER)
    cluster_tolerance: float = setting(0.08, "m", above=0.0, most=2.0, source=_PAPER)
    min_region_area: float = setting(0.005, "m²", above=0.0, most=10.0, source=_PAPER)
    wall_distance_tolerance: float = setting(0.15, "m", above=0.0, most=10.0)
    wall_angle_tolerance_deg: float = setting(10.0, "deg", above=0.0, most=90.0)
    min_wall_share: float = setting(0.1, "1", above=0.0, below=1.0)
    min_step: float = setting(0.005, "m", above=0.0, most=1.0)
    step_significance: float = setting(5.0, "1", above=0.0, most=100.0)
    min_object_area: float = setting(0.0009, "m²", above=0.0, most=10.0)


@dataclasses.dataclass(kw_only=True)
class StereoConfig:
    """Geometry and errors of a D435-like stereo depth camera.

    Attributes:
        width: Depth image width.
        height: Depth image height.
        hfov_deg: Horizontal field of view.
        baseline: Distance between the two imagers; the right one lies along C's x.
        min_range: Nearest depth measured.
        max_range: Farthest depth measured.
        subpixel: Standard deviation of disparity.
        fixed_share: Share of the disparity variance that is a fixed pattern.
        ripple: Amplitude of the disparity error that repeats with every pixel.
        quantum: Disparity step.
        fattening: Window of the block matcher: near surfaces grow by half of it.
        fattening_share: Share of edges where they do.
        flying_share: Share of the pixels grown over that lie between near and far.
        grazing_deg: Angle between ray and surface normal beyond which pixels get lost.
        dropout: Share of pixels lost at random.
        hole_share: Share of a pane of glass that returns nothing.
        reflection_share: Share that returns a reflection; the rest is seen through.
    """

    width: int = setting(848, "px", least=16, most=4096, source=_TUNING)
    height: int = setting(480, "px", least=16, most=4096, source=_TUNING)
    hfov_deg: float = setting(87.0, "deg", least=10.0, most=150.0, source=_D400)
    baseline: float = setting(0.050, "m", least=0.01, most=0.5, source=_D400)
    min_range: float = setting(0.177, "m", above=0.0, most=10.0, source=_SEARCH)
    max_range: float = setting(10.0, "m", above=0.0, most=MOST_DEPTH, source=_D400)
    subpixel: float = setting(0.08, "px", least=0.0, below=1.0, source=_SUBPIXEL)
    fixed_share: float = setting(0.5, "1", least=0.0, most=1.0, source=_ASSUMED)
    ripple: float = setting(0.02, "px", least=0.0, below=1.0, source=_LINEARITY)
    quantum: float = setting(0.03125, "px", above=0.0, most=1.0, source=_LINEARITY)
    fattening: int = setting(7, "px", least=1, most=51, odd=True, source=_ASSUMED)
    fattening_share: float = setting(0.7, "1", least=0.0, most=1.0, source=_ASSUMED)
    flying_share: float = setting(0.15, "1", least=0.0, most=1.0, source=_ASSUMED)
    grazing_deg: float = setting(60.0, "deg", above=0.0, below=90.0, source=_ASSUMED)
    dropout: float = setting(0.01, "1", least=0.0, most=1.0, source=_ASSUMED)
    hole_share: float = setting(0.5, "1", least=0.0, most=1.0, source=_ASSUMED)
    reflection_share: float = setting(0.2, "1", least=0.0, most=1.0, source=_ASSUMED)

    def conflicts(self) -> Iterator[Conflict]:
        """Yields values that do not fit together."""
        if self.min_range >= self.max_range:
            yield "min_range", f"< max_range, {self.max_range!r} m", self.min_range
        most = 1.0 - self.reflection_share
        if self.hole_share > most:
            bound = f"<= {most:g}, what reflection_share leaves"
            yield "hole_share", bound, self.hole_share
