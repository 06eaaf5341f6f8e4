"""Writes the log of a cycle into its run folder, with the truth where it is known."""

import time
from collections.abc import Callable

from PIL import Image

from painter.config import Scenario
from painter.cycle.cycle_log import CycleLog, clearance_violations
from painter.planning.tile import cell_centres, grid_points
from painter.planning.zones import points_in_zones
from painter.robot.true_scene import true_scene
from painter.run.figures.predicted_film import run_preview
from painter.run.folder.folder import LOOK, RunFolder
from painter.run.folder.values import Film, Truth
from painter.run.page.report import finish_run
from painter.run.run import Run
from painter.scene.surface import height_field, is_paintable, surface_at
from painter.systems.simulated.paint_film import FilmState
from painter.systems.values import CycleStatus, FollowerStatus, Phase
from perception.ground import FloatArray
from perception.values import WallSegmentation

# Allowance on planned clearances for tracking and for the map's error, m.
CLEARANCE_TOLERANCE = 0.02


def write_log(
    folder: RunFolder,
    scenario: Scenario,
    log: CycleLog,
    *,
    before: FilmState | None = None,
) -> None:
    """Writes the log of a cycle, with the truth of its scene where that is known.

    Args:
        folder: The run's folder; its event log holds the cycle's events already.
        scenario: The job.
        log: Of the cycle.
        before: Film that was on the wall before; None = none.
    """
    write_collisions(
        folder, scenario, log.clearance_time, log.clearance, log.floor_clearance
    )
    folder.save_map(log.surface_map)
    folder.save_executed(log)
    if log.look_image is not None:
        Image.fromarray(log.look_image[:, :, :3]).save(folder.path / LOOK)
    if log.segmentation is None:
        return
    folder.save_segmentation(log.segmentation)
    if log.film is not None:
        write_truth(folder, scenario, log.segmentation, log.film, before=before)
    if log.program is not None:
        preview = run_preview(folder, log.program, folder.scenario())
        folder.save_program(log.program, preview)


def end_run(folder: RunFolder, log: CycleLog, *, start: float) -> Run:
    """Writes the report of a cycle whose log is written.

    Args:
        folder: The run's folder.
        log: Of the cycle.
        start: `time.perf_counter()` when the program began the run, s.

    Returns:
        The run; it is complete if the cycle reached DONE.
    """
    finish_run(
        folder,
        time=log.end_time,
        result=log.status.phase.value,
        cause=log.status.cause or None,
        code=log.status.code or None,
        wall_clock=time.perf_counter() - start,
    )
    return Run(folder.path)


def write_collisions(
    folder: RunFolder,
    scenario: Scenario,
    time: FloatArray,
    clearance: FloatArray,
    floor_clearance: FloatArray,
) -> None:
    """Logs each episode in which the robot violated a clearance.

    Args:
        folder: The run's folder.
        scenario: Gives the planned clearances.
        time: (k,) s.
        clearance: (k,) m, from the scene.
        floor_clearance: (k,) m, from the floor and the robot's own frame.
    """
    for distances, planned in (
        (clearance, scenario.motion.clearance),
        (floor_clearance, scenario.motion.floor_clearance),
    ):
        bound = max(planned - CLEARANCE_TOLERANCE, 0.0)
        for when, distance in clearance_violations(time, distances, bound):
            folder.log(when, "collision", distance_m=distance, bound_m=bound)


def write_truth(
    folder: RunFolder,
    scenario: Scenario,
    segmentation: WallSegmentation,
    film: FilmState,
    *,
    before: FilmState | None = None,
) -> None:
    """Writes the film, and which cells of the tile truly are paintable wall.

    Args:
        folder: The run's folder.
        scenario: Gives the scene.
        segmentation: Gives the robot's estimate of its tile.
        film: On the wall at the end.
        before: Film that was on the wall before; None = none.
    """
    scene, X_WS = true_scene(scenario)
    X_ST = X_WS.inverse() @ segmentation.X_WT
    ny, nx = segmentation.labels.shape
    x, y = cell_centres((ny, nx), segmentation.cell)
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
    surface = height_field(
        scene,
        cell=film.cell,
        margin=-float(film.origin[0]),
        width=scenario.tile.width,
        height=scenario.tile.height,
    )
    columns, rows = cell_centres(surface.kind.shape, surface.cell)
    x0, y0 = float(surface.origin[0]), float(surface.origin[1])
    p_TQs = X_ST.inverse() @ grid_points(columns + x0, rows + y0)
    in_zone = points_in_zones(p_TQs[:2].T, scenario.raster.zones)
    folder.save_film(
        Film.on_tile(
            thickness=film.thickness,
            kind=surface.kind,
            # An area that the operator excludes is keep-out.
            paintable=is_paintable(surface.kind) & in_zone.reshape(surface.kind.shape),
            cell=surface.cell,
            x0=x0,
            y0=y0,
            X_ST=X_ST,
            tile_size=(scenario.tile.width, scenario.tile.height),
            sprayed=film.sprayed,
            landed=film.landed,
            missed=film.missed,
            before=None if before is None else before.thickness,
        )
    )


def event_watch(
    folder: RunFolder, show: Callable[[float, str], None]
) -> Callable[[float, CycleStatus, FollowerStatus], None]:
    """Returns a watch that logs each event once and moves the progress bar.

    Args:
        folder: The run's folder.
        show: Takes the share of the cycle that is done, 0 to 1, and a text.
    """
    logged = 0
    phases = list(Phase)
    last, share = phases.index(Phase.DONE), 0.0

    def watch(now: float, status: CycleStatus, follower: FollowerStatus) -> None:
        nonlocal logged, share
        for when, name, data in status.events[logged:]:
            folder.log(when, name, **data)
        logged = len(status.events)
        text = f"{status.phase.value.lower()}, robot time {now:.0f} s"
        # Painting takes most of the time of a cycle.
        index = phases.index(status.phase)
        if status.phase == Phase.PAINT and follower.duration > 0.0:
            share = 0.4 * index / last + 0.5 * follower.position / follower.duration
        elif status.phase in (Phase.RETRACT, Phase.DONE):
            share = 1.0
        elif index < last:  # Else paused or stopped: the bar stays.
            share = 0.4 * index / last
        show(share, text)

    return watch
