"""Film that programs planned from scans will leave on the true tile, without painting.

Run `python -m benchmarks.findings.scanned_film [SCENE ...]`; a scene is the name of a
scenario or `random:SEED`. The scene is scanned and segmented as in a cycle, the program
planned with the arm, and its film laid by `FilmModel`, as if the arm followed exactly,
on the scene's own grid, where `report.json` counts it. Of a cycle's minutes the scan
alone is simulated.
"""

import sys
import time

import numpy as np
from pydrake.math import RigidTransform

from benchmarks.support.scanned_scenes import scan_and_segment
from painter.config import Scenario, load_scenario
from painter.planning.film.figures import FilmFigures
from painter.planning.film.film_model import FilmModel, Site
from painter.planning.spray_path import Stroke
from painter.planning.tile import cell_centres, grid_points
from painter.robot.planners import MakeProgramPlanner
from painter.robot.true_scene import true_scene
from painter.scene.surface import is_paintable, surface_at
from perception.values import WallSegmentation

SCENES = (
    "blank",
    "cubes",
    "obstacles",
    "terrace",
    "room",
    *map("random:{}".format, range(1, 6)),
)
CELL = 0.01  # m, of the grid on which film is counted ...
FINE = 0.005  # m, ... and on which it is laid.
BORDER = 0.2  # m around the nominal tile.
_QUARTERS = (-0.375, -0.125, 0.125, 0.375)  # Of a cell, where it is sampled.


def main() -> None:
    """Prints a line for each scene."""
    print(
        "scene        coverage        CV  overspray  keep-out  program  left out  plan"
    )
    for name in sys.argv[1:] or SCENES:
        scene, _, seed = name.partition(":")
        scenario = load_scenario(scene, [f"random_seed={seed}"] if seed else [])
        wall = scan_and_segment(scenario).segmentation
        planner = MakeProgramPlanner(scenario)
        home = np.deg2rad(planner.motion.home_deg)
        start = time.process_time()
        program = planner.program(planner.strokes(wall), wall, home)
        elapsed = time.process_time() - start
        figures = film_figures(
            program.strokes, wall, scenario, program.nominal_thickness
        )
        left = sum(item.stroke.length for item in program.skipped)
        print(
            f"{name:12} "
            + "  ".join(f"{value:8.4f}" for value in figures)
            + f"  {program.motion.duration:5.1f} s  {left:5.2f} m  {elapsed:4.1f} s",
            flush=True,
        )


def film_figures(
    strokes: tuple[Stroke, ...],
    wall: WallSegmentation,
    scenario: Scenario,
    nominal: float,
) -> FilmFigures:
    """Returns the figures of strokes on the true tile."""
    scene, X_WS = true_scene(scenario)
    X_ST = X_WS.inverse() @ wall.X_WT
    ny, nx = (round(size * wall.cell / FINE) for size in wall.wall_mask.shape)
    p_SQs = X_ST @ grid_points(*cell_centres((ny, nx), FINE))
    height, kind = surface_at(scene, p_SQs[0], p_SQs[1])
    site = Site.of_tile(
        is_paintable(kind).reshape(ny, nx), FINE, height.reshape(ny, nx)
    )
    tip, speed = scenario.gun.tip, scenario.raster.speed
    film = FilmModel(site, tip=tip, speed=speed, nominal=nominal).film(strokes)

    size = tuple(round((n * FINE + 2 * BORDER) / CELL) for n in (ny, nx))
    places = grid_points(*cell_centres(size, CELL, margin=BORDER))
    height, kind = surface_at(scene, places[0], places[1])
    p_TQs = X_ST.inverse() @ np.stack([*places[:2], np.nan_to_num(height)])
    inside = (p_TQs[:2] >= 0.0) & (p_TQs[:2] < FINE * np.array([[nx], [ny]]))
    on_tile = inside.all(axis=0)
    laid = _sampled(film, site, places, X_ST)
    on, off = laid[on_tile & is_paintable(kind)], laid[on_tile & ~is_paintable(kind)]
    return FilmFigures.of(on, off, laid.sum())


def _sampled(
    film: np.ndarray, site: Site, places: np.ndarray, X_ST: RigidTransform
) -> np.ndarray:
    """Returns the mean film of the cells of S at places (3, n), m."""
    mean = np.zeros(places.shape[1])
    for dx in _QUARTERS:
        for dy in _QUARTERS:
            shift = CELL * np.array([[dx], [dy], [0.0]])
            x, y, _ = X_ST.inverse() @ (places + shift)
            columns, rows = (
                np.floor(axis / site.cell).astype(int) + site.border for axis in (x, y)
            )
            inside = (columns >= 0) & (columns < film.shape[1])
            inside &= (rows >= 0) & (rows < film.shape[0])
            mean[inside] += film[rows[inside], columns[inside]]
    return mean / len(_QUARTERS) ** 2


if __name__ == "__main__":
    main()
