"""Time, memory, agreement and masks of the wall segmentation beside PCL and Open3D.

Prints, for each size of a furnished wall (`perception.synthetic.furnished_wall`), the
seconds by step of the quickest of some runs, as other work on the machine can only add
to them: ours with exact and with fast filter, Open3D's plain calls for the first two
steps, and the Point Cloud Library's, in turn. "filter", "planes" and "tile" (grid and
regions) make the paper's six steps, their "total"; "cpu" is the processors' time of all
threads for these. "refine" draws the mask anew by fine steps, and "whole" is what
`segment_wall` takes. "MB" is how far the process grew at most while it ran. Then
whether the points removed and the wall agree, and who finds how much of what.

PCL's part is a program of its own; where it is comes from --peer or the variable
PCL_WALL. Without it, that part is left out, as are both peers on clouds of over a
million points, which take PCL 40 s. The whole takes about six minutes on two cores.

    python -m benchmarks.speed.segmentation [POINTS ...] [--peer PATH] [--repeats N]
"""

import argparse
import ctypes
import math
import os
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.support.wall_peers import (
    OPTIONS,
    STEPS,
    Peer,
    Times,
    time_open3d,
    timed,
)
from perception.config import SegmentationConfig
from perception.fine_steps.refine import refine_segmentation
from perception.ground import BoolArray, FloatArray
from perception.paper_steps.filters import morton_codes
from perception.paper_steps.pipeline import find_planes, segment_tile
from perception.paper_steps.planes import segment_planes
from perception.paper_steps.wall import choose_plane, wall_on_plane
from perception.synthetic.furnished_wall import (
    TILE,
    FurnishedWall,
    Thing,
    furnished_wall,
)
from perception.values import SurfaceMap, Wall

POINTS = (100_000, 250_000, 500_000, 1_000_000, 3_000_000)
ORDERED = 1_000_000
MOST_FOR_PEERS = 1_000_000
OURS = {"exact": False, "fast filter": True}  # Name, and whether the filter is fast.
COLUMNS = (*STEPS, "total", "cpu", "refine", "whole", "MB")


@dataclass(frozen=True)
class Outcome:
    """What a run of ours found.

    Attributes:
        kept: (N,) True = kept by the filter.
        wall: The wall.
        coarse: (ny, nx) wall mask of the paper's steps.
        fine: (ny, nx) wall mask of `segment_wall`.
    """

    kept: BoolArray
    wall: Wall
    coarse: BoolArray
    fine: BoolArray


def run_ours(
    wall: FurnishedWall, p_CQs: FloatArray, *, fast: bool
) -> tuple[Times, Outcome]:
    """Does and times what `segment_wall` does; the planes once more, alone."""
    config = SegmentationConfig(fast_filter=fast)
    times: Times = {}
    before = memory("VmRSS")
    cpu = time.process_time()
    with timed(times, "total"):
        found = find_planes(p_CQs, config=config, seed=0)
        with timed(times, "tile"):
            total = found.kept_count
            number = choose_plane(
                found.planes, wall.X_CT, TILE, total=total, config=config
            )
            plane = wall_on_plane(found.planes[number], wall.X_CT, TILE, total=total)
            stages = segment_tile(found, plane, number + 1, TILE, config=config)
    times["cpu"] = time.process_time() - cpu
    points = found.p_WQs.compress(found.kept, axis=1)
    with timed(times, "refine"):
        kept = SurfaceMap.of_points(points)
        fine = refine_segmentation(stages.segmentation, kept, config=config, seed=0)
    times["MB"] = (memory("VmHWM") - before) / 1e6
    times["whole"] = times["total"] + times["refine"]
    with timed(times, "planes"):
        segment_planes(points, config=config, rng=np.random.default_rng(0))
    times["filter"] = times["total"] - times["tile"] - times["planes"]
    coarse = stages.segmentation.wall_mask
    return times, Outcome(found.kept, plane, coarse, fine.wall_mask)


def memory(name: str) -> float:
    """Returns this process's memory, bytes: "VmRSS" now, or "VmHWM" at most since."""
    process = Path("/proc/self")
    if name == "VmRSS":
        ctypes.CDLL(None).malloc_trim(0)  # Gives back what is free ...
        (process / "clear_refs").write_text("5")  # ... and lets the peak start here.
    lines = (process / "status").read_text().splitlines()
    line = next(line for line in lines if line.startswith(name))
    return 1024.0 * int(line.split()[1])


