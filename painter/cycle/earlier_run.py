"""The earlier run that a simulated run continues: wall, film and remaining strokes."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np

from painter.config import Scenario, load_scenario
from painter.errors import InputError
from painter.planning.program.remainder import Remainder
from painter.planning.tile import grid_points
from painter.planning.zones import inside
from painter.robot.planners import MakeProgramPlanner
from painter.run.figures.film_on_tile import film_and_truth, film_around
from painter.run.figures.unfinished import rest_of_run, wall_of_run
from painter.run.folder.folder import SCENARIO, RunFolder
from painter.systems.simulated.paint_film import FilmState

# Fields that a new run on the same wall and film must keep.
_SAME = ("scene", "random_seed", "tile")


@dataclass(frozen=True)
class EarlierRun:
    """An earlier run that a new one continues.

    Example: `simulate(EarlierRun.to_resume(Path("runs/stopped"), ()), "runs/rest")`.

    Attributes:
        job: Its scenario, with the new run's overrides.
        remainder: Strokes that the new run paints.
        film: Film that is on the wall before it.
    """

    job: Scenario
    remainder: Remainder
    film: FilmState

    @classmethod
    def to_resume(cls, path: Path, overrides: Sequence[str]) -> Self:
        """Reads a stopped run, to paint its remaining strokes.

        Args:
            path: Its run folder.
            overrides: "key=value" over its scenario, in SI units, as in `simulate`;
                scene, random seed and tile stay.

        Returns:
            The run, to be given to `simulate` in place of a scenario.

        Raises:
            InputError: It is no run folder, was not stopped while it painted, has no
                film or truth, or an override changes the wall.
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
        """Reads a run, to touch up its film where it is thin.

        Args:
            path: Its run folder.
            overrides: "key=value" over its scenario, as in `to_resume`.
            cleared: Corners x, y in T, m, of the area whose film is removed first; None
                = none.

        Returns:
            The run, to be given to `simulate` in place of a scenario.

        Raises:
            InputError: It is no run folder, has no segmentation, film or truth, its
                film is thin nowhere, or an override changes the wall.
        """
        run, job = RunFolder.open(path), _job(path, overrides)
        wall, film = wall_of_run(run), _film(run, job, cleared)
        seen = film_around(run, wall, film.thickness)
        strokes = MakeProgramPlanner(job).touch_up_strokes(wall, seen)
        if not strokes:
            raise InputError(
                f"{path}: the film is thin nowhere; there is nothing to touch up.",
                code="PNT-CYCLE-001",
            )
        return cls(job, Remainder(segmentation=wall, strokes=strokes), film)


def _job(path: Path, overrides: Sequence[str]) -> Scenario:
    """Returns a run's scenario with overrides that change nothing about its wall."""
    file = str(path / SCENARIO)
    before, job = load_scenario(file), load_scenario(file, overrides)
    for name in _SAME:
        old, new = getattr(before, name), getattr(job, name)
        if new != old:
            raise InputError(
                f"--set {name}: got {new}, but {path} has {old}; leave it out.",
                code="PNT-CYCLE-002",
            )
    return job


def _film(
    run: RunFolder, job: Scenario, cleared: list[list[float]] | None
) -> FilmState:
    """Returns the film of a run without the cleared area."""
    film, truth = film_and_truth(run)
    thickness = np.array(film.thickness)
    sprayed = film.sprayed
    if cleared is not None:
        X_TS = wall_of_run(run).X_WT.inverse() @ truth.X_WS
        p_TQs = X_TS @ grid_points(*film.centres())
        gone = inside(cleared, p_TQs[:2].T).reshape(thickness.shape)
        # As if never sprayed, so that the mass balance holds.
        taken = float(thickness[gone].sum()) * film.cell**2
        sprayed -= taken / job.gun.tip.transfer_efficiency
        thickness[gone] = 0.0
    return FilmState(
        thickness * film.cell**2,
        cell=film.cell,
        origin=np.array([film.x0, film.y0]),
        sprayed=sprayed,
        missed=film.missed,
    )
