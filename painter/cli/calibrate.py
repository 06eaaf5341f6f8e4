"""`painter calibrate`: the real mount of the depth camera on the arm."""

import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from painter.cli import common
from painter.cli.common import output_folder, print_result
from painter.errors import InputError
from perception.settings import validate

if TYPE_CHECKING:
    from perception.mapping.calibration.charuco import BoardConfig

RESULT_FILE = "calibration.json"
_BOARD = re.compile(r"^(\d+)x(\d+):([\d.]+):([\d.]+)$")

FramesArgument = Annotated[
    Path,
    typer.Argument(
        metavar="FRAMES",
        help="Folder in TUM RGB-D form with joints.txt: lines of time (s) and the five "
        "joint positions (rad). Turn the wrist by at least 20 deg either way.",
    ),
]
BoardOption = Annotated[
    str | None,
    typer.Option(
        metavar="COLUMNSxROWS:SQUARE:MARKER",
        help="The pictures show a ChArUco board (OpenCV's DICT_5X5_100), e.g. "
        "8x6:0.04:0.03, lengths in m.  [default: they show a wall, best with a box on "
        "it]",
        show_default=False,
    ),
]


def calibrate(
    frames: FramesArgument,
    out: common.Out,
    board: BoardOption = None,
    scenario: common.Scenario = "blank",
    overrides: common.Set = None,
    as_json: common.Json = False,
) -> None:
    """Calibrate the camera's mount from pictures and joint positions.

    Writes calibration.json: the mount with its uncertainty. What the pictures do not
    determine stays as modelled and is marked as not observed. Pass the two values under
    "set" to --set, or copy them into the scenario, and the robot uses the result.
    """
    config = None if board is None else _parse_board(board)
    from painter.config import load_scenario
    from painter.jobs.calibrate_mount import calibrate_mount

    job = load_scenario(scenario, overrides or ())
    report = calibrate_mount(frames, job, board=config)
    with output_folder(out) as folder:
        text = json.dumps(report, indent=2, allow_nan=False)
        (folder / RESULT_FILE).write_text(text + "\n")
    print_result(report, as_json=as_json)


def _parse_board(argument: str) -> "BoardConfig":
    """Reads COLUMNSxROWS:SQUARE:MARKER.

    Raises:
        InputError: It has another form, or there is no such board.
    """
    from perception.mapping.calibration.charuco import BoardConfig

    match = _BOARD.match(argument)
    try:
        if match is None:
            raise ValueError("expected COLUMNSxROWS:SQUARE:MARKER, e.g. 8x6:0.04:0.03")
        config = BoardConfig(
            columns=int(match[1]),
            rows=int(match[2]),
            square=float(match[3]),
            marker=float(match[4]),
        )
        validate(config, "board")
    except ValueError as error:
        raise InputError(f"--board {argument}: {error}", code="PNT-USE-001") from None
    return config
