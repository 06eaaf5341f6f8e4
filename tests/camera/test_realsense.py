"""librealsense itself, through its software device and recordings."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

rs = pytest.importorskip("pyrealsense2")

from painter.camera.config import CameraDriverConfig  # noqa: E402
from painter.camera.frames import CameraError  # noqa: E402
from painter.camera.realsense import (  # noqa: E402
    RealSense,
    apply_options,
    open_device,
    open_recording,
)
from painter.camera.software import SoftwareCamera  # noqa: E402
from perception.config import StereoConfig  # noqa: E402
from perception.depth_camera.depth import CameraIntrinsics  # noqa: E402

CAMERA = CameraIntrinsics.from_stereo(StereoConfig())
BAG = Path(__file__).parents[1] / "perception" / "io" / "data" / "software_device.bag"


class Pictures:
    """A source that gives what it holds, then nothing."""

    def __init__(self, *pictures):
        self.pictures = list(pictures)

    def wait_frame(self, timeout):
        return self.pictures.pop(0) if self.pictures else None


def flat(depth_mm):
    return np.full((480, 848), depth_mm, dtype=np.uint16)


def software(source, **settings):
    config = CameraDriverConfig(**settings)
    return SoftwareCamera(source, config, CAMERA, baseline=0.05)


def test_pictures_pass_librealsense_unchanged_but_for_the_threshold():
    depth = np.random.default_rng(1).integers(200, 3000, (480, 848)).astype(np.uint16)
    depth[0, :4] = (0, 149, 4001, 4000)
    color = np.random.default_rng(2).integers(0, 255, (480, 848, 3)).astype(np.uint8)
    dut = software(Pictures((depth, color, 12.5)))
    frame = dut.wait(1.0)
    dut.close()
    expected = depth.copy()
    expected[0, 1:3] = 0
    np.testing.assert_array_equal(frame.depth_mm, expected)
    assert frame.time == pytest.approx(12.5)
    assert frame.number == 1
    if frame.color is not None:  # Colour may come after the depth it belongs to.
        np.testing.assert_array_equal(frame.color, color)


def test_colour_arrives():
    color = np.full((480, 848, 3), (10, 200, 30), dtype=np.uint8)
    pictures = [(flat(700), color, 0.1 * i) for i in range(10)]
    dut = software(Pictures(*pictures))
    frames = [dut.wait(1.0) for _ in pictures]
    dut.close()
    np.testing.assert_array_equal(frames[-1].color, color)


def test_no_picture_is_none():
    dut = software(Pictures())
    assert dut.wait(0.01) is None
    dut.close()


def test_the_spatial_filter_evens_noise_and_keeps_steps():
    rng = np.random.default_rng(3)
    depth = flat(700)
    depth[:, 424:] = 900
    noisy = (depth + np.rint(rng.normal(0.0, 4.0, depth.shape))).astype(np.uint16)

    def spread(settings):
        dut = software(Pictures((noisy, None, 0.0)), **settings)
        found = dut.wait(1.0).depth_mm.astype(float)
        dut.close()
        step = found[:, 434:].mean() - found[:, :414].mean()
        return found[:, 50:400].std(), step

    raw, _ = spread({})
    smooth, step = spread({"spatial": True, "spatial_magnitude": 5})
    assert raw == pytest.approx(4.0, rel=0.05)
    assert smooth < 0.7 * raw
    assert step == pytest.approx(200.0, abs=3.0)


def test_the_temporal_filter_evens_noise_of_a_scene_at_rest():
    rng = np.random.default_rng(4)
    noisy = [
        (700 + np.rint(rng.normal(0.0, 4.0, (480, 848)))).astype(np.uint16)
        for _ in range(12)
    ]
    pictures = [(picture, None, i / 30) for i, picture in enumerate(noisy)]
    dut = software(Pictures(*pictures), temporal=True, temporal_delta=100)
    last = [dut.wait(1.0) for _ in noisy][-1]
    dut.close()
    # An exponential mean of weight a lowers the variance to a / (2 - a): 0.25 at 0.4.
    assert last.depth_mm.astype(float).std() == pytest.approx(2.0, abs=0.5)


def test_pictures_of_another_size_are_rejected():
    dut = software(Pictures((np.ones((48, 64), np.uint16), None, 0.0)))
    with pytest.raises(CameraError, match=r"must be \(480, 848\) px.* got \(48, 64\)"):
        dut.wait(0.1)
    dut.close()


def sensor_with(**limits):
    device = rs.software_device()
    sensor = device.add_sensor("Stereo Module")
    for name, (low, high) in limits.items():
        option = rs.option_range()
        option.min, option.max, option.step, option.default = low, high, 1, low
        sensor.add_option(getattr(rs.option, name), option, True)
    return device, sensor


def test_preset_exposure_and_emitter_reach_the_sensor():
    device, sensor = sensor_with(
        visual_preset=(0, 6), enable_auto_exposure=(0, 1), exposure=(1, 165_000),
        emitter_enabled=(0, 2),
    )  # fmt: skip
    config = CameraDriverConfig(preset="high_density", exposure=0.0085, emitter=False)
    apply_options(device.query_sensors()[0], config)
    assert sensor.get_option(rs.option.visual_preset) == 4
    assert sensor.get_option(rs.option.enable_auto_exposure) == 0
    assert sensor.get_option(rs.option.exposure) == 8500
    assert sensor.get_option(rs.option.emitter_enabled) == 0
    apply_options(device.query_sensors()[0], CameraDriverConfig())
    assert sensor.get_option(rs.option.enable_auto_exposure) == 1
    assert sensor.get_option(rs.option.visual_preset) == 3


def test_a_value_out_of_the_sensors_range_is_named():
    device, _ = sensor_with(exposure=(1, 1000))
    config = CameraDriverConfig(exposure=0.01)
    with pytest.raises(CameraError, match="exposure must be 1 to 1000, got 10000"):
        apply_options(device.query_sensors()[0], config)


def test_a_recording_plays_with_its_times():
    # 64 x 48, six pictures 33 ms apart: tests/perception/data.
    camera = CameraIntrinsics(fx=50.0, fy=50.0, cx=31.5, cy=23.5, width=64, height=48)
    config = CameraDriverConfig(recording=str(BAG), color=False)
    dut = open_recording(config, camera)
    frames = []
    while (frame := dut.wait(0.5)) is not None:
        frames.append(frame)
    dut.close()
    assert frames
    assert frames[0].depth_mm.shape == (48, 64)
    gaps = np.diff([frame.time for frame in frames])
    numbers = np.diff([frame.number for frame in frames])
    np.testing.assert_allclose(gaps, 0.033 * numbers, atol=1e-9)


@pytest.mark.parametrize("content", [b"", b"#ROSBAG V2.0\nrubbish", b"\0" * 5000])
def test_damaged_recordings_are_named(tmp_path, content):
    path = tmp_path / "bad.bag"
    path.write_bytes(content)
    with pytest.raises(CameraError, match="bad.bag"):
        open_recording(CameraDriverConfig(recording=str(path)), CAMERA)


def test_a_missing_recording_or_stream_is_named(tmp_path):
    config = CameraDriverConfig(recording=str(tmp_path / "none.bag"))
    with pytest.raises(CameraError, match="none.bag: no such recording"):
        open_recording(config, CAMERA)
    with pytest.raises(CameraError, match="64 x 48 at 30 Hz"):
        open_recording(dataclasses.replace(config, recording=str(BAG)), CAMERA)


@pytest.mark.skipif(
    len(rs.context().query_devices()) > 0, reason="a camera is connected"
)
def test_a_missing_camera_is_named():
    with pytest.raises(CameraError, match="no RealSense device is connected"):
        open_device(CameraDriverConfig(), CAMERA)


def test_depth_in_other_units_is_converted_to_mm():
    device = rs.software_device()
    sensor = device.add_sensor("Stereo Module")
    stream = rs.video_stream()
    stream.type, stream.fmt, stream.bpp = rs.stream.depth, rs.format.z16, 2
    stream.width, stream.height, stream.fps = 848, 480, 30
    lens = rs.intrinsics()
    lens.width, lens.height, lens.model = 848, 480, rs.distortion.none
    lens.fx, lens.fy, lens.ppx, lens.ppy = CAMERA.fx, CAMERA.fy, CAMERA.cx, CAMERA.cy
    stream.intrinsics = lens
    profile = sensor.add_video_stream(stream, True)
    sensor.add_read_only_option(rs.option.depth_units, 0.0001)
    config = CameraDriverConfig(color=False)
    dut = RealSense(device, config, CAMERA, name="0.1 mm")
    frame = rs.software_video_frame()
    frame.pixels, frame.bpp, frame.stride = flat(7004), 2, 848 * 2
    frame.timestamp, frame.frame_number = 0.0, 1
    frame.domain = rs.timestamp_domain.hardware_clock
    frame.profile, frame.depth_units = profile.as_video_stream_profile(), 0.0001
    sensor.on_video_frame(frame)
    assert np.unique(dut.wait(1.0).depth_mm).tolist() == [700]
    dut.close()
