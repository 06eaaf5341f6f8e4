"""Hand-eye calibration by a ChArUco board that stands still before the camera."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
from pydrake.math import RigidTransform
from scipy.optimize import least_squares

from perception.depth_camera.depth import CameraIntrinsics
from perception.ground import FloatArray, IntArray
from perception.io.frames import ColorImage, Frame
from perception.mapping.calibration.hand_eye import FEWEST, CalibrationError, HandEye
from perception.mapping.pose_graph.poses import pose_of, step_to
from perception.settings import Conflict, setting, validate

_DICTIONARY = cv2.aruco.DICT_5X5_100
_FEWEST_CORNERS = 6
_HUBER = 2.0
"""Corners with larger residuals get less weight, px."""


@dataclass(frozen=True)
class BoardConfig:
    """A ChArUco board with markers of OpenCV's DICT_5X5_100.

    Attributes:
        columns: Squares across.
        rows: Squares down.
        square: Edge of a square.
        marker: Edge of a marker.
    """

    columns: int = setting(8, "1", least=3, most=100)
    rows: int = setting(6, "1", least=3, most=100)
    square: float = setting(0.04, "m", above=0.0, most=1.0)
    marker: float = setting(0.03, "m", above=0.0, most=1.0)

    def conflicts(self) -> Iterator[Conflict]:
        """Yields a marker that does not fit in a square."""
        if self.marker >= self.square:
            yield "marker", f"< square, {self.square!r} m", self.marker

    def board(self) -> cv2.aruco.CharucoBoard:
        """Returns OpenCV's board."""
        dictionary = cv2.aruco.getPredefinedDictionary(_DICTIONARY)
        size = (self.columns, self.rows)
        return cv2.aruco.CharucoBoard(size, self.square, self.marker, dictionary)

    def draw(self, pixels_per_m: float) -> npt.NDArray[np.uint8]:
        """Draws the board for printing, grey levels, without a margin."""
        width = round(self.columns * self.square * pixels_per_m)
        height = round(self.rows * self.square * pixels_per_m)
        return np.asarray(self.board().generateImage((width, height))).astype(np.uint8)


def find_corners(color: ColorImage, config: BoardConfig) -> tuple[IntArray, FloatArray]:
    """Finds the board's corners in a picture.

    Returns:
        Numbers (n,) and positions (n, 2), px, of the corners.
    """
    grey = cv2.cvtColor(color, cv2.COLOR_RGB2GRAY)
    corners, numbers, _, _ = cv2.aruco.CharucoDetector(config.board()).detectBoard(grey)
    if numbers is None:
        return np.zeros(0, np.int64), np.zeros((0, 2))
    uv = np.asarray(corners, dtype=float).reshape(-1, 2)
    return np.asarray(numbers).ravel().astype(np.int64), uv


def calibrate_on_board(
    frames: Sequence[Frame], intrinsics: CameraIntrinsics, config: BoardConfig
) -> HandEye:
    """Finds the mount and the board's pose by least squares of reprojection errors.

    Source: Strobl and Hirzinger, "Optimal hand-eye calibration", 2006; standard
    deviations by White, 1980, each picture a cluster, since the arm's error is the same
    for all of its corners.

    Args:
        frames: Pictures with the nominal poses of the arm's model; depth is not used.
        intrinsics: Of the colour pictures, without distortion.
        config: The board.

    Raises:
        CalibrationError: The board is seen in too few pictures.
        ValueError: The board is out of bounds.
    """
    validate(config, "board")
    views = []
    for frame in frames:
        numbers, uv = find_corners(frame.color, config)
        if frame.X_WC is not None and len(numbers) >= _FEWEST_CORNERS:
            views.append((frame.X_WC, numbers, uv))
    if len(views) < FEWEST:
        raise CalibrationError(
            f"{len(views)} pictures show the board and have a pose by the arm, "
            f"{FEWEST} are needed.",
            code="PNT-CALIBRATE-001",
        )
    p_BQs = np.asarray(config.board().getChessboardCorners(), dtype=float)
    X_WB = _first_guess(views[0], p_BQs, intrinsics)
    start = np.concatenate([np.zeros(6), step_to(X_WB)])
    owner = np.repeat(np.arange(len(views)), [2 * len(view[1]) for view in views])

    def residuals(x: FloatArray) -> FloatArray:
        X_NC, X_WB = pose_of(x[:6]), pose_of(x[6:])
        parts = []
        for X_WC, numbers, uv in views:
            p_CQs = (X_WC @ X_NC).inverse() @ X_WB @ p_BQs[numbers].T
            parts.append((intrinsics.project(p_CQs).T - uv).ravel())
        return np.concatenate(parts)

    answer = least_squares(
        residuals, start, loss="huber", f_scale=_HUBER, x_scale="jac"
    )
    inverse = np.linalg.inv(answer.jac.T @ answer.jac)
    scores = answer.jac * residuals(answer.x)[:, None]
    clusters = np.stack([scores[owner == k].sum(axis=0) for k in range(len(views))])
    covariance = inverse @ clusters.T @ clusters @ inverse
    return HandEye(
        X_NC=pose_of(answer.x[:6]),
        sigma=np.sqrt(np.diag(covariance)[:6]),
        observed=np.ones(6),
        pictures=len(views),
        residual=float(np.sqrt(np.mean(residuals(answer.x) ** 2))),
    )


def _first_guess(
    view: tuple[RigidTransform, IntArray, FloatArray],
    p_BQs: FloatArray,
    intrinsics: CameraIntrinsics,
) -> RigidTransform:
    X_WC, numbers, uv = view
    _, turn, shift = cv2.solvePnP(p_BQs[numbers], uv, intrinsics.matrix, None)
    return X_WC @ pose_of(np.concatenate([turn.ravel(), shift.ravel()]))
