"""`painter calibrate`: where the depth camera really sits on the arm."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from pydrake.math import RigidTransform, RotationMatrix

from painter.cli.common import (
    JsonOption,
    OutOption,
    SetOption,
    output_folder,
    print_result,
)
from painter.config import load_scenario
from painter.errors import InputError
from painter.planning.arm.kinematics import ArmKinematics
from painter.robot.robot_model import MakeRobotModel
from perception.ground import FloatArray
from perception.io.frames import Frame, Recording, open_recording
from perception.mapping.calibration.charuco import BoardConfig, calibrate_on_board
from perception.mapping.calibration.hand_eye import calibrate_on_wall

JOINTS_FILE = "joints.txt"
RESULT_FILE = "calibration.json"
LONGEST_GAP = 0.1
"""Joint positions no farther apart than this are interpolated, s."""
_BOARD = re.compile(r"^(\d+)x(\d+):([\d.]+):([\d.]+)$")


def calibrate(
    frames: Annotated[
        Path,
        typer.Argument(
            metavar="FRAMES",
            help="Folder in TUM RGB-D form with joints.txt: lines of time and the five "
            "joint positions, rad. The wrist is turned by 20 deg and more either way.",
        ),
    ],
    out: OutOption,
    board: Annotated[
        str | None,
        typer.Option(
            metavar="COLUMNSxROWS:SQUARE:MARKER",
            help="A ChArUco board of OpenCV's DICT_5X5_100 is seen, e.g. "
            "8x6:0.04:0.03, lengths in m.  [default: a wall, best with a box on it]",
            show_default=False,
        ),
    ] = None,
    scenario: Annotated[
        str, typer.Option(help="Robot: a named scenario or a YAML file.")
    ] = "blank",
    overrides: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Find the camera's mount from pictures and joint positions, with its uncertainty.

    Writes calibration.json. What the pictures do not determine is left as modelled and
    said to be. The two words under "set" make the robot use the answer.
    """
    plan = None if board is None else parse_board(board)
    kinematics = MakeRobotModel(load_scenario(scenario, overrides or ())).kinematics
    recording = open_recording(frames, use_poses=False)
    posed = list(with_joints(recording, frames / JOINTS_FILE, kinematics))
    if plan is None:
        found = calibrate_on_wall(posed, recording.intrinsics)
    else:
        found = calibrate_on_board(posed, recording.intrinsics, plan)
    report = found.report()
    X_LC = kinematics.X_LC @ found.X_CCm
    report["X_LC"] = X_LC.GetAsMatrix4().round(7).tolist()
    report["set"] = [
        f"wall_camera.calibrated_m={report['translation_m']}",
        f"wall_camera.calibrated_deg={report['rotation_deg']}",
    ]
    with output_folder(out) as folder:
        text = json.dumps(report, indent=2, allow_nan=False)
        (folder / RESULT_FILE).write_text(text + "\n")
    print_result(report, as_json=as_json)


def parse_board(word: str) -> BoardConfig:
    """Reads COLUMNSxROWS:SQUARE:MARKER.

    Raises:
        InputError: It has another form, or there is no such board.
    """
    match = _BOARD.match(word)
    try:
        if match is None:
            raise ValueError("expected COLUMNSxROWS:SQUARE:MARKER, e.g. 8x6:0.04:0.03")
        config = BoardConfig(
            columns=int(match[1]),
            rows=int(match[2]),
            square=float(match[3]),
            marker=float(match[4]),
        )
        config.validate()
    except ValueError as error:
        raise InputError(f"--board {word}: {error}", code="PNT-USE-001") from None
    return config


def read_joints(path: Path) -> tuple[FloatArray, FloatArray]:
    """Reads joint positions.

    Returns:
        Times (n,), s, and positions (n, 5), rad.

    Raises:
        InputError: The file is missing, a line is no time and five numbers, or times do
            not increase; names the line.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such file.", code="PNT-USE-002")
    rows: list[list[float]] = []
    for number, line in enumerate(path.read_text().splitlines(), 1):
        words = line.split("#")[0].split()
        if not words:
            continue
        try:
            row = [float(word) for word in words]
        except ValueError:
            row = []
        if len(row) != 6 or not np.all(np.isfinite(row)):
            raise InputError(
                f"{path}: line {number} is no time and five positions.",
                code="PNT-USE-003",
            )
        if rows and row[0] <= rows[-1][0]:
            raise InputError(
                f"{path}: line {number} is not after the one before.",
                code="PNT-USE-004",
            )
        rows.append(row)
    if not rows:
        raise InputError(f"{path}: holds no joint positions.", code="PNT-USE-005")
    table = np.array(rows)
    return table[:, 0], table[:, 1:]


def with_joints(
    recording: Recording, path: Path, kinematics: ArmKinematics
) -> Iterator[Frame]:
    """Yields frames with the arm's poses; those between far positions are left out."""
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
