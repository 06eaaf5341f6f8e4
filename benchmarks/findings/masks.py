"""Quality of the mask over all named scenes and 20 random ones.

Each scene is looked at, scanned and segmented in full simulation; nothing is painted.
Prints each scene's figures as it is done, and those over all. With `--out` the rows are
kept as they come, with a picture each, and a run that was stopped goes on behind them;
about 25 s of one core a scene.
"""

import os

# One thread a process: the scenes run side by side.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import json
import logging
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import matplotlib.image
import numpy as np
from scipy import ndimage

from benchmarks.support.scanned_scenes import ScannedScene, scan_and_segment
from painter.config import load_scenario
from painter.run.figures.mask_figures import edge_errors, mask_iou
from painter.scene import SurfaceKind, is_paintable
from perception.fine_steps.unseen import Reason

# The sixth named scene, "random", is random:1.
JOBS = ["blank", "cubes", "obstacles", "room", "terrace"]
JOBS += [f"random:{seed}" for seed in range(1, 21)]
WIDE = 0.05  # Objects at least so wide must be found, m.
LOST = (Reason.UNSEEN, Reason.SHADOW, Reason.GLASS)
PIXELS = 4  # Of a cell in a picture.
COLORS = {
    "wall": (235, 235, 235),
    "off": (90, 90, 90),
    "painted": (40, 90, 255),  # Off the wall, but in the mask.
    "lost": (255, 40, 40),  # Wall that was seen and is not in the mask.
    Reason.UNSEEN: (255, 160, 0),  # Wall that was not, and why.
    Reason.SHADOW: (255, 220, 0),
    Reason.GLASS: (0, 200, 200),
}


def measure(job: str, out: Path | None = None) -> dict:
    """Returns the figures of one job, "scenario" or "scenario:seed", as JSON takes it.

    Args:
        job: Which.
        out: Folder for its picture, if that is wanted.
    """
    name, _, seed = job.partition(":")
    scene = scan_and_segment(
        load_scenario(name, [f"random_seed={seed}"] if seed else [])
    )
    segmentation = scene.segmentation
    mask, truth = segmentation.wall_mask, is_paintable(scene.kind)
    unseen = np.isin(segmentation.reason, LOST)
    errors = edge_errors(mask, truth, segmentation.cell)
    # The same where wall that no picture shows counts as it is.
    seen = edge_errors(np.where(unseen, truth, mask), truth, segmentation.cell)
    if out is not None:
        path = out / f"{job.replace(':', '-')}.png"
        matplotlib.image.imsave(path, draw(scene))
    return {
        "job": job,
        "iou": mask_iou(mask, truth),
        "errors": [] if errors is None else errors.round(4).tolist(),
        "seen": [] if seen is None else seen.round(4).tolist(),
        "unseen": int(np.count_nonzero(unseen & truth)),
        "missed": missed_objects(mask, scene.kind, segmentation.cell),
        "scan_s": scene.scan_time,
        "compute_s": scene.compute_time,
    }


def missed_objects(mask: np.ndarray, kind: np.ndarray, cell: float) -> int:
    """Counts objects that a WIDE square fits into and that are mostly in the mask."""
    objects = kind == SurfaceKind.OBJECT
    square = np.ones((round(WIDE / cell) - 1,) * 2)
    parts, count = ndimage.label(objects)
    missed = 0
    for number in range(1, count + 1):
        own = parts == number
        if ndimage.binary_opening(own, square).any() and mask[own].mean() > 0.5:
            missed += 1
    return missed


def draw(scene: ScannedScene) -> np.ndarray:
    """Draws mask over truth, (h, w, 3) uint8, as seen from the robot."""
    mask, truth = scene.segmentation.wall_mask, is_paintable(scene.kind)
    picture = np.empty((*mask.shape, 3), dtype=np.uint8)
    picture[:] = COLORS["off"]
    picture[truth & mask] = COLORS["wall"]
    picture[truth & ~mask] = COLORS["lost"]
    picture[mask & ~truth] = COLORS["painted"]
    for reason in LOST:
        lost = truth & ~mask & (scene.segmentation.reason == reason)
        picture[lost] = COLORS[reason]
    return np.kron(picture[::-1], np.ones((PIXELS, PIXELS, 1), dtype=np.uint8))


def rows_of(jobs: list[str], processes: int, out: Path | None) -> Iterator[dict]:
    """Yields the rows of all jobs in order; those in `out` are not measured again."""
    path = None if out is None else out / "rows.jsonl"
    done = {}
    if path is not None and path.exists():
        done = {row["job"]: row for row in map(json.loads, path.open())}
    with ProcessPoolExecutor(processes) as pool:
        running = {
            job: pool.submit(measure, job, out) for job in jobs if job not in done
        }
        for job in jobs:
            if job in done:
                yield done[job]
                continue
            row = running[job].result()
            if path is not None:
                with path.open("a") as file:
                    file.write(json.dumps(row) + "\n")
            yield row


def spread(errors: list[float]) -> tuple[float, float]:
    """Returns median and 95th percentile, mm; zeros if there is no edge."""
    if not errors:
        return 0.0, 0.0
    median, high = 1000 * np.percentile(errors, [50, 95])
    return float(median), float(high)


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", default=JOBS, help='"cubes", "random:7"')
    parser.add_argument("--jobs", type=int, default=2, help="scenes at a time")
    parser.add_argument("--out", type=Path, help="folder of rows and pictures")
    arguments = parser.parse_args()
    logging.getLogger("drake").setLevel(logging.WARNING)
    if arguments.out is not None:
        arguments.out.mkdir(parents=True, exist_ok=True)
    print(
        "scene          iou  edge mm: p50  p95  of seen: p50  p95  unseen  missed"
        "  scan s"
    )
    rows = []
    for row in rows_of(arguments.scenes, arguments.jobs, arguments.out):
        rows.append(row)
        edge, seen = spread(row["errors"]), spread(row["seen"])
        print(
            f"{row['job']:12s} {row['iou']:.4f}       {edge[0]:4.0f} {edge[1]:4.0f}"
            f"          {seen[0]:4.0f} {seen[1]:4.0f}  {row['unseen']:6d}"
            f"  {row['missed']:6d}  {row['scan_s']:6.1f}",
            flush=True,
        )
    summarise(rows)


def summarise(rows: list[dict]) -> None:
    """Prints what holds over all rows."""
    overlaps = np.array([row["iou"] for row in rows])
    print(f"iou: median {np.median(overlaps):.4f}, worst {overlaps.min():.4f}")
    for name, what in (("errors", "edge error"), ("seen", "the same of seen wall")):
        pooled = spread([error for row in rows for error in row[name]])
        each = np.array([spread(row[name]) for row in rows])
        print(
            f"{what}: p50 {pooled[0]:.0f}, p95 {pooled[1]:.0f} mm over all cells; "
            f"p95 of a scene: median {np.median(each[:, 1]):.0f}, worst "
            f"{each[:, 1].max():.0f} mm; over 20 mm in "
            f"{np.count_nonzero(each[:, 1] > 20.0 + 1e-6)} scenes"
        )
    print(f"objects missed: {sum(row['missed'] for row in rows)}")


if __name__ == "__main__":
    main()
