"""`painter simulate`: a whole paint cycle in Drake, into a run folder."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from painter.cli import common
from painter.cli.common import fail_unless_done, parse_corners, print_run, progress
from painter.errors import InputError

if TYPE_CHECKING:
    from painter.cycle.earlier_run import EarlierRun

SeedOption = Annotated[
    int | None, typer.Option("--seed", help="Short for --set random_seed=N.")
]
MeshcatOption = Annotated[
    bool, typer.Option("--meshcat", help="Show the cycle live in a browser.")
]
ReplayOption = Annotated[
    bool,
    typer.Option("--replay/--no-replay", help="Record scene.html, a Meshcat replay."),
]
StopOption = Annotated[
    float | None,
    typer.Option(
        metavar="N",
        help="Abort at stroke N, as an operator would; 12.4 is within the twelfth.",
    ),
]
TouchUpOption = Annotated[
    Path | None,
    typer.Option(metavar="RUN", help="Touch up the film of a run where it is thin."),
]
ClearOption = Annotated[
    str | None,
    typer.Option(
        metavar="X,Y,X,Y...",
        help="With --touch-up: remove the film inside this area first. Two opposite "
        "corners of a rectangle, or all corners of a polygon, m from the tile's lower "
        "left corner.",
    ),
]


def simulate(
    scenario: common.ScenarioArgument = None,
    out: common.RunFolder = Path("runs/latest"),
    overrides: common.Set = None,
    seed: SeedOption = None,
    meshcat: MeshcatOption = False,
    replay: ReplayOption = True,
    stop_at_stroke: StopOption = None,
    resume: common.Resume = None,
    touch_up: TouchUpOption = None,
    clear: ClearOption = None,
    as_json: common.Json = False,
) -> None:
    """Simulate a whole paint cycle: look, scan, segment, plan, paint, report.

    With --resume or --touch-up the cycle starts from the map and the film of an earlier
    run, and the wall is not scanned again.

    Raises:
        InputError: Options exclude each other or name files that cannot be read.
    """
    overrides = list(overrides or ())
    if seed is not None:
        overrides.append(f"random_seed={seed}")
    earlier = _earlier_run(scenario, out, overrides, resume, touch_up, clear)
    from pydrake.geometry import Meshcat

    from painter.config import load_scenario
    from painter.jobs.run_simulation import simulate as run_simulation

    if earlier is None:
        job = load_scenario(scenario or "cubes", overrides)
    else:
        job = earlier.job
    viewer = Meshcat() if meshcat else None
    if viewer is not None:
        typer.echo(f"Meshcat: {viewer.web_url()}", err=True)
    with progress(f"Simulating {job.name}") as show:
        run = run_simulation(
            earlier or job,
            out,
            meshcat=viewer,
            replay=replay,
            stop_at_stroke=stop_at_stroke,
            show=show,
        )
    print_run(run.figures, out, as_json=as_json)
    fail_unless_done(run.figures)


def _earlier_run(
    scenario: str | None,
    out: Path,
    overrides: list[str],
    resume: Path | None,
    touch_up: Path | None,
    clear: str | None,
) -> "EarlierRun | None":
    """Returns the run that is resumed or touched up, if any."""
    if resume is not None and touch_up is not None:
        raise InputError(
            "--resume and --touch-up: give only one of them.", code="PNT-USE-051"
        )
    if clear is not None and touch_up is None:
        raise InputError("--clear: needs --touch-up.", code="PNT-USE-052")
    run = resume or touch_up
    if run is None:
        return None
    from painter.cycle.earlier_run import EarlierRun
    from painter.jobs.run_simulation import check_other_folder

    check_other_folder(out, run, scenario)
    if resume is not None:
        return EarlierRun.to_resume(resume, overrides)
    corners = None if clear is None else parse_corners("--clear", clear)
    return EarlierRun.to_touch_up(run, overrides, corners)
