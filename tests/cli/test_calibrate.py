"""`painter calibrate` from the words on the command line to the mount."""

import json

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix

from painter.cli.main import run
from painter.config import load_scenario
from painter.robot.arm_model import GetArmKinematics, MakeArmPlant
from perception.config import StereoConfig
from perception.depth_camera.depth import CameraIntrinsics
from perception.io.frames import Frame, write_recording

CAMERA = CameraIntrinsics.from_stereo(StereoConfig(width=424, height=240))
TURN_DEG = [0.5, -0.4, 0.6]
SHIFT = [0.003, -0.002, 0.0]
MOUNT = RigidTransform(RollPitchYaw(np.deg2rad(TURN_DEG)), SHIFT)
WALL = 1.3  # m, W's x of the wall.


def depth_of_wall(X_WC):
    u = (np.arange(CAMERA.width) - CAMERA.cx) / CAMERA.fx
    v = (np.arange(CAMERA.height) - CAMERA.cy)[:, None] / CAMERA.fy
    along = X_WC.rotation().matrix()[0]
    depth = (WALL - X_WC.translation()[0]) / (along[0] * u + along[1] * v + along[2])
    return np.rint(1000.0 * depth).astype(np.uint16)


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """A bare wall from 20 places, the wrist turned by up to 22 deg."""
    folder = tmp_path_factory.mktemp("hand_eye")
    plant = MakeArmPlant(load_scenario("blank").directives)
    kinematics = GetArmKinematics(plant)
    rng = np.random.default_rng(4)
    frames, lines = [], ["# time q1 q2 q3 q4 q5"]
    for number in range(20):
        yaw, pitch = np.deg2rad(rng.uniform(-22.0, 22.0, 2))
        q = np.array([rng.uniform(-0.3, 0.3), -1.9, 2.3, 0.0, 0.0])
        q[3], q[4] = pitch - q[1] - q[2], yaw - q[0]
        R, p = kinematics.camera_poses(q[None])
        X_WC = RigidTransform(RotationMatrix(R[0]), p[0]) @ MOUNT
        color = np.zeros((CAMERA.height, CAMERA.width, 3), np.uint8)
        frames.append((Frame(float(number), depth_of_wall(X_WC), color), X_WC))
        lines.append(f"{number} " + " ".join(f"{joint:.9f}" for joint in q))
    write_recording(folder, CAMERA, frames)
    (folder / "joints.txt").write_text("\n".join(lines) + "\n")
    return folder


def test_the_mount_is_found_and_written(recording, tmp_path, capsys):
    out = tmp_path / "out"
    assert run(["calibrate", str(recording), "--out", str(out), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report == json.loads((out / "calibration.json").read_text())
    np.testing.assert_allclose(report["rotation_deg"], TURN_DEG, atol=0.05)
    np.testing.assert_allclose(report["translation_m"][:2], SHIFT[:2], atol=1e-3)
    assert report["pictures"] == 20
    # The overrides it gives are valid, and hold the result.
    scenario = load_scenario("blank", report["set"])
    assert scenario.wall_camera.calibrated_deg == report["rotation_deg"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "joints.txt: no such file"),
        ("0.0 1 2 3 4\n", "line 1 is not a time and five positions"),
        ("1 0 0 0 0 0\n1 0 0 0 0 0\n", "line 2: time must be after the line before"),
        ("# nothing\n", "holds no joint positions"),
    ],
)
def test_wrong_joint_files_are_one_line(tmp_path, capsys, text, message):
    frame = Frame(0.0, np.full((240, 424), 700, np.uint16), np.zeros((240, 424, 3)))
    folder = tmp_path / "frames"
    folder.mkdir()
    write_recording(folder, CAMERA, [(frame, RigidTransform())])
    if text is not None:
        (folder / "joints.txt").write_text(text)
    assert run(["calibrate", str(folder), "--out", str(tmp_path / "out")]) == 2
    assert message in capsys.readouterr().err


def test_pictures_without_joints_are_no_calibration(recording, tmp_path, capsys):
    words = ["calibrate", str(recording), "--out", str(tmp_path / "out")]
    assert run([*words, "--board", "8x6:0.04:0.03"]) == 1
    assert "0 pictures show the board" in capsys.readouterr().err
    assert run([*words, "--board", "8x6"]) == 2
    assert "expected COLUMNSxROWS:SQUARE:MARKER" in capsys.readouterr().err
