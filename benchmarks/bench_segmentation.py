"""Time, agreement and mask quality of the wall segmentation beside PCL and Open3D.

Prints, for each size of a furnished wall (`perception.furnished_wall`), medians of
seconds by step: the paper's six steps with exact and with fast filter, Open3D's plain
calls for the first two, and the Point Cloud Library's, side by side in one run. "total"
and the steps are wall-clock time, "cpu" the processors' time of all threads, and a
ratio is given by both: on a machine that others use, only the last can be trusted.
Then whether the points removed and the wall agree, and who finds how much of what.

PCL's part is a program of its own, PREFIX.json and PREFIX.csv out of IN.ply; where it
is comes from --peer or the variable PCL_WALL. Without it, that part is left out.

    python benchmarks/bench_segmentation.py [POINTS ...] [--peer PATH] [--repeats N]
"""

import argparse
import json
import math
import os
import statistics
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import open3d as o3d

from perception.config import SegmentationConfig
from perception.filters import morton_codes, statistical_filter
from perception.furnished_wall import EDGE, FurnishedWall, Thing, furnished_wall
from perception.planes import segment_planes
from perception.segmentation import find_planes, segment_tile, segment_wall
from perception.values import BoolArray, FloatArray
from perception.wall import choose_plane, wall_on_plane

POINTS = (100_000, 500_000, 1_000_000, 3_000_000)
SIZE = {"width": EDGE, "height": EDGE}
PEERS = {
    "PCL": (),
    "PCL parallel": ("--sor", "omp", "--ransac-threads", "0"),
}
# Steps of ours and, by name in the peer's JSON file, of PCL.
STEPS = {
    "filter": ("sor",),
    "planes": ("ransac",),
    "tile": ("resample", "split_euclid", "split_cc", "tiny", "sort"),
}
COLUMNS = (*STEPS, "total", "cpu")
Times = dict[str, float]


@contextmanager
def timed(times: Times, name: str) -> Iterator[None]:
    """Adds the seconds of a block to `times[name]`."""
    start = time.perf_counter()
    yield
    times[name] = times.get(name, 0.0) + time.perf_counter() - start


def time_ours(wall: FurnishedWall, p_CQs: FloatArray, *, fast: bool) -> Times:
    """Times the paper's six steps; filter and planes again alone, and the whole."""
    config = SegmentationConfig(fast_filter=fast)
    times: Times = {}
    cpu = time.process_time()
    with timed(times, "total"):
        found = find_planes(p_CQs, config=config, seed=0)
        with timed(times, "tile"):
            size = {**SIZE, "total": found.kept_count}
            number = choose_plane(found.planes, wall.X_CT, **size, config=config)
            plane = wall_on_plane(found.planes[number], wall.X_CT, **size)
            segment_tile(found, plane, number + 1, **SIZE, config=config)
    times["cpu"] = time.process_time() - cpu
    points = found.p_WQs[:, found.kept]
    with timed(times, "planes"):
        segment_planes(
            points,
            threshold=config.distance_threshold,
            stop_fraction=config.stop_fraction,
            max_planes=config.max_planes,
            rng=np.random.default_rng(0),
        )
    times["filter"] = times["total"] - times["tile"] - times["planes"]
    return times


def time_open3d(p_CQs: FloatArray) -> Times:
    """Times Open3D's plain calls for filter and planes, as its tutorial has them."""
    times: Times = {}
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(p_CQs.T.copy()))
    cpu = time.process_time()
    with timed(times, "filter"):
        cloud, _ = cloud.remove_statistical_outlier(51, 3.5)
    least = 0.005 * p_CQs.shape[1]
    with timed(times, "planes"):
        for _ in range(20):
            if len(cloud.points) < least:
                break
            _, inliers = cloud.segment_plane(0.03, 3, 1000)
            cloud = cloud.select_by_index(inliers, invert=True)
    times["total"] = times["filter"] + times["planes"]
    times["cpu"] = time.process_time() - cpu
    return times


class Peer:
    """The Point Cloud Library's program, run on one cloud."""

    def __init__(self, program: str, p_CQs: FloatArray, folder: Path) -> None:
        """Saves the cloud for the program `program` in a folder."""
        self._program = program
        self._cloud = folder / "cloud.ply"
        self._prefix = folder / "out"
        points = o3d.core.Tensor(np.ascontiguousarray(p_CQs.T.astype(np.float32)))
        o3d.t.io.write_point_cloud(str(self._cloud), o3d.t.geometry.PointCloud(points))

    def run(self, *options: str) -> Times:
        """Runs the program and returns its seconds by step, without loading."""
        subprocess.run(
            [self._program, self._cloud, "-o", self._prefix, *options]
            + ["--dump-kept", self._prefix.with_suffix(".kept")],
            check=True,
            stdout=subprocess.DEVNULL,
        )
        seconds = self.answer["seconds"]
        cpu = self.answer["cpu_seconds"]["total_without_load"]
        times = {
            step: sum(seconds[name] for name in names) for step, names in STEPS.items()
        }
        return {**times, "total": seconds["total_without_load"], "cpu": cpu}

    @property
    def answer(self) -> dict:
        """What the last run wrote of itself."""
        return json.loads(self._prefix.with_suffix(".json").read_text())

    @property
    def kept(self) -> BoolArray:
        """(N,) True = kept by the last run's filter."""
        return np.fromfile(self._prefix.with_suffix(".kept"), dtype=np.bool_)

    @property
    def wall_mask(self) -> BoolArray:
        """(ny, nx) the last run's wall: all regions of the wall's plane; row 0 low."""
        labels = np.loadtxt(self._prefix.with_suffix(".csv"), delimiter=",", dtype=int)
        answer = self.answer
        wall = [
            region["label"]
            for region in answer["regions"]
            if region["plane"] == answer["wall"]["plane"]
        ]
        return np.isin(labels, wall)[::-1]


