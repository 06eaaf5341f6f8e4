"""`painter simulate`: the whole paint cycle in Drake, into a run folder."""

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from pydrake.geometry import Meshcat

from painter.cli.common import (
    JsonOption,
    ScenarioArgument,
    SetOption,
    mark_corners,
    print_result,
    print_summary,
    progress,
    versions,
)
from painter.config import dump_scenario, load_scenario
from painter.cycle.earlier_run import EarlierRun
from painter.cycle.running_cycle import Watch
from painter.cycle.simulate import SimulateCycle
from painter.cycle.write_run import event_watch, write_log
from painter.errors import FaultError, InputError
from painter.planning.strokes.spray_settings import SpraySettings
from painter.run.folder.folder import SCENE, RunFolder
from painter.run.page.report import finish_run
from painter.run.pictures.replay import add_paint, set_view
from painter.scene.load import load_scene
from painter.systems.values import CycleStatus, FollowerStatus, Phase

REPLAY_RATE = 10.0  # Pictures a second of robot time.


def simulate(
    scenario: ScenarioArgument = None,
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="Run folder to write.")
    ] = Path("runs/latest"),
    overrides: SetOption = None,
    seed: Annotated[
        int | None, typer.Option("--seed", help="Same as --set random_seed=N.")
    ] = None,
    meshcat: Annotated[
        bool, typer.Option("--meshcat", help="Show the cycle live in a browser.")
    ] = False,
    replay: Annotated[
        bool, typer.Option("--replay/--no-replay", help="Record scene.html.")
    ] = True,
    stop_at_stroke: Annotated[
        float | None,
        typer.Option(
            metavar="N",
            help="Abort as the operator does, where stroke N is reached; 12.4 = within "
            "the twelfth.",
        ),
    ] = None,
    resume: Annotated[
        Path | None,
        typer.Option(
            metavar="RUN", help="Go on with a run that was stopped, on its film."
        ),
    ] = None,
    touch_up: Annotated[
        Path | None,
        typer.Option(metavar="RUN", help="Mend a run's film where it is thin."),
    ] = None,
    clear: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,X,Y...",
            help="With --touch-up: take the film off this mark first; two opposite "
            "corners of a rectangle or the corners of a polygon, m from the tile's "
            "lower left corner.",
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Simulate the whole paint cycle: look, scan, segment, plan, paint, report.

    With --resume or --touch-up the wall is that of an earlier run, as it was seen and
    painted there, and is not looked at again.

    Args:
        scenario: Name or path.
        out: The run folder.
        overrides: Words "key=value" over the scenario.
        seed: Random seed over the scenario's.
        meshcat: Live view.
        replay: Record the Meshcat replay.
        stop_at_stroke: Where the operator aborts.
        resume: Run to be gone on with.
        touch_up: Run to be mended.
        clear: Mark from which film is taken off before that.
        as_json: Print report.json's content alone.

    Raises:
        InputError: The options do not go together or name nothing to be read.
        FaultError: The cycle did not come to DONE; the run folder says why.
    """
    words = [*(overrides or []), *([f"random_seed={seed}"] if seed is not None else [])]
    earlier = _earlier(scenario, out, words, resume, touch_up, clear)
    job = load_scenario(scenario or "cubes", words) if earlier is None else earlier.job
    load_scene(job.scene, job.random_seed)  # Fails before anything is written.
    folder = RunFolder.create(out, dump_scenario(job))
    start = time.perf_counter()
    viewer = Meshcat() if meshcat or replay else None
    if meshcat and viewer is not None:
        typer.echo(f"Meshcat: {viewer.web_url()}", err=True)
    if viewer is not None:
        set_view(viewer)
        viewer.StartRecording(frames_per_second=REPLAY_RATE)
    folder.log(0.0, "started", versions=versions())
    with progress(f"Simulating {job.name}") as show:
        log = SimulateCycle(
            job,
            remainder=None if earlier is None else earlier.remainder,
            film=None if earlier is None else earlier.film,
            meshcat=viewer,
            watch=_watch(folder, show, stop_at_stroke),
        )
    write_log(folder, job, log, before=None if earlier is None else earlier.film)
    if replay and viewer is not None:
        sprayed = np.flatnonzero(log.trigger)
        if log.program is not None and sprayed.size:
            began = log.time[sprayed[0]] - log.program.motion.spray_on[0, 0]
            pitch = SpraySettings(job.gun.tip, job.raster).nominal_pitch(job.tile.width)
            add_paint(viewer, log.program, pitch=pitch, start=float(began))
        viewer.PublishRecording()
        folder.write_text(SCENE, viewer.StaticHtml())
    figures = finish_run(
        folder,
        time=log.end_time,
        result=log.status.phase.value,
        cause=log.status.cause or None,
        code=log.status.code or None,
        wall_clock=time.perf_counter() - start,
    )
    if as_json:
        print_result(figures, as_json=True)
    else:
        print_summary(figures, out)
    if log.status.phase != Phase.DONE:
        raise FaultError(
            f"{log.status.phase.value}: {log.status.cause}", code=log.status.code
        )


def _earlier(
    scenario: str | None,
    out: Path,
    words: Sequence[str],
    resume: Path | None,
    touch_up: Path | None,
    clear: str | None,
) -> EarlierRun | None:
    """Returns the run that is gone on with, if any."""
    run = resume or touch_up
    if resume is not None and touch_up is not None:
        raise InputError(
            "--resume and --touch-up: only one of them can be given.",
            code="PNT-USE-051",
        )
    if clear is not None and touch_up is None:
        raise InputError("--clear: goes with --touch-up alone.", code="PNT-USE-052")
    if run is None:
        return None
    if scenario is not None:
        raise InputError(
            f"{scenario}: the scenario is that of {run}; give none.", code="PNT-USE-053"
        )
    if out.resolve() == run.resolve():
        raise InputError(
            f"--out {out}: is the run to be gone on with; give another.",
            code="PNT-USE-054",
        )
    if resume is not None:
        return EarlierRun.to_resume(resume, words)
    corners = None if clear is None else mark_corners("--clear", clear)
    return EarlierRun.to_touch_up(run, words, corners)


def _watch(
    folder: RunFolder, show: Callable[[float, str], None], stop_at: float | None
) -> Watch:
    """Returns a watcher that aborts where `stop_at`, a stroke's number, is reached."""
    tell = event_watch(folder, show)

    def watch(now: float, status: CycleStatus, follower: FollowerStatus) -> str | None:
        tell(now, status, follower)
        painting = status.phase == Phase.PAINT
        if stop_at is not None and painting and status.next_stroke >= stop_at:
            return "abort"
        return None

    return watch
