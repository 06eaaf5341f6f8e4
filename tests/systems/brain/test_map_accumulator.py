import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.analysis import Simulator
from pydrake.systems.sensors import ImageDepth16U

from painter.errors import PortTypeError
from painter.planning.config import TileConfig
from painter.planning.tile import nominal_tile_pose
from painter.systems.brain.map_accumulator import MapAccumulator
from painter.systems.values import StageResult
from perception.config import MapConfig
from perception.depth_camera.depth import CameraIntrinsics
from perception.mapping.config import PoseGraphConfig
from perception.values import SurfaceMap, Wall

CAMERA = CameraIntrinsics(fx=100.0, fy=100.0, cx=59.5, cy=39.5, width=120, height=80)
TILE = TileConfig()
X_WT = nominal_tile_pose(TILE)
R_WC = RotationMatrix([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
X_WC = RigidTransform(R_WC, [0.35, 0.1, 1.2])


class Bench:
    """A simulator round the accumulator, with its inputs fixed by hand."""

    def __init__(self, **settings) -> None:
        config = MapConfig(**({"min_count": 1, "stride": 1} | settings))
        self.dut = MapAccumulator(
            config=config,
            pose_graph=PoseGraphConfig(),
            intrinsics=CAMERA,
            tile=TILE,
            X_WT=X_WT,
            period=0.2,
        )
        self.simulator = Simulator(self.dut)
        self.context = self.simulator.get_mutable_context()
        self.show(700, image_time=-1.0)

    def fix(self, port: str, value) -> None:
        self.dut.GetInputPort(port).FixValue(self.context, value)

    def show(self, depth_mm: int, image_time: float, pose=X_WC) -> None:
        image = ImageDepth16U(CAMERA.width, CAMERA.height)
        image.mutable_data[:] = depth_mm
        self.fix("depth_image", image)
        self.fix("image_time", [image_time])
        self.fix("X_WC", pose)

    def surface(self) -> SurfaceMap:
        return self.dut.GetOutputPort("surface_map").Eval(self.context)


def test_map_is_empty_before_the_first_picture():
    bench = Bench()
    bench.simulator.AdvanceTo(0.5)
    assert bench.surface().frames == 0
    assert bench.surface().p_WQs.shape == (3, 0)


def test_points_are_reexpressed_in_world():
    bench = Bench()
    bench.show(700, image_time=0.0)
    bench.simulator.AdvanceTo(0.1)  # One update, at t = 0.
    surface = bench.surface()
    assert surface.frames == 1
    np.testing.assert_allclose(surface.p_WQs[0], 1.05, atol=1e-9)
    # Pixel centres: 59.5 px to either side at 0.7 m.
    reach = 59.5 / 100 * 0.7
    np.testing.assert_allclose(
        [surface.p_WQs[1].min(), surface.p_WQs[1].max()], [0.1 - reach, 0.1 + reach]
    )
    np.testing.assert_allclose(
        surface.normals_W.T, np.tile([-1, 0, 0], (9600, 1)), atol=1e-6
    )


def test_each_picture_is_fused_once():
    bench = Bench()
    bench.show(700, image_time=0.0)
    bench.simulator.AdvanceTo(0.9)
    assert bench.surface().frames == 1
    bench.show(700, image_time=0.8)
    bench.simulator.AdvanceTo(1.9)
    assert bench.surface().frames == 2
    assert bench.surface().counts.sum() == 2 * 9600


def test_each_picture_keeps_the_pose_it_was_taken_at():
    bench = Bench()
    beside = RigidTransform(R_WC, X_WC.translation() + [0.0, 0.3, 0.0])
    for number, pose in enumerate((X_WC, beside)):
        bench.show(700, image_time=0.4 * number, pose=pose)
        bench.simulator.AdvanceTo(0.4 * number + 0.3)
    pictures = bench.context.get_abstract_state(0).get_value().map.pictures
    for picture, pose in zip(pictures, (X_WC, beside), strict=True):
        assert picture.X_WN.IsExactlyEqualTo(pose)


def test_nothing_is_fused_while_not_enabled():
    bench = Bench()
    bench.show(700, image_time=0.0)
    bench.fix("enabled", [0.0])
    bench.simulator.AdvanceTo(0.5)
    assert bench.surface().frames == 0
    bench.fix("enabled", [1.0])
    bench.simulator.AdvanceTo(0.7)
    assert bench.surface().frames == 1


def test_a_wall_restarts_the_map_in_its_tile_frame():
    bench = Bench()
    bench.show(700, image_time=0.0)
    bench.simulator.AdvanceTo(0.1)
    X_WT_found = RigidTransform(X_WT.rotation(), X_WT.translation() + [0.06, 0.0, 0.0])
    wall = Wall(X_WT=X_WT_found, rms=0.0, inlier_count=1, inlier_share=1.0)
    bench.fix("wall", Value(StageResult(number=3, value=wall)))
    bench.simulator.AdvanceTo(0.3)
    assert bench.surface().frames == 0  # The old picture is not fused again.
    bench.show(760, image_time=0.2)
    bench.simulator.AdvanceTo(0.5)
    assert bench.surface().frames == 1
    state = bench.context.get_abstract_state(0).get_value()
    assert state.map.voxels.X_WV.IsExactlyEqualTo(X_WT_found)
    bench.show(760, image_time=0.4)
    bench.simulator.AdvanceTo(0.7)
    assert bench.surface().frames == 2  # The same answer restarts once.


def test_a_failed_search_for_the_wall_keeps_the_map():
    bench = Bench()
    bench.show(700, image_time=0.0)
    bench.fix("wall", Value(StageResult(number=3, error="NoWallError: none")))
    bench.simulator.AdvanceTo(0.3)
    assert bench.surface().frames == 1


def test_the_surface_is_computed_once_a_map():
    bench = Bench()
    bench.show(700, image_time=0.0)
    bench.simulator.AdvanceTo(0.1)
    first = bench.surface()
    bench.simulator.AdvanceTo(0.9)  # More events, no picture.
    assert bench.surface() is first


def test_wrong_type_on_the_wall_port_names_the_port():
    bench = Bench()
    bench.fix("wall", Value(SurfaceMap.empty()))
    with pytest.raises(PortTypeError, match="wall carries SurfaceMap"):
        bench.simulator.AdvanceTo(0.1)


def test_bad_period_is_refused():
    with pytest.raises(ValueError, match="period must be > 0"):
        MapAccumulator(
            config=MapConfig(),
            pose_graph=PoseGraphConfig(),
            intrinsics=CAMERA,
            tile=TILE,
            X_WT=X_WT,
            period=0.0,
        )
