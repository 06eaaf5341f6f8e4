import math

import numpy as np
import pytest
from pydrake.geometry import (
    Box,
    ClippingRange,
    DepthRange,
    DepthRenderCamera,
    GeometryInstance,
    MakeRenderEngineVtk,
    PerceptionProperties,
    RenderCameraCore,
    RenderEngineVtkParams,
    SceneGraph,
)
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.sensors import ImageDepth32F, RgbdSensor

from painter.systems.simulated.stereo_camera import (
    MIST_TIME,
    StereoCamera,
    render_camera_info,
)
from perception.config import StereoConfig
from perception.depth_camera.depth import CameraIntrinsics, depth_points

SMALL = StereoConfig(width=212, height=120)


def ideal(depth: float, config: StereoConfig = SMALL) -> ImageDepth32F:
    image = ImageDepth32F(config.width, config.height)
    image.mutable_data[:] = depth
    return image


def make_simulator(*, rate: float = 10.0, seed: int = 1, trigger=None) -> Simulator:
    dut = StereoCamera(config=SMALL, seed=seed, rate=rate)
    simulator = Simulator(dut)
    context = simulator.get_mutable_context()
    dut.GetInputPort("ideal_depth").FixValue(context, ideal(0.8))
    dut.GetInputPort("ideal_depth_with_glass").FixValue(context, ideal(0.8))
    if trigger is not None:
        dut.GetInputPort("gun_trigger").FixValue(context, [trigger])
    return simulator


def outputs(simulator: Simulator) -> tuple[np.ndarray, float]:
    context, dut = simulator.get_context(), simulator.get_system()
    image = dut.GetOutputPort("depth_image").Eval(context).data[:, :, 0].copy()
    return image, dut.GetOutputPort("image_time").Eval(context)[0]


def test_before_the_first_picture_all_is_empty():
    simulator = make_simulator()
    image, time = outputs(simulator)
    assert image.shape == (120, 212)
    assert not image.any()
    assert time == -1.0


def test_pictures_come_at_their_rate_and_differ_by_noise():
    simulator = make_simulator(rate=10.0)
    simulator.AdvanceTo(0.05)  # One update, at t = 0.
    first, time = outputs(simulator)
    assert time == 0.0
    assert np.median(first[:, 30:]) == pytest.approx(800, abs=5)
    simulator.AdvanceTo(0.09)
    np.testing.assert_array_equal(outputs(simulator)[0], first)
    simulator.AdvanceTo(0.11)
    second, time = outputs(simulator)
    assert time == pytest.approx(0.1)
    assert (second != first).mean() > 0.2


def test_a_replay_repeats_every_picture():
    simulator = make_simulator()
    simulator.AdvanceTo(0.35)
    before = outputs(simulator)
    context = simulator.get_mutable_context()
    dut = simulator.get_system()
    dut.SetDefaultContext(context)
    context.SetTime(0.0)
    simulator.Initialize()
    simulator.AdvanceTo(0.35)
    np.testing.assert_array_equal(outputs(simulator)[0], before[0])
    other = make_simulator(seed=2)
    other.AdvanceTo(0.35)
    assert (outputs(other)[0] != before[0]).mean() > 0.2


def test_no_picture_while_the_gun_sprays_and_its_mist_hangs():
    simulator = make_simulator(trigger=0.0)
    simulator.AdvanceTo(0.05)
    first, _ = outputs(simulator)
    trigger = simulator.get_system().GetInputPort("gun_trigger")
    trigger.FixValue(simulator.get_mutable_context(), [1.0])
    simulator.AdvanceTo(1.05)
    trigger.FixValue(simulator.get_mutable_context(), [0.0])
    simulator.AdvanceTo(1.05 + 0.9 * MIST_TIME)
    image, time = outputs(simulator)
    assert time == 0.0
    np.testing.assert_array_equal(image, first)
    simulator.AdvanceTo(1.25 + MIST_TIME)
    assert outputs(simulator)[1] > 1.0 + MIST_TIME


@pytest.mark.parametrize("rate", [0.0, -1.0, math.inf])
def test_bad_rate_is_refused(rate):
    with pytest.raises(ValueError, match="rate must be > 0"):
        StereoCamera(config=SMALL, seed=1, rate=rate)


def test_a_rendered_box_is_where_it_stands():
    """Drake's renderer, the stereo model and the back-projection share one camera.

    A box whose front face has corners at known points, before a wall; errors off.
    """
    config = StereoConfig(
        subpixel=0.0, ripple=0.0, quantum=1e-4, dropout=0.0, fattening=1
    )
    intrinsics = CameraIntrinsics.from_stereo(config)
    builder = DiagramBuilder()
    scene_graph = builder.AddSystem(SceneGraph())
    scene_graph.AddRenderer(
        "vtk", MakeRenderEngineVtk(RenderEngineVtkParams(backend="EGL"))
    )
    # C is W here: x right, y down, z ahead.
    source = scene_graph.RegisterSource("scene")
    for size, p_WB in (
        ((4.0, 4.0, 0.1), (0.0, 0.0, 0.85)),
        ((0.2, 0.1, 0.1), (0.15, -0.07, 0.65)),
    ):
        body = GeometryInstance(RigidTransform(p_WB), Box(*size), f"box{size[0]}")
        body.set_perception_properties(PerceptionProperties())
        scene_graph.RegisterAnchoredGeometry(source, body)
    core = RenderCameraCore(
        "vtk",
        render_camera_info(intrinsics),
        ClippingRange(0.1, 10.0),
        RigidTransform(),
    )
    sensor = builder.AddSystem(
        RgbdSensor(
            scene_graph.world_frame_id(),
            RigidTransform(),
            DepthRenderCamera(core, DepthRange(0.1, 9.0)),
        )
    )
    dut = builder.AddSystem(StereoCamera(config=config, seed=1, rate=5.0))
    builder.Connect(
        scene_graph.get_query_output_port(), sensor.query_object_input_port()
    )
    for port in ("ideal_depth", "ideal_depth_with_glass"):
        builder.Connect(sensor.depth_image_32F_output_port(), dut.GetInputPort(port))
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(0.01)
    context = dut.GetMyContextFromRoot(simulator.get_context())
    depth_mm = dut.GetOutputPort("depth_image").Eval(context).data[:, :, 0]
    p_CQs = depth_points(depth_mm, depth_mm > 0, intrinsics)
    front = p_CQs[:, np.abs(p_CQs[2] - 0.6) < 0.002]
    # The outermost pixel centres lie within one pixel, 1.34 mm, inside the edges, so
    # half a pixel of shift of the principal point would show.
    pixel = 0.6 / intrinsics.fx
    for axis, low, high in ((0, 0.05, 0.25), (1, -0.12, -0.02)):
        assert low - 1e-4 < front[axis].min() < low + pixel + 1e-4
        assert high - pixel - 1e-4 < front[axis].max() < high + 1e-4
    np.testing.assert_allclose(np.median(front[2]), 0.6, atol=0.001)
    np.testing.assert_allclose(np.median(p_CQs[2]), 0.8, atol=0.001)
