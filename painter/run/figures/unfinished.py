"""What a run has left undone."""

from painter.errors import InputError
from painter.planning.program.program import strokes_from
from painter.planning.program.remainder import Remainder
from painter.run.figures.time_figures import named
from painter.run.folder.folder import PROGRAM, SEGMENTATION, RunFolder
from perception.values import WallSegmentation

STOPPED = "stopped"


def rest_of_run(run: RunFolder) -> Remainder:
    """Returns what a run that was stopped while it painted has left undone.

    Args:
        run: Its folder.

    Raises:
        InputError: It was not stopped, had not begun to paint or lacks a file.
    """
    stops = named(run.events(), STOPPED)
    if not stops:
        raise InputError(
            f"{run.path}: the run was not stopped; nothing is left of it.",
            code="PNT-RUN-003",
        )
    next_stroke = stops[-1].get("next_stroke")
    if next_stroke is None:
        raise InputError(
            f"{run.path}: the run was stopped before it painted; simulate it anew.",
            code="PNT-RUN-004",
        )
    program = run.program()
    if program is None:
        raise InputError(f"{run.path / PROGRAM}: no such file.", code="PNT-RUN-005")
    if next_stroke >= len(program.strokes) + 1:
        raise InputError(
            f"{run.path}: the run had made all of its strokes.", code="PNT-RUN-006"
        )
    strokes = strokes_from(program.strokes, float(next_stroke))
    return Remainder(segmentation=wall_of_run(run), strokes=strokes)


def wall_of_run(run: RunFolder) -> WallSegmentation:
    """Returns the wall as a run saw it; raises InputError if it did not."""
    wall = run.segmentation()
    if wall is None:
        raise InputError(
            f"{run.path / SEGMENTATION}: no such file.", code="PNT-RUN-007"
        )
    return wall
