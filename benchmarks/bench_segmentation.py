"""Time and quality of the wall segmentation over the size of the cloud.

Prints, for each size, the median seconds of filter and planes (steps 1 and 2), of the
tile (steps 3 to 6) and of both, and the mask's overlap with the truth. Clouds are made
up; other sizes: `python benchmarks/bench_segmentation.py POINTS ...`.
"""

import statistics
import sys
import time

import numpy as np
from pydrake.math import RigidTransform

from perception.config import SegmentationConfig
from perception.segmentation import find_planes, segment_tile
from perception.synthetic import synthetic_truth, synthetic_wall
from perception.wall import choose_plane, wall_on_plane

POINTS = (100_000, 300_000, 1_000_000)
REPEATS = 3
SIZE = {"width": 2.0, "height": 2.0}
# Edge of the square that `synthetic_wall` fills: the tile and its margin, m.
EDGE = 2.4


def measure(points: int) -> tuple[int, float, float, float]:
    """Returns points made, median seconds of steps 1-2 and 3-6, and the mask's IoU."""
    config = SegmentationConfig()
    X_WT = RigidTransform()
    p_WQs = synthetic_wall(
        spacing=EDGE / np.sqrt(points),
        outliers=points // 500,
        rng=np.random.default_rng(0),
    )
    plane_times, tile_times = [], []
    for _ in range(REPEATS):
        start = time.perf_counter()
        found = find_planes(p_WQs, config=config, seed=1)
        middle = time.perf_counter()
        number = choose_plane(
            found.planes, X_WT, **SIZE, total=found.kept_count, config=config
        )
        wall = wall_on_plane(found.planes[number], X_WT, **SIZE, total=found.kept_count)
        steps = segment_tile(found, wall, number + 1, **SIZE, config=config)
        plane_times.append(middle - start)
        tile_times.append(time.perf_counter() - middle)
    mask, truth = steps.segmentation.wall_mask, synthetic_truth()
    iou = np.count_nonzero(mask & truth) / np.count_nonzero(mask | truth)
    planes_s, tile_s = map(statistics.median, (plane_times, tile_times))
    return p_WQs.shape[1], planes_s, tile_s, iou


def main() -> None:
    """Prints the table."""
    print("   points  planes_s  tile_s  total_s  mask_iou")
    for points in map(int, sys.argv[1:] or POINTS):
        count, planes_s, tile_s, iou = measure(points)
        total_s = planes_s + tile_s
        print(f"{count:9d}  {planes_s:8.2f}  {tile_s:6.2f}  {total_s:7.2f}  {iou:8.4f}")


if __name__ == "__main__":
    main()
