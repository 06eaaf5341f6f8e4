"""Quality of the mask over all named scenes and 20 random ones.

Each scene is looked at, scanned and segmented in full simulation; nothing is painted.
Prints each scene's figures and those over all. Other jobs: `python
benchmarks/bench_masks.py cubes random:7 ...`; about 25 s each on one core.
"""

import os

# One thread a process: the scenes run side by side.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import sys
from concurrent.futures import ProcessPoolExecutor

import numpy as np
from scanned_scenes import scan_and_segment
from scipy import ndimage

from painter.config import load_scenario
from painter.run.mask_figures import edge_errors, mask_iou
from painter.scene import SurfaceKind, is_paintable
from perception.unseen import Reason

JOBS = ["blank", "cubes", "obstacles", "room", "terrace"]
JOBS += [f"random:{seed}" for seed in range(1, 21)]
PROCESSES = 2
WIDE = 0.05  # Objects at least so wide must be found, m.


def measure(job: str) -> dict:
    """Returns the figures of one job, "scenario" or "scenario:seed"."""
    name, _, seed = job.partition(":")
    scenario = load_scenario(name, [f"random_seed={seed}"] if seed else [])
    segmentation, kind, seconds = scan_and_segment(scenario)
    mask, truth = segmentation.wall_mask, is_paintable(kind)
    shadow = segmentation.reason == Reason.SHADOW
    errors = edge_errors(mask, truth, segmentation.cell)
    # The same where cells that no picture shows, for a shadow, count as they are.
    lit = edge_errors(np.where(shadow, truth, mask), truth, segmentation.cell)
    return {
        "job": job,
        "iou": mask_iou(mask, truth),
        "errors": np.zeros(0) if errors is None else errors,
        "lit": np.zeros(0) if lit is None else lit,
        "shadow": int(np.count_nonzero(shadow & truth)),
        "missed": missed_objects(mask, kind, segmentation.cell),
        "seconds": seconds,
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


def _spread(errors: np.ndarray) -> str:
    if errors.size == 0:
        return "   -    -"
    median, high = 1000 * np.percentile(errors, [50, 95])
    return f"{median:4.0f} {high:4.0f}"


def main() -> None:
    """Prints the table."""
    print("scene          iou  edge mm: p50  p95  lit: p50 p95  shadow  missed  time")
    rows = []
    with ProcessPoolExecutor(PROCESSES) as pool:
        for row in pool.map(measure, sys.argv[1:] or JOBS):
            rows.append(row)
            print(
                f"{row['job']:12s} {row['iou']:.4f}        {_spread(row['errors'])}"
                f"      {_spread(row['lit'])}  {row['shadow']:6d}  {row['missed']:6d}"
                f"  {row['seconds']:.1f} s",
                flush=True,
            )
    overlaps = np.array([row["iou"] for row in rows])
    print(f"iou: median {np.median(overlaps):.4f}, worst {overlaps.min():.4f}")
    for name in ("errors", "lit"):
        pooled = np.concatenate([row[name] for row in rows])
        worst = max(
            (np.percentile(r[name], 95) for r in rows if r[name].size), default=0
        )
        print(
            f"{name}, all cells, p50 p95: {_spread(pooled)} mm; "
            f"worst scene's p95 {1000 * worst:.0f} mm"
        )
    print(f"objects missed: {sum(row['missed'] for row in rows)}")


if __name__ == "__main__":
    main()
