"""Ends a run: figures, page and the mark of completeness."""

from typing import Any

from painter.run.figures.figures import run_figures
from painter.run.figures.time_figures import DONE, ENDED
from painter.run.folder import folder as files
from painter.run.folder.folder import RunFolder, rounded
from painter.run.page.page import report_page


def finish_run(
    folder: RunFolder,
    *,
    time: float,
    result: str,
    wall_clock: float,
    cause: str | None = None,
    code: str | None = None,
) -> dict[str, Any]:
    """Logs how a run ended, writes its report and, if it reached DONE, completes it.

    Everything else of the run is to be in the folder before: this is the last step.

    Args:
        folder: The run's folder.
        time: Robot time of the end, s.
        result: "DONE", "FAULT" or "ABORTED".
        wall_clock: Time the program ran, s.
        cause: Why it did not reach DONE, one line.
        code: Stable name of that cause, "PNT-AREA-NNN".

    Returns:
        The content of report.json.
    """
    end = {"result": result, "cause": cause, "code": code, "wall_clock_s": wall_clock}
    folder.log(time, ENDED, **end)
    figures = write_report(folder)
    if result == DONE:
        folder.complete()
    else:
        folder.mark_incomplete(f"{result}: {cause or 'no cause is known'}", code)
    return figures


def write_report(folder: RunFolder) -> dict[str, Any]:
    """Writes report.json and report.html from the other files of a run.

    Returns:
        The content of report.json.

    Raises:
        InputError: A file of the run cannot be read.
    """
    figures = rounded(run_figures(folder))
    page = report_page(folder, figures)
    folder.save_report(figures)
    folder.write_text(files.PAGE, page)
    return figures
