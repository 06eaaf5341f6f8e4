"""`painter report`: rebuilds the report of a run from its folder."""

from pathlib import Path
from typing import Annotated

import typer

from painter.cli import common
from painter.cli.common import print_result

FolderArgument = Annotated[
    Path, typer.Argument(metavar="DIR", help="Run folder, complete or not.")
]


def report(folder: FolderArgument, as_json: common.Json = False) -> None:
    """Rebuild report.json and report.html of a run from its other files.

    Raises:
        InputError: There is no such run folder, or a file in it cannot be read.
    """
    from painter.run.folder.folder import PAGE, RunFolder
    from painter.run.page.catalog import FIGURES
    from painter.run.page.report import write_report

    figures = write_report(RunFolder.open(folder))
    known = {
        info.name: info.text(figures)
        for info in FIGURES
        if info.value(figures) is not None
    }
    short = {"result": figures["result"]} | known | {"page": str(folder / PAGE)}
    print_result(figures, as_json=as_json, short=short)