def compare(points: int, *, program: str, repeats: int, ordered: bool) -> list[Times]:
    """Measures one cloud, prints the tables and returns the best runs of ours."""
    wall = furnished_wall(points, seed=1)
    p_CQs = wall.p_CQs
    if ordered:
        p_CQs = p_CQs[:, np.argsort(morton_codes(p_CQs), kind="stable")]
    print(f"\n{points} points, {'Morton' if ordered else 'random'} order, s")
    print(" " * 16, *(f"{step:>7}" for step in COLUMNS))
    peers = points <= MOST_FOR_PEERS
    with tempfile.TemporaryDirectory() as folder:
        peer = Peer(program, p_CQs, Path(folder)) if program and peers else None
        runs: dict[str, list[Times]] = {}
        outcomes = {}
        for turn in range(repeats):  # In turn, so that all meet the same machine.
            for name, fast in OURS.items():
                times, outcomes[name] = run_ours(wall, p_CQs, fast=fast)
                runs.setdefault(name, []).append(times)
            if peers and turn == 0:
                runs["Open3D, plain"] = [time_open3d(p_CQs)]  # Once will do: 18 s.
            for name in OPTIONS if peer is not None else ():
                runs.setdefault(name, []).append(peer.run(name))
        best = {name: print_times(name, some) for name, some in runs.items()}
        for name in OURS:
            for other in OPTIONS if peer is not None else ():
                ratios = (
                    f"{by} {best[name][by] / best[other][by]:.3f}"
                    for by in ("total", "cpu")
                )
                print(f"  {name} / {other}:", *ratios)
        print_agreement(wall, outcomes, peer)
    return [best[name] for name in OURS]


def print_times(name: str, runs: list[Times]) -> Times:
    """Prints and returns the figures of the quickest of some runs."""
    best = min(runs, key=lambda run: run["total"])
    cells = (
        (f"{best[step]:7.0f}" if step == "MB" else f"{best[step]:7.3f}")
        if step in best
        else f"{'-':>7}"
        for step in COLUMNS
    )
    print(f"  {name:14}", *cells)
    return best


def print_agreement(
    wall: FurnishedWall, outcomes: dict[str, Outcome], peer: Peer | None
) -> None:
    """Prints whether removed points and wall plane agree, and the masks' quality."""
    exact, fast = outcomes.values()
    print(f"  removed: {np.count_nonzero(~exact.kept)};", end=" ")
    print(
        f"otherwise by fast filter: {np.count_nonzero(fast.kept != exact.kept)}", end=""
    )
    masks = {"paper's steps": exact.coarse, "segment_wall": exact.fine}
    if peer is not None:
        print(f", PCL: {np.count_nonzero(peer.kept('PCL') != exact.kept)}", end="")
        answer = peer.answer("PCL")
        *normal, offset = answer["planes"][answer["wall"]["plane"] - 1]["abcd"]
        length = np.linalg.norm(normal)
        z_C = exact.wall.X_WT.rotation().matrix()[:, 2]
        tilt = math.asin(np.linalg.norm(np.cross(normal, z_C)) / length)
        middle = exact.wall.X_WT @ TILE.p_TC
        off = abs(normal @ middle + offset) / length
        print(f"; wall plane: {1e3 * off:.3f} mm, {math.degrees(tilt):.4f} deg", end="")
        masks["PCL"] = peer.wall_mask("PCL")
    things = [thing for thing in Thing if thing]
    print(
        "\n  mask                IoU", *(f"{thing.name.lower():>7}" for thing in things)
    )
    for name, mask in masks.items():
        recalls = (f"{wall.recall(mask, thing):7.3f}" for thing in things)
        print(f"  {name:14} {wall.iou(mask):7.4f}", *recalls)


def print_growth(best: dict[int, list[Times]]) -> None:
    """Prints the exponents of time and memory against points, fitted to all sizes."""
    points = np.log(list(best))
    print(f"\ngrowth from {min(best)} to {max(best)} points, fitted exponents")
    for name, runs in zip(OURS, zip(*best.values(), strict=True), strict=True):
        exponents = (
            f"{by} {np.polyfit(points, np.log([run[by] for run in runs]), 1)[0]:.2f}"
            for by in ("total", "whole", "MB")
        )
        print(f"  {name:14}", ", ".join(exponents))


def main() -> None:
    """Prints the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("points", nargs="*", type=int, default=POINTS)
    parser.add_argument("--peer", default=os.environ.get("PCL_WALL", ""))
    parser.add_argument("--repeats", type=int, default=3)
    args = parser.parse_args()
    options = {"program": args.peer, "repeats": args.repeats}
    if not args.peer:
        print("PCL is left out: neither --peer nor PCL_WALL says where pcl_wall is.")
    best = {n: compare(n, **options, ordered=False) for n in args.points}
    if len(best) > 1:
        print_growth(best)
    if ORDERED in best:
        compare(ORDERED, **options, ordered=True)


if __name__ == "__main__":
    main()
