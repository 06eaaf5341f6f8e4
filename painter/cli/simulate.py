"""`painter simulate`: the whole paint cycle in Drake, into a run folder."""

import importlib.metadata
import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from PIL import Image
from pydrake.geometry import Meshcat

from painter.cli.common import JsonOption, SetOption, print_result, progress
from painter.config import Scenario, dump_scenario, load_scenario
from painter.diagrams.simulation import (
    CycleLog,
    SimulateCycle,
    Watch,
    clearance_violations,
)
from painter.errors import FaultError
from painter.planning.preview import preview_film
from painter.planning.stroke_lines import nominal_pitch
from painter.planning.tile import cell_centres, grid_points, nominal_tile_pose
from painter.run.folder import LOOK, SCENE, RunFolder
from painter.run.replay import add_paint, set_view
from painter.run.report import finish_run
from painter.run.values import Executed, Film, Truth
from painter.scene.load import load_scene
from painter.scene.sdf import wall_pose
from painter.scene.surface import height_field, is_paintable, surface_at
from painter.systems.values import CycleStatus, FollowerStatus, Phase

# How much nearer than planned the robot may come: tracking and the map's own error.
CLEARANCE_TOLERANCE = 0.02
REPLAY_RATE = 10.0  # Pictures a second of robot time.
VERSIONS = ("painter", "drake", "numpy", "scipy", "open3d")


def simulate(
    scenario: Annotated[
        str, typer.Argument(help="Name of a scenario, or the path of its YAML file.")
    ] = "cubes",
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
    as_json: JsonOption = False,
) -> None:
    """Simulate the whole paint cycle: look, scan, segment, plan, paint, report.

    Args:
        scenario: Name or path.
        out: The run folder.
        overrides: Words "key=value" over the scenario.
        seed: Random seed over the scenario's.
        meshcat: Live view.
        replay: Record the Meshcat replay.
        as_json: Print report.json's content alone.

    Raises:
        FaultError: The cycle did not come to DONE; the run folder says why.
    """
    words = [*(overrides or []), *([f"random_seed={seed}"] if seed is not None else [])]
    job = load_scenario(scenario, words)
    load_scene(job.scene, job.random_seed)  # Fails before anything is written.
    folder = RunFolder.create(out, dump_scenario(job))
    start = time.perf_counter()
    viewer = Meshcat() if meshcat or replay else None
    if meshcat and viewer is not None:
        typer.echo(f"Meshcat: {viewer.web_url()}", err=True)
    if viewer is not None:
        set_view(viewer)
        viewer.StartRecording(frames_per_second=REPLAY_RATE)
    versions = {name: importlib.metadata.version(name) for name in VERSIONS}
    folder.log(0.0, "started", versions=versions)
    with progress(f"Simulating {job.name}") as show:
        log = SimulateCycle(job, meshcat=viewer, watch=_watch(folder, show))
    write_log(folder, job, log)
    if replay and viewer is not None:
        sprayed = np.flatnonzero(log.trigger)
        if log.program is not None and sprayed.size:
            began = log.time[sprayed[0]] - log.program.motion.spray_on[0, 0]
            pitch = nominal_pitch(job.tile.width, tip=job.gun.tip, raster=job.raster)
            add_paint(viewer, log.program, pitch=pitch, start=float(began))
        viewer.PublishRecording()
        folder.write_text(SCENE, viewer.StaticHtml())
    figures = finish_run(
        folder,
        time=log.end_time,
        result=log.status.phase.value,
        cause=log.status.cause or None,
        wall_clock=time.perf_counter() - start,
    )
    if as_json:
        print_result(figures, as_json=True)
    else:
        _print_summary(figures, out)
    if log.status.phase != Phase.DONE:
        raise FaultError(f"{log.status.phase.value}: {log.status.cause}")


