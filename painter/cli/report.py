"""`painter report`: rebuilds the report of a run from its folder."""

from pathlib import Path
from typing import Annotated

import typer

from painter.cli.common import JsonOption, print_result

FolderArgument = Annotated[
    Path, typer.Argument(metavar="DIR", help="Run folder, complete or not.")
]


def report(folder: FolderArgument, as_json: JsonOption = False) -> None:
    """Rebuild report.json and report.html of a run from its other files.

    Raises:
        InputError: There is no such run folder, or a file in it cannot be read.
    """
    from painter.run.folder.folder import PAGE, RunFolder
    from painter.run.page.catalog import FIGURES
    from painter.run.page.report import write_report

    figures = write_report(RunFolder.open(folder))
    if as_json:
        print_result(figures, as_json=True)
        return
    known = {
        info.name: info.text(figures)
        for info in FIGURES
        if info.value(figures) is not None
    }
    page = {"page": str(folder / PAGE)}
    print_result({"result": figures["result"]} | known | page, as_json=False)
