"""Planning time of a tile by stage, one core, without the first import.

Run `taskset -c 0 python -m benchmarks.speed.planner [SCENE ...]`; a scene is the name
of a scenario, `random:SEED` or `crowded`, which has ten boxes. Edges of masks are exact
and heights as noisy as a map gives them; a cycle's planning is that of the masks that
it has sensed. Times are of the processor, the median of some runs. With `--bound`
the exit status is 1 if a scene takes longer.
"""

import argparse
import math
import statistics
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any
from unittest import mock

import numpy as np

from painter.config import load_scenario
from painter.cycle.true_wall import true_segmentation
from painter.planning.program import connect_strokes, program
from painter.planning.program.program import ProgramPlanner
from painter.planning.strokes import raster
from painter.robot.planners import MakeProgramPlanner
from perception.values import WallSegmentation

SCENES = ("blank", "cubes", "obstacles", "terrace", "room", "random:1", "crowded")
# What is timed, under the name that the module which calls it knows it by.
STAGES: dict[str, tuple[Any, str]] = {
    "lines": (raster, "place_lines"),
    "cut-ins": (raster, "find_cut_ins"),
    "fit": (raster.FilmFit, "fit"),
    "cut back": (program, "clear_strokes"),
    "order": (connect_strokes, "order_strokes"),
    "transitions": (connect_strokes, "join_all"),
    "verify": (program, "verify_motion"),
    "verify strokes": (program, "verify_strokes"),
}
NOISE = 0.002  # m, of mapped heights.
# x, y, width, height in T and height over the wall, m: five in each of two columns,
# nowhere in one line, so that each wants cut-ins of its own.
CROWD = [
    (x + 0.03 * row, 0.2 + 0.36 * row + dy, 0.14, 0.12, 0.08)
    for x, dy in ((0.45, 0.0), (1.25, 0.09))
    for row in range(5)
]


def main() -> None:
    """Prints a line for each scene: the median of some runs, s."""
    options = parsed()
    planner = MakeProgramPlanner(load_scenario("blank"))
    plan(planner, wall_of("blank"))  # What is loaded and cached once is not counted.
    print(f"{'scene':10} strokes   total  " + "  ".join(STAGES) + "  rest")
    late = []
    for scene in options.scenes:
        wall = wall_of(scene)
        runs = [timed(planner, wall) for _ in range(options.repeats)]
        total = statistics.median(total for _, total, _ in runs)
        stages = {
            name: statistics.median(stages[name] for _, _, stages in runs)
            for name in STAGES
        }
        cells = [f"{stages[name]:{len(name)}.2f}" for name in STAGES]
        cells.append(f"{total - sum(stages.values()):4.2f}")
        print(f"{scene:10} {runs[0][0]:7d} {total:5.2f} s  " + "  ".join(cells))
        if total > options.bound:
            late.append(f"{scene} {total:.2f} s")
    if late:
        sys.exit(f"over {options.bound:g} s: {', '.join(late)}")


def parsed() -> argparse.Namespace:
    """Returns what was asked for on the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument(
        "scenes",
        nargs="*",
        default=SCENES,
        metavar="SCENE",
        help=f"scenario, random:SEED or crowded; default {' '.join(SCENES)}",
    )
    parser.add_argument(
        "--repeats", type=int, default=3, help="runs of each scene; default 3"
    )
    parser.add_argument(
        "--bound",
        type=float,
        default=math.inf,
        help="most time of a scene, s; exit status 1 if one takes longer; default none",
    )
    options = parser.parse_args()
    if options.repeats < 1:
        parser.error(f"--repeats must be >= 1, got {options.repeats}.")
    return options


def wall_of(scene: str) -> WallSegmentation:
    """Returns the segmentation of a scene, heights noisy."""
    name, _, seed = scene.partition(":")
    crowded = name == "crowded"
    job = load_scenario(
        "blank" if crowded else name, [f"random_seed={seed}"] if seed else []
    )
    wall = true_segmentation(job)
    depth, mask = np.array(wall.depth), np.array(wall.wall_mask)
    for x, y, width, height, top in CROWD if crowded else ():
        rows, columns = (
            slice(round(low / wall.cell), round((low + size) / wall.cell))
            for low, size in ((y, height), (x, width))
        )
        depth[rows, columns], mask[rows, columns] = top, False
    noise = np.random.default_rng(1).normal(0.0, NOISE, depth.shape)
    depth = (depth + noise).astype(np.float32)
    return wall.replace(depth=depth, wall_mask=mask)


def plan(planner: ProgramPlanner, wall: WallSegmentation) -> int:
    """Plans a tile as the cycle does; returns how many strokes it has."""
    home = np.deg2rad(planner.motion.home_deg)
    return len(planner.program(planner.strokes(wall), wall, home).strokes)


def timed(
    planner: ProgramPlanner, wall: WallSegmentation
) -> tuple[int, float, dict[str, float]]:
    """Returns the strokes of a tile, the time of the planning, and that by stage, s."""
    with stage_times() as stages:
        start = time.process_time()
        strokes = plan(planner, wall)
        total = time.process_time() - start
    return strokes, total, stages


@contextmanager
def stage_times() -> Iterator[dict[str, float]]:
    """Adds up the time of each stage while the block runs."""
    spent = dict.fromkeys(STAGES, 0.0)

    def clocked(name: str, call: Callable) -> Callable:
        def run(*args: Any, **kwargs: Any) -> Any:
            start = time.process_time()
            try:
                return call(*args, **kwargs)
            finally:
                spent[name] += time.process_time() - start

        return run

    with ExitStack() as stack:
        for name, (owner, function) in STAGES.items():
            call = clocked(name, getattr(owner, function))
            stack.enter_context(mock.patch.object(owner, function, call))
        yield spent


if __name__ == "__main__":
    main()