def write_log(folder: RunFolder, scenario: Scenario, log: CycleLog) -> None:
    """Writes what a simulated cycle left, with the truth of its scene.

    Args:
        folder: The run's folder; its event log holds the cycle's events already.
        scenario: The job.
        log: What it left.
    """
    for distances, planned in (
        (log.clearance, scenario.motion.clearance),
        (log.floor_clearance, scenario.motion.floor_clearance),
    ):
        bound = max(planned - CLEARANCE_TOLERANCE, 0.0)
        for when, distance in clearance_violations(
            log.clearance_time, distances, bound
        ):
            folder.log(when, "collision", distance_m=distance, bound_m=bound)
    folder.save_map(log.surface_map)
    folder.save_executed(
        Executed(
            time=log.time,
            q=log.q,
            v=log.v,
            trigger=log.trigger,
            X_WG=log.X_WG,
            X_WG_desired=log.X_WG_desired,
        )
    )
    if log.look_image is not None:
        Image.fromarray(log.look_image[:, :, :3]).save(folder.path / LOOK)
    if log.segmentation is None:
        return
    folder.save_segmentation(log.segmentation)
    scene = load_scene(scenario.scene, scenario.random_seed)
    X_WS = wall_pose(scene, nominal_tile_pose(scenario.tile))
    X_ST = X_WS.inverse() @ log.segmentation.X_WT
    ny, nx = log.segmentation.labels.shape
    x, y = cell_centres((ny, nx), log.segmentation.cell)
    p_SQs = X_ST @ grid_points(x, y)
    _, kind = surface_at(scene, p_SQs[0], p_SQs[1])
    folder.save_truth(
        Truth(
            wall_mask=is_paintable(kind).reshape(ny, nx),
            X_WS=X_WS,
            source=(
                "Ray casting against the scene's geometry, at the centres of the "
                "robot's own grid cells carried into the scene by its true pose."
            ),
        )
    )
    if log.program is not None:
        preview = preview_film(
            log.program.strokes,
            log.segmentation,
            tip=scenario.gun.tip,
            nominal=log.program.nominal_thickness,
        )
        folder.save_program(log.program, preview)
    surface = height_field(
        scene,
        cell=log.film.cell,
        margin=-float(log.film.origin[0]),
        width=scenario.tile.width,
        height=scenario.tile.height,
    )
    folder.save_film(
        Film.on_tile(
            thickness=log.film.thickness,
            kind=surface.kind,
            paintable=is_paintable(surface.kind),
            cell=surface.cell,
            x0=float(surface.origin[0]),
            y0=float(surface.origin[1]),
            X_ST=X_ST,
            tile_size=(scenario.tile.width, scenario.tile.height),
            sprayed=log.film.sprayed,
            landed=log.film.landed,
            missed=log.film.missed,
        )
    )


def _watch(folder: RunFolder, show: Callable[[float, str], None]) -> Watch:
    """Returns a watcher that logs each event once and moves the progress bar."""
    logged = 0
    phases = list(Phase)
    last = phases.index(Phase.DONE)

    def watch(now: float, status: CycleStatus, follower: FollowerStatus) -> None:
        nonlocal logged
        for when, name, data in status.events[logged:]:
            folder.log(when, name, **data)
        logged = len(status.events)
        text = f"{status.phase.value.lower()}, robot time {now:.0f} s"
        # Painting takes most of the time of a cycle.
        index = min(phases.index(status.phase), last)
        share = 0.4 * index / last
        if status.phase == Phase.PAINT and follower.duration > 0.0:
            share += 0.5 * follower.position / follower.duration
        elif index > phases.index(Phase.PAINT):
            share = 1.0
        show(share, text)

    return watch


def _print_summary(figures: dict, out: Path) -> None:
    names = (
        "result",
        "motion_time_s",
        "mask_iou",
        "coverage",
        "thickness_cv_interior",
        "overspray",
        "keepout_paint",
        "collisions",
    )
    summary = {name: figures[name] for name in names if figures.get(name) is not None}
    summary |= {
        name: figures["timing"][name] for name in ("cycle_time_s", "wall_clock_s")
    }
    print_result(summary | {"report": str(out / "report.html")}, as_json=False)