def print_times(name: str, runs: list[Times]) -> Times:
    """Prints and returns the medians of some runs' seconds by step."""
    medians = {
        step: statistics.median(run[step] for run in runs if step in run)
        for step in COLUMNS
        if step in runs[0]
    }
    cells = (f"{medians.get(step, math.nan):8.3f}" for step in COLUMNS)
    print(f"  {name:18}", *cells)
    return medians


def print_quality(name: str, wall: FurnishedWall, mask: BoolArray) -> None:
    """Prints a mask's overlap with the truth and the recall of each thing."""
    recalls = (f"{wall.recall(mask, thing):8.3f}" for thing in Thing if thing)
    print(f"  {name:18}", f"{wall.iou(mask):8.4f}", *recalls)


def compare(points: int, *, program: str, repeats: int, ordered: bool) -> Times:
    """Measures one cloud, prints the tables and returns the totals."""
    wall = furnished_wall(points, seed=1)
    p_CQs = wall.p_CQs
    if ordered:
        p_CQs = p_CQs[:, np.argsort(morton_codes(p_CQs), kind="stable")]
    order = "Morton" if ordered else "random"
    print(f"\n{points} points, {order} order, s")
    print(" " * 20, *(f"{step:>8}" for step in COLUMNS))
    with tempfile.TemporaryDirectory() as folder:
        peer = Peer(program, p_CQs, Path(folder)) if program else None
        jobs = {
            "exact": lambda: time_ours(wall, p_CQs, fast=False),
            "fast filter": lambda: time_ours(wall, p_CQs, fast=True),
            "Open3D, plain": lambda: time_open3d(p_CQs),
        }
        if peer is not None:
            for name, options in PEERS.items():
                jobs[name] = lambda options=options: peer.run(*options)
        runs: dict[str, list[Times]] = {name: [] for name in jobs}
        for _ in range(repeats):  # In turn, so that all meet the same machine.
            for name, job in jobs.items():
                runs[name].append(job())
        medians = {name: print_times(name, some) for name, some in runs.items()}
        for name in ("exact", "fast filter"):
            for other in PEERS if peer is not None else ():
                ratios = (medians[name][by] / medians[other][by] for by in COLUMNS[-2:])
                print(f"  {name} / {other}:", *(f"{ratio:.3f}" for ratio in ratios))
        if not ordered:
            print_agreement(wall, peer)
    return {name: median["total"] for name, median in medians.items()}


def print_agreement(wall: FurnishedWall, peer: Peer | None) -> None:
    """Prints whether removed points and wall plane agree, and the masks' quality."""
    p_CQs = wall.p_CQs
    config = SegmentationConfig()
    options = {
        "neighbors": config.neighbors,
        "std_multiplier": config.std_multiplier,
    }
    keep = statistical_filter(p_CQs, **options)
    fast = statistical_filter(p_CQs, **options, fast=True)
    print(f"  removed: {np.count_nonzero(~keep)}; ", end="")
    print(f"otherwise by the fast filter: {np.count_nonzero(fast != keep)}", end="")
    found = find_planes(p_CQs, config=config, seed=0)
    size = {**SIZE, "total": found.kept_count}
    number = choose_plane(found.planes, wall.X_CT, **size, config=config)
    plane = wall_on_plane(found.planes[number], wall.X_CT, **size)
    if peer is not None:
        peer.run()
        print(f", by PCL: {np.count_nonzero(peer.kept != keep)}")
        *normal, offset = peer.answer["planes"][peer.answer["wall"]["plane"] - 1][
            "abcd"
        ]
        z_C = plane.X_WT.rotation().matrix()[:, 2]
        tilt = np.linalg.norm(np.cross(normal, z_C)) / np.linalg.norm(normal)
        middle = plane.X_WT @ np.array([EDGE / 2, EDGE / 2, 0.0])
        off = abs(normal @ middle + offset) / np.linalg.norm(normal)
        print(
            f"  wall planes apart: {1e3 * off:.3f} mm,",
            f"{math.degrees(math.asin(tilt)):.4f} deg",
            end="",
        )
    names = (f"{thing.name.lower():>8}" for thing in Thing if thing)
    print("\n  mask              ", "     IoU", *names)
    tile = segment_tile(found, plane, number + 1, **SIZE, config=config)
    print_quality("paper's steps", wall, tile.segmentation.wall_mask)
    whole = segment_wall(p_CQs, wall.X_CT, **SIZE, config=config, seed=0)
    print_quality("segment_wall", wall, whole.wall_mask)
    if peer is not None:
        print_quality("PCL", wall, peer.wall_mask)


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
    totals = {n: compare(n, **options, ordered=False) for n in args.points}
    compare(1_000_000, **options, ordered=True)
    low, high = min(totals), max(totals)
    if low < high:
        print(f"\ngrowth from {low} to {high} points, exponent")
        for name in totals[low]:
            ratio = totals[high][name] / totals[low][name]
            print(f"  {name:18} {math.log(ratio) / math.log(high / low):.2f}")


if __name__ == "__main__":
    main()
