"""Planning time of a 10 x 6 m facade, one core, without the first import.

Run `python -m benchmarks.speed.facade`. Every base position's tile is bare; its program
is planned and verified as one of a single tile is. Joints: predicted film, least and
most over the nominal one, farther than 15 cm from the wall's own edges, with every
second base_position where it should be and 5 mm off.
"""

import time

import numpy as np

from painter.config import load_scenario
from painter.errors import PainterError
from painter.planning.film.deposition import mean_film, predicted_film
from painter.planning.spray_path import Stroke
from painter.planning.strokes.facade import BasePosition, plan_base_positions
from painter.planning.strokes.spray_settings import SpraySettings
from painter.planning.tile import grid_shape, nominal_tile_pose
from painter.robot.planners import MakeProgramPlanner
from perception.values import WallSegmentation

CELL = 0.01
SIZES = ((2.0, 2.0), (5.0, 2.0), (10.0, 6.0))


def main() -> None:
    """Prints a line for each size of wall."""
    job = load_scenario("blank")
    planner = MakeProgramPlanner(job)
    shape = grid_shape(job.tile, CELL)
    wall = WallSegmentation(
        labels=np.ones(shape, dtype=np.uint16),
        depth=np.zeros(shape, dtype=np.float32),
        wall_mask=np.ones(shape, dtype=bool),
        X_WT=nominal_tile_pose(job.tile),
        cell=CELL,
    )
    home = np.deg2rad(job.motion.home_deg)
    print(
        "wall        positions  lay out  plan     each       painting  film, 5 mm off"
    )
    for width, height in SIZES:
        start = time.process_time()
        base_positions = plan_base_positions(
            width, height, SpraySettings(job.gun.tip, job.raster), tile=job.tile
        )
        laid = time.process_time() - start
        start = time.process_time()
        painting = 0.0
        for number, base_position in enumerate(base_positions):
            try:
                strokes = centred(base_position, job.tile.width)
                program = planner.program(strokes, wall, home)
            except PainterError as error:
                print(f"base position {number + 1}: {error}")
                continue
            painting += program.motion.duration
        planned = time.process_time() - start
        films = [
            joint_film(base_positions, width, height, job, off) for off in (0.0, 0.005)
        ]
        ranges = ", ".join(f"{low:.2f} to {high:.2f}" for low, high in films)
        print(
            f"{width:4.0f} x {height:.0f} m {len(base_positions):8d} {laid:8.2f} s "
            f"{planned:5.1f} s {planned / len(base_positions):9.2f} s "
            f"{painting:7.0f} s  "
            f"{ranges}"
        )


def centred(base_position: BasePosition, width: float) -> list[Stroke]:
    """Returns a position's strokes in the tile that is centred on the base axis."""
    shift = np.array([(width - base_position.width) / 2.0, 0.0])
    return [
        stroke.replace(start_T=stroke.start_T + shift, end_T=stroke.end_T + shift)
        for stroke in base_position.strokes
    ]


def joint_film(
    base_positions: tuple[BasePosition, ...],
    width: float,
    height: float,
    job,
    off: float,
) -> tuple[float, float]:
    """Returns least and most film over nominal; every second position is off."""
    strokes = [
        stroke.replace(
            start_T=stroke.start_T + off * (number % 2),
            end_T=stroke.end_T + off * (number % 2),
        )
        for number, base_position in enumerate(base_positions)
        for stroke in base_position.strokes_on_wall
    ]
    x = np.arange(CELL / 2.0, width, CELL)
    y = np.arange(CELL / 2.0, height, CELL)
    pitch = SpraySettings(job.gun.tip, job.raster).nominal_pitch(width)
    nominal = mean_film(job.gun.tip, speed=job.raster.speed, pitch=pitch)
    film = predicted_film(strokes, x, y, tip=job.gun.tip) / nominal
    inside = film[15:-15, 15:-15]
    return float(inside.min()), float(inside.max())


if __name__ == "__main__":
    main()
