"""Calibration of the camera's mount on the arm, from recorded pictures and joints."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from painter.config import Scenario, load_scenario
from painter.errors import InputError
from painter.planning.arm.kinematics import ArmKinematics
from painter.robot.robot_model import MakeRobotModel
from perception.ground import FloatArray
from perception.io.frames import Frame, Recording, open_recording
from perception.mapping.calibration.charuco import BoardConfig, calibrate_on_board
from perception.mapping.calibration.hand_eye import calibrate_on_wall

JOINTS_FILE = "joints.txt"
LONGEST_GAP = 0.1
"""Joint positions no farther apart than this are interpolated, s."""


def calibrate_mount(
    frames: Path | str,
    scenario: Scenario | str = "blank",
    *,
    board: BoardConfig | None = None,
) -> dict[str, Any]:
    """Calibrates the camera's mount from pictures and joint positions.

    Example: `calibrate("frames")["set"]` overrides a scenario with the result.

    Args:
        frames: Folder in TUM RGB-D form with joints.txt: lines of time, s, and the five
            joint positions, rad. The wrist is turned by 20 deg and more either way.
        scenario: The robot; a `Scenario`, a name or a path.
        board: The ChArUco board in view; None = a wall, best with a box on it.

    Returns:
        The content of calibration.json: rotation (deg) and translation (m) of the real
        mount against the modelled one with their standard deviations, which of them
        were observed, `X_LC` (4, 4), and under `set` the overrides for a scenario.

    Raises:
        InputError: joints.txt is unusable.
        PerceptionError: The pictures are unusable or too few.
    """
    frames = Path(frames)
    job = load_scenario(scenario) if isinstance(scenario, str) else scenario
    kinematics = MakeRobotModel(job).kinematics
    recording = open_recording(frames, use_poses=False)
    posed = list(_with_joints(recording, frames / JOINTS_FILE, kinematics))
    if board is None:
        found = calibrate_on_wall(posed, recording.intrinsics)
    else:
        found = calibrate_on_board(posed, recording.intrinsics, board)
    report = found.report()
    X_LC = kinematics.X_LC @ found.X_NC
    report["X_LC"] = X_LC.GetAsMatrix4().round(7).tolist()
    report["set"] = [
        f"wall_camera.calibrated_m={report['translation_m']}",
        f"wall_camera.calibrated_deg={report['rotation_deg']}",
    ]
    return report


def read_joints(path: Path) -> tuple[FloatArray, FloatArray]:
    """Reads joint positions.

    Returns:
        Times (n,), s, and positions (n, 5), rad.

    Raises:
        InputError: The file is missing, a line is not a time and five positions, or
            times do not increase; names the line.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such file.", code="PNT-USE-002")
    rows: list[list[float]] = []
    for number, line in enumerate(path.read_text().splitlines(), 1):
        fields = line.split("#")[0].split()
        if not fields:
            continue
        try:
            row = [float(field) for field in fields]
        except ValueError:
            row = []
        if len(row) != 6 or not np.all(np.isfinite(row)):
            raise InputError(
                f"{path}: line {number} is not a time and five positions.",
                code="PNT-USE-003",
            )
        if rows and row[0] <= rows[-1][0]:
            raise InputError(
                f"{path}: line {number}: time must be after the line before.",
                code="PNT-USE-004",
            )
        rows.append(row)
    if not rows:
        raise InputError(f"{path}: holds no joint positions.", code="PNT-USE-005")
    table = np.array(rows)
    return table[:, 0], table[:, 1:]


def _with_joints(
    recording: Recording, path: Path, kinematics: ArmKinematics
) -> Iterator[Frame]:
    """Yields frames with the arm's camera poses; frames in gaps are left out."""
    times, q = read_joints(path)
    for frame in recording.frames():
        after = int(np.searchsorted(times, frame.time))
        if after < len(times) and times[after] == frame.time:
            at = q[after]
        elif 0 < after < len(times) and times[after] - times[after - 1] <= LONGEST_GAP:
            at = np.array([np.interp(frame.time, times, joint) for joint in q.T])
        else:
            continue
        R_WC, p_WC = kinematics.camera_poses(at[None])
        yield frame.replace(X_WC=RigidTransform(RotationMatrix(R_WC[0]), p_WC[0]))
