"""A run folder: what a run leaves, file by file (DESIGN section 5)."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, Self, TypeVar

import numpy as np
import yaml

from painter.errors import InputError, PainterError
from painter.planning.film.preview import FilmPreview
from painter.planning.program.store import load_program, save_program
from painter.planning.spray_path import PaintProgram
from painter.run.folder import arrays
from painter.run.folder.values import Executed, Film, Truth
from perception.errors import PerceptionError
from perception.io.segmentations import (
    load_segmentation,
    save_segmentation,
    save_wall_mask,
)
from perception.values import SurfaceMap, WallSegmentation

INCOMPLETE = "INCOMPLETE"
SCENARIO = "scenario.yaml"
EVENTS = "events.jsonl"
MAP = "map.ply"
SEGMENTATION = "segmentation.npz"
MASK_PICTURE = "wall_mask.png"
PROGRAM = "program.json"
TRAJECTORY = "trajectory.npz"
EXECUTED = "executed.npz"
FILM = "film.npz"
TRUTH = "truth.npz"
LOOK = "look.png"
REPORT = "report.json"
PAGE = "report.html"
SCENE = "scene.html"
FILES = (
    SCENARIO,
    EVENTS,
    MAP,
    SEGMENTATION,
    MASK_PICTURE,
    PROGRAM,
    TRAJECTORY,
    EXECUTED,
    FILM,
    TRUTH,
    LOOK,
    REPORT,
    PAGE,
    SCENE,
)

T = TypeVar("T")


class RunFolder:
    """Writes and reads the files of one run.

    From its making until `complete()` the folder holds a file INCOMPLETE, whose text
    says how far the run came; whatever kills the program, it stays. Every other file is
    written whole or not at all, but for the event log, which grows a line at a time.
    Readers return None for a file that the run has not left.
    """

    def __init__(self, path: Path) -> None:
        """Wraps a folder as it is; use `create` or `open`."""
        self.path = path

    @classmethod
    def create(cls, path: Path, scenario_yaml: str) -> Self:
        """Begins a run.

        An empty or missing folder is taken; so is an earlier run's, of which the files
        of a run are removed first and any other file is kept. A folder with anything
        else in it is refused.

        Args:
            path: The folder; parents are made.
            scenario_yaml: The resolved scenario, `painter.config.dump_scenario`.

        Returns:
            The folder, marked incomplete.

        Raises:
            InputError: The folder is a file, holds something else or cannot be written.
        """
        if path.exists() and not path.is_dir():
            raise InputError(
                f"{path}: there is a file of that name.", code="PNT-RUN-013"
            )
        try:
            path.mkdir(parents=True, exist_ok=True)
            if any(path.iterdir()) and not _is_run(path):
                raise InputError(
                    f"{path}: not empty and not a run folder; nothing was replaced.",
                    code="PNT-RUN-014",
                )
            (path / INCOMPLETE).write_text("The run has begun and not ended.\n")
            for name in FILES:
                (path / name).unlink(missing_ok=True)
            (path / EVENTS).touch()
            (path / SCENARIO).write_text(scenario_yaml)
        except OSError as error:
            raise InputError(
                f"{path}: {error.strerror}.", code="PNT-RUN-015"
            ) from error
        return cls(path)

    @classmethod
    def open(cls, path: Path) -> Self:
        """Opens the folder of a run, complete or not.

        Raises:
            InputError: There is no such folder, or no run has left it.
        """
        if not path.is_dir():
            reason = "is a file, not a folder" if path.exists() else "no such folder"
            raise InputError(f"{path}: {reason}.", code="PNT-RUN-016")
        if not _is_run(path):
            raise InputError(
                f"{path}: not a run folder (no {SCENARIO} and {EVENTS}).",
                code="PNT-RUN-017",
            )
        return cls(path)

    @property
    def is_complete(self) -> bool:
        """True once the run reached DONE and all was written."""
        return not (self.path / INCOMPLETE).exists()

    def complete(self) -> None:
        """Removes the mark INCOMPLETE; the last thing a run does."""
        (self.path / INCOMPLETE).unlink(missing_ok=True)

    def mark_incomplete(self, reason: str, code: str | None = None) -> None:
        """Says in INCOMPLETE why the run is not complete: one line, with the code."""
        text = reason if code is None else f"{reason} [{code}]"
        (self.path / INCOMPLETE).write_text(text + "\n")

    def log(self, time: float, name: str, **data: Any) -> None:
        """Appends one line to the event log and flushes it.

        Args:
            time: Robot time, s.
            name: "phase", with `phase=` in `data`, or the name of an event.
            data: JSON values.
        """
        line: dict[str, Any] = {"time": round(time, 6)}
        if name != "phase":
            line["event"] = name
        with (self.path / EVENTS).open("a", encoding="utf-8") as file:
            file.write(json.dumps(line | data, default=_plain) + "\n")

    def events(self) -> list[dict[str, Any]]:
        """Reads the event log; a last line cut short by a killed run is left out.

        Raises:
            InputError: Another line is not a JSON object with a time.
        """
        path = self.path / EVENTS
        lines = _read_text(path).splitlines()
        events: list[dict[str, Any]] = []
        for number, line in enumerate(lines, start=1):
            try:
                event = json.loads(line)
                event["time"] = float(event["time"])
            except (ValueError, KeyError, TypeError) as error:
                if number == len(lines) and not self.is_complete:
                    break
                raise InputError(
                    f"{path}:{number}: not a JSON object with a time.",
                    code="PNT-RUN-018",
                ) from error
            events.append(event)
        return events

    def scenario(self) -> dict[str, Any]:
        """Reads the resolved scenario's fields.

        Raises:
            InputError: The file is not a scenario.
        """
        path = self.path / SCENARIO
        try:
            ((_, fields),) = yaml.safe_load(_read_text(path)).items()
            return dict(fields)
        except (yaml.YAMLError, AttributeError, TypeError, ValueError) as error:
            raise InputError(f"{path}: not a scenario.", code="PNT-RUN-019") from error

    def save_map(self, surface_map: SurfaceMap) -> None:
        """Writes map.ply."""
        arrays.save_map(self.path / MAP, surface_map)

    def map_points(self) -> np.ndarray | None:
        """Reads the map's points: (3, N) m, in W."""
        return self._read(MAP, arrays.load_map)

    def save_segmentation(self, segmentation: WallSegmentation) -> None:
        """Writes segmentation.npz and wall_mask.png."""
        arrays.write_whole(
            self.path / SEGMENTATION,
            lambda draft: save_segmentation(draft, segmentation),
        )
        arrays.write_whole(
            self.path / MASK_PICTURE,
            lambda draft: save_wall_mask(draft, segmentation.wall_mask),
        )

    def segmentation(self) -> WallSegmentation | None:
        """Reads segmentation.npz."""
        return self._read(SEGMENTATION, load_segmentation)

    def save_program(
        self, program: PaintProgram, preview: FilmPreview | None = None
    ) -> None:
        """Writes program.json and trajectory.npz, with the film to come if given."""
        save_program(self.path, program, preview)

    def program(self) -> PaintProgram | None:
        """Reads program.json and trajectory.npz."""
        return self._read(PROGRAM, lambda path: load_program(path.parent))

    def save_executed(self, executed: Executed) -> None:
        """Writes executed.npz."""
        arrays.save_executed(self.path / EXECUTED, executed)

    def executed(self) -> Executed | None:
        """Reads executed.npz."""
        return self._read(EXECUTED, arrays.load_executed)

    def save_film(self, film: Film) -> None:
        """Writes film.npz."""
        arrays.save_film(self.path / FILM, film)

    def film(self) -> Film | None:
        """Reads film.npz."""
        return self._read(FILM, arrays.load_film)

    def save_truth(self, truth: Truth) -> None:
        """Writes truth.npz."""
        arrays.save_truth(self.path / TRUTH, truth)

    def truth(self) -> Truth | None:
        """Reads truth.npz."""
        return self._read(TRUTH, arrays.load_truth)

    def save_report(self, figures: dict[str, Any]) -> None:
        """Writes report.json; numbers to 6 significant digits, keys as they come."""
        text = json.dumps(rounded(figures), indent=2, allow_nan=False) + "\n"
        self.write_text(REPORT, text)

    def write_text(self, name: str, text: str) -> None:
        """Writes a text file whole or not at all."""
        arrays.write_whole(
            self.path / name, lambda draft: draft.write_text(text, "utf-8")
        )

    def _read(self, name: str, read: Callable[[Path], T]) -> T | None:
        path = self.path / name
        if not path.exists():
            return None
        try:
            return read(path)
        except (PainterError, PerceptionError) as error:
            raise InputError(str(error), code="PNT-RUN-020") from error
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise InputError(
                f"{path}: cannot be read ({error}).", code="PNT-RUN-021"
            ) from error


def rounded(value: Any) -> Any:
    """Returns a JSON value with its numbers rounded to 6 significant digits."""
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [rounded(item) for item in value]
    return float(f"{value:.6g}") if isinstance(value, float) else value


def _is_run(path: Path) -> bool:
    return all((path / name).is_file() for name in (SCENARIO, EVENTS))


def _read_text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(
            f"{path}: cannot be read ({error}).", code="PNT-RUN-022"
        ) from error


def _plain(value: Any) -> Any:
    """Turns NumPy numbers and arrays into JSON values."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} is no JSON value.")
