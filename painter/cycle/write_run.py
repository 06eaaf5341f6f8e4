"""Writes what a cycle left into its run folder, the robot's part and the truth."""

from collections.abc import Callable

from PIL import Image

from painter.config import Scenario
from painter.cycle.cycle_log import CycleLog, clearance_violations
from painter.planning.tile import cell_centres, grid_points
from painter.planning.zones import points_in_zones
from painter.robot.true_scene import true_scene
from painter.run.figures.predicted_film import run_preview
from painter.run.folder.folder import LOOK, RunFolder
from painter.run.folder.values import Executed, Film, Truth
from painter.scene.surface import height_field, is_paintable, surface_at
from painter.systems.simulated.paint_film import FilmState
from painter.systems.values import CycleStatus, FollowerStatus, Phase
from perception.ground import FloatArray
from perception.values import WallSegmentation

# How much nearer than planned the robot may come: tracking and the map's own error.
CLEARANCE_TOLERANCE = 0.02


def write_log(
    folder: RunFolder,
    scenario: Scenario,
    log: CycleLog,
    *,
    before: FilmState | None = None,
) -> None:
    """Writes what a cycle left, with the truth of its scene where that is known.

    Args:
        folder: The run's folder; its event log holds the cycle's events already.
        scenario: The job.
        log: What it left.
        before: Film that was there before it; None = none.
    """
    write_collisions(
        folder, scenario, log.clearance_time, log.clearance, log.floor_clearance
    )
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
    if log.film is not None:
        write_truth(folder, scenario, log.segmentation, log.film, before=before)
    if log.program is not None:
        preview = run_preview(folder, log.program, folder.scenario())
        folder.save_program(log.program, preview)


def write_collisions(
    folder: RunFolder,
    scenario: Scenario,
    time: FloatArray,
    clearance: FloatArray,
    floor_clearance: FloatArray,
) -> None:
    """Logs where the robot came nearer to something than was planned.

    Args:
        folder: The run's folder.
        scenario: Gives what was planned.
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
    """Writes the film, and what of the tile is truly wall.

    Args:
        folder: The run's folder.
        scenario: Gives the scene.
        segmentation: Says where the robot took its tile to be.
        film: What is on the wall.
        before: Film that was there before it; None = none.
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
    asked = points_in_zones(p_TQs[:2].T, scenario.raster.zones)
    folder.save_film(
        Film.on_tile(
            thickness=film.thickness,
            kind=surface.kind,
            # What the operator leaves out is to stay clean.
            paintable=is_paintable(surface.kind) & asked.reshape(surface.kind.shape),
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
