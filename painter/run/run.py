"""A run as a notebook reads it: figures, arrays and tables of one run folder."""

import json
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from painter.errors import InputError
from painter.planning.spray_path import PaintProgram
from painter.run.folder.folder import REPORT, RunFolder
from painter.run.folder.values import Executed, Film, Truth
from perception.ground import FloatArray
from perception.values import WallSegmentation

if TYPE_CHECKING:
    import pandas as pd


class Run:
    """A run folder, read when asked; what the run has not left is None.

    Example: `Run("runs/demo").figures["coverage"]`.
    """

    def __init__(self, path: Path | str) -> None:
        """Opens the folder of a run, complete or not.

        Raises:
            InputError: There is no such folder, or it is not a run's.
        """
        self._folder = RunFolder.open(Path(path))

    def __repr__(self) -> str:
        """Returns the folder and how the run ended."""
        state = "complete" if self.is_complete else "incomplete"
        return f"Run({str(self.path)!r}), {state}"

    @property
    def path(self) -> Path:
        """The folder."""
        return self._folder.path

    @property
    def is_complete(self) -> bool:
        """True if the cycle reached DONE and everything was written."""
        return self._folder.is_complete

    @cached_property
    def figures(self) -> dict[str, Any]:
        """The content of report.json; empty while the run has no report.

        Raises:
            InputError: The file is damaged.
        """
        path = self.path / REPORT
        if not path.exists():
            return {}
        try:
            return dict(json.loads(path.read_text(encoding="utf-8")))
        except (OSError, ValueError, TypeError) as error:
            raise InputError(
                f"{path}: cannot be read ({error}).", code="PNT-RUN-023"
            ) from error

    @cached_property
    def scenario(self) -> dict[str, Any]:
        """Fields of the scenario, as resolved."""
        return self._folder.scenario()

    @cached_property
    def map(self) -> FloatArray | None:
        """Points of the fused map, (3, N) m, in W."""
        return self._folder.map_points()

    @cached_property
    def segmentation(self) -> WallSegmentation | None:
        """Labels, depth and mask of the tile."""
        return self._folder.segmentation()

    @cached_property
    def program(self) -> PaintProgram | None:
        """Strokes and motion."""
        return self._folder.program()

    @cached_property
    def executed(self) -> Executed | None:
        """Joints, trigger and nozzle poses over time, as executed and as commanded."""
        return self._folder.executed()

    @cached_property
    def film(self) -> Film | None:
        """The wet film; simulation only."""
        return self._folder.film()

    @cached_property
    def truth(self) -> Truth | None:
        """What is truly paintable; simulation only."""
        return self._folder.truth()

    def events(self) -> "pd.DataFrame":
        """Returns the event log, a row an event: time (s), phase, event, data."""
        return _table(self._folder.events())

    def strokes(self) -> "pd.DataFrame":
        """Returns the program's strokes in order, SI units; ends in T, m."""
        strokes = () if self.program is None else self.program.strokes
        rows = []
        for stroke in strokes:
            row = {name: v for name, v in vars(stroke).items() if name[-2:] != "_T"}
            for name in ("start", "end"):
                row[f"{name}_x"], row[f"{name}_y"] = getattr(stroke, f"{name}_T")
            rows.append(row | {"length": stroke.length})
        return _table(rows)


def _table(rows: list[dict[str, Any]]) -> "pd.DataFrame":
    try:
        import pandas as pd
    except ImportError as error:
        raise InputError(
            "tables need pandas: pip install 'painter[notebooks]'.", code="PNT-RUN-024"
        ) from error
    return pd.DataFrame(rows)
