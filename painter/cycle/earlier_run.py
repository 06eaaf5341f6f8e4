"""What a simulated run goes on from: wall, film and open work of an earlier run."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np

from painter.config import Scenario, load_scenario
from painter.errors import InputError
from painter.planning.program.remainder import Remainder
from painter.planning.tile import cell_centres, grid_points
from painter.planning.zones import inside
from painter.robot.planners import MakeProgramPlanner
from painter.run.figures.film_on_tile import film_and_truth, film_around
from painter.run.figures.unfinished import rest_of_run, wall_of_run
from painter.run.folder.folder import SCENARIO, RunFolder
from painter.systems.simulated.paint_film import FilmState

# What decides where the film lies and what the wall is.
_SAME = ("scene", "random_seed", "tile")


@dataclass(frozen=True)
class EarlierRun:
    """An earlier run that a new one goes on from.

    Attributes:
        job: Its scenario, with what the new run changes.
        remainder: What the new run paints.
        film: What is on the wall before it.
    """

    job: Scenario
    remainder: Remainder
    film: FilmState

    @classmethod
    def to_resume(cls, path: Path, overrides: Sequence[str]) -> Self:
        """Reads a run that was stopped; the rest of its strokes is painted.

        Args:
            path: Its folder.
            overrides: Words "key=value" over its scenario.

        Raises:
            InputError: Nothing of the run can be gone on with; says why.
        """
        run, job = RunFolder.open(path), _job(path, overrides)
        return cls(job, rest_of_run(run), _film(run, job, None))

    @classmethod
    def to_touch_up(
        cls,
        path: Path,
        overrides: Sequence[str],
        cleared: list[list[float]] | None,
    ) -> Self:
        """Reads a run whose film is mended where it is thin.

        Args:
            path: Its folder.
            overrides: Words "key=value" over its scenario.
            cleared: Corners x, y in T, m, of the mark from which the film is taken
                off first; None = nowhere.

        Raises:
            InputError: The run has left no film, or it is thin nowhere.
        """
        run, job = RunFolder.open(path), _job(path, overrides)
        wall, film = wall_of_run(run), _film(run, job, cleared)
        seen = film_around(run, wall, film.thickness)
        strokes = MakeProgramPlanner(job).touch_up_strokes(wall, seen)
        if not strokes:
            raise InputError(
                f"{path}: the film is thin nowhere; nothing to mend.",
                code="PNT-CYCLE-001",
            )
        return cls(job, Remainder(segmentation=wall, strokes=strokes), film)


def _job(path: Path, overrides: Sequence[str]) -> Scenario:
    """Returns a run's scenario with overrides that leave its wall where it is."""
    file = str(path / SCENARIO)
    before, job = load_scenario(file), load_scenario(file, overrides)
    for name in _SAME:
        old, new = getattr(before, name), getattr(job, name)
        if new != old:
            raise InputError(
                f"--set {name}: must be that of {path}, {old}, got {new}.",
                code="PNT-CYCLE-002",
            )
    return job


def _film(
    run: RunFolder, job: Scenario, cleared: list[list[float]] | None
) -> FilmState:
    """Returns the film that a run left, less what is cleared of it."""
    film, truth = film_and_truth(run)
    thickness = np.array(film.thickness)
    sprayed = film.sprayed
    if cleared is not None:
        X_TS = wall_of_run(run).X_WT.inverse() @ truth.X_WS
        x, y = cell_centres(thickness.shape, film.cell)
        p_TQs = X_TS @ grid_points(x + film.x0, y + film.y0)
        gone = inside(cleared, p_TQs[:2].T)
        gone = gone.reshape(thickness.shape)
        # As if it had never been sprayed, so that no paint is lost from the account.
        taken = float(thickness[gone].sum()) * film.cell**2
        sprayed -= taken / job.gun.tip.transfer_efficiency
        thickness[gone] = 0.0
    return FilmState.of_volume(
        thickness * film.cell**2,
        cell=film.cell,
        origin=np.array([film.x0, film.y0]),
        sprayed=sprayed,
        missed=film.missed,
    )
