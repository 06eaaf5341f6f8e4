"""A simulated paint cycle from a scenario to a complete run folder."""

import importlib.metadata
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Unpack, overload

import numpy as np
from pydrake.geometry import Meshcat

from painter.config import Scenario, dump_scenario, load_scenario
from painter.cycle.cycle_log import CycleLog
from painter.cycle.earlier_run import EarlierRun
from painter.cycle.running_cycle import Watch
from painter.cycle.simulate import SimulateCycle
from painter.cycle.write_run import end_run, event_watch, write_log
from painter.diagrams.brain import OwnSystems
from painter.errors import InputError
from painter.planning.strokes.spray_settings import SpraySettings
from painter.run.folder.folder import SCENE, RunFolder
from painter.run.pictures.replay import add_paint, set_view
from painter.run.run import Run
from painter.scene.load import load_scene
from painter.systems.values import CycleStatus, FollowerStatus, Phase

REPLAY_RATE = 10.0  # Pictures a second of robot time.

Show = Callable[[float, str], None]


@overload
def simulate(
    scenario: Scenario | EarlierRun | str = ...,
    out: None = ...,
    *,
    overrides: Sequence[str] = ...,
    meshcat: Meshcat | None = ...,
    replay: bool = ...,
    stop_at_stroke: float | None = ...,
    show: Show | None = ...,
    **own: Unpack[OwnSystems],
) -> CycleLog: ...


@overload
def simulate(
    scenario: Scenario | EarlierRun | str = ...,
    out: Path | str = ...,
    *,
    overrides: Sequence[str] = ...,
    meshcat: Meshcat | None = ...,
    replay: bool = ...,
    stop_at_stroke: float | None = ...,
    show: Show | None = ...,
    **own: Unpack[OwnSystems],
) -> Run: ...


def simulate(
    scenario: Scenario | EarlierRun | str = "cubes",
    out: Path | str | None = None,
    *,
    overrides: Sequence[str] = (),
    meshcat: Meshcat | None = None,
    replay: bool = False,
    stop_at_stroke: float | None = None,
    show: Show | None = None,
    **own: Unpack[OwnSystems],
) -> Run | CycleLog:
    """Simulates a whole paint cycle: look, scan, segment, plan, paint, report.

    Example: `simulate("terrace", "runs/terrace").figures["coverage"]`.

    Args:
        scenario: The job: a `Scenario`, the name of one, the path of its file, or an
            `EarlierRun` to resume or touch up.
        out: Run folder to write; None = write nothing.
        overrides: "key=value" over a scenario that is given by name or path.
        meshcat: Where to show the cycle; None = nowhere.
        replay: Record scene.html, the Meshcat replay, in the run folder.
        stop_at_stroke: Abort as an operator would when this stroke is reached, counted
            from 1; 12.4 is within the twelfth.
        show: Called with the share of the cycle that is done, 0 to 1, and its phase.
        own: `finder`, `segmenter`, `planner`, `mover`, `accumulator`: systems of one's
            own in place of the brain's; see `OwnSystems`.

    Returns:
        The run, or without `out` the log of the cycle: joints, gun poses, map,
        segmentation, program and film. Both are returned even if the cycle ended in
        FAULT or ABORTED: `figures["result"]` and `status.phase` tell.

    Raises:
        InputError: The scenario or its scene cannot be read, or `out` is a folder that
            holds other files.
    """
    earlier = scenario if isinstance(scenario, EarlierRun) else None
    job = _job(scenario, overrides)
    load_scene(job.scene, job.random_seed)  # Fails before anything is written.
    folder = None if out is None else RunFolder.create(Path(out), dump_scenario(job))
    start = time.perf_counter()
    replay = replay and folder is not None
    viewer = Meshcat() if replay and meshcat is None else meshcat
    if viewer is not None:
        set_view(viewer)
        viewer.StartRecording(frames_per_second=REPLAY_RATE)
    if folder is not None:
        folder.log(0.0, "started", versions=versions())
    log = SimulateCycle(
        job,
        remainder=None if earlier is None else earlier.remainder,
        film=None if earlier is None else earlier.film,
        meshcat=viewer,
        watch=_watch(folder, show, stop_at_stroke),
        **own,
    )
    if folder is None:
        return log
    write_log(folder, job, log, before=None if earlier is None else earlier.film)
    if replay and viewer is not None:
        _write_replay(folder, viewer, job, log)
    return end_run(folder, log, start=start)


def versions(*more: str) -> dict[str, str]:
    """Returns the versions of the packages that a cycle's figures depend on.

    Args:
        more: Names of packages beside those that every cycle uses.
    """
    names = ("painter", "drake", *more, "numpy", "scipy", "open3d")
    return {name: importlib.metadata.version(name) for name in names}


def check_other_folder(out: Path, run: Path, scenario: str | None) -> None:
    """Checks that a run that is continued keeps its scenario and its folder.

    Raises:
        InputError: A scenario is given as well, or `out` is the earlier run's folder.
    """
    if scenario is not None:
        raise InputError(
            f"{scenario}: {run} has a scenario of its own; give none.",
            code="PNT-USE-053",
        )
    if out.resolve() == run.resolve():
        raise InputError(
            f"--out {out}: is the folder of the earlier run; give another.",
            code="PNT-USE-054",
        )


def _job(scenario: Scenario | EarlierRun | str, overrides: Sequence[str]) -> Scenario:
    if isinstance(scenario, str):
        return load_scenario(scenario, overrides)
    if overrides:
        raise InputError(
            "overrides: only for a scenario that is given by name or path.",
            code="PNT-USE-057",
        )
    return scenario.job if isinstance(scenario, EarlierRun) else scenario


def _watch(folder: RunFolder | None, show: Show | None, stop_at: float | None) -> Watch:
    """Returns a watcher that aborts when stroke `stop_at` is reached."""
    show = show or (lambda share, text: None)
    tell = None if folder is None else event_watch(folder, show)

    def watch(now: float, status: CycleStatus, follower: FollowerStatus) -> str | None:
        if tell is not None:
            tell(now, status, follower)
        painting = status.phase == Phase.PAINT
        if stop_at is not None and painting and status.next_stroke >= stop_at:
            return "abort"
        return None

    return watch


def _write_replay(
    folder: RunFolder, viewer: Meshcat, job: Scenario, log: CycleLog
) -> None:
    sprayed = np.flatnonzero(log.trigger)
    if log.program is not None and sprayed.size:
        start = log.time[sprayed[0]] - log.program.motion.spray_on[0, 0]
        pitch = SpraySettings(job.gun.tip, job.raster).nominal_pitch(job.tile.width)
        add_paint(viewer, log.program, pitch=pitch, start=float(start))
    viewer.PublishRecording()
    folder.write_text(SCENE, viewer.StaticHtml())
