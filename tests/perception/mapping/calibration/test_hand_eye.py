import cv2
import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix

from perception.config import StereoConfig
from perception.depth_camera.depth import CameraIntrinsics
from perception.io.frames import Frame
from perception.mapping.calibration.charuco import BoardConfig, calibrate_on_board
from perception.mapping.calibration.hand_eye import CalibrationError, calibrate_on_wall
from perception.settings import validate

LOOKING = RotationMatrix(np.diag([1.0, -1.0, -1.0]))
MOUNT = RigidTransform(
    RollPitchYaw(np.deg2rad([0.6, -0.5, 0.7])), [0.004, -0.003, 0.002]
)
TURN = np.degrees(RollPitchYaw(MOUNT.rotation()).vector())


def views(count, spread_deg):
    """Poses before the wall z = 0, turned about all axes."""
    rng = np.random.default_rng(2)
    for _ in range(count):
        turn = np.deg2rad(rng.uniform(-1.0, 1.0, 3) * [*spread_deg, 5.0])
        R = LOOKING @ RollPitchYaw(turn).ToRotationMatrix()
        yield RigidTransform(R, [*rng.uniform(-0.1, 0.1, 2), rng.uniform(0.6, 0.8)])


def rays(intrinsics, X_WC):
    """Directions of the pixels (3, H, W) in W, of depth one along C's z."""
    u = (np.arange(intrinsics.width) - intrinsics.cx) / intrinsics.fx
    v = (np.arange(intrinsics.height) - intrinsics.cy) / intrinsics.fy
    u, v = np.meshgrid(u, v)
    return np.einsum(
        "ij,jhw->ihw", X_WC.rotation().matrix(), np.stack([u, v, np.ones_like(u)])
    )


def wall_frames(intrinsics, count, spread_deg):
    """A bare wall, its depth rounded to mm with 1 mm of noise."""
    rng = np.random.default_rng(3)
    for number, X_WC in enumerate(views(count, spread_deg)):
        X_true = X_WC @ MOUNT
        depth = -X_true.translation()[2] / rays(intrinsics, X_true)[2]
        noise = rng.normal(0.0, 1.0, depth.shape)
        depth_mm = np.rint(1000.0 * depth + noise).astype(np.uint16)
        yield Frame(
            float(number), depth_mm, np.zeros((*depth.shape, 3), np.uint8), X_WC
        )


def board_frames(intrinsics, board, count):
    """The board in the plane z = 0, its picture looked up ray by ray."""
    scale = 2000.0
    picture = board.draw(scale)
    for number, X_WC in enumerate(views(count, (20.0, 20.0))):
        X_true = X_WC @ MOUNT
        ray = rays(intrinsics, X_true)
        x, y, _ = X_true.translation()[:, None, None] - ray * (
            X_true.translation()[2] / ray[2]
        )
        # The board's middle is W's origin; its y and the picture's rows go down.
        columns = (x * scale + picture.shape[1] / 2 - 0.5).astype(np.float32)
        rows = (-y * scale + picture.shape[0] / 2 - 0.5).astype(np.float32)
        grey = cv2.remap(
            picture,
            columns,
            rows,
            cv2.INTER_AREA,
            borderMode=cv2.BORDER_CONSTANT,
            borderValue=255,
        )
        color = np.repeat(grey[:, :, None], 3, axis=2)
        yield Frame(float(number), np.zeros(grey.shape, np.uint16), color, X_WC)


def test_a_bare_wall_shows_the_mount_to_a_wrist_that_turns(intrinsics):
    found = calibrate_on_wall(list(wall_frames(intrinsics, 20, (20, 20))), intrinsics)
    report = found.report()
    np.testing.assert_allclose(report["rotation_deg"], TURN, atol=0.06)
    np.testing.assert_allclose(report["translation_m"][:2], [0.004, -0.003], atol=1e-3)
    error = np.abs(np.array(report["translation_m"]) - MOUNT.translation())
    assert np.all(error < 3.0 * np.array(report["translation_sigma_m"]))
    assert min(report["observed"][:5]) > 0.9


def test_a_wrist_that_does_not_turn_leaves_the_mounts_place(intrinsics):
    frames = list(wall_frames(intrinsics, 12, (1.0, 1.0)))
    report = calibrate_on_wall(frames, intrinsics).report()
    assert max(report["observed"][3:]) < 0.1
    np.testing.assert_allclose(report["translation_m"], 0.0, atol=3e-4)
    assert min(report["translation_sigma_m"]) == pytest.approx(0.004)


def test_a_board_shows_all_of_the_mount():
    camera = CameraIntrinsics.from_stereo(StereoConfig())
    board = BoardConfig(square=0.06, marker=0.045)
    frames = list(board_frames(camera, board, 14))
    report = calibrate_on_board(frames, camera, board).report()
    # A tenth of a pixel is 0.16 mm of the board at 0.7 m, a corner; there are 35.
    np.testing.assert_allclose(report["rotation_deg"], TURN, atol=0.05)
    np.testing.assert_allclose(report["translation_m"], MOUNT.translation(), atol=5e-4)
    assert report["residual"] < 0.3
    assert max(report["translation_sigma_m"]) < 5e-4


def test_too_few_pictures_are_refused(intrinsics):
    frames = list(wall_frames(intrinsics, 7, (10.0, 10.0)))
    with pytest.raises(CalibrationError, match="7 pictures have a pose by the arm"):
        calibrate_on_wall(frames, intrinsics)
    with pytest.raises(CalibrationError, match="0 pictures show the board"):
        calibrate_on_board(frames, intrinsics, BoardConfig())


def test_invalid_boards_are_refused():
    with pytest.raises(ValueError, match=r"board\.columns must be 3 to 100, got 2"):
        validate(BoardConfig(columns=2), "board")
    with pytest.raises(ValueError, match=r"board\.marker must be < square, 0\.04 m"):
        validate(BoardConfig(marker=0.05), "board")
