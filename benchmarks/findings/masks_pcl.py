"""Masks of a made-up wall beside the Point Cloud Library's, on the same clouds.

For each size of cloud, over some seeds of the generator
(`perception.synthetic.furnished_wall`): overlap (IoU) of the mask with the truth and
recall of each thing, as mean and worst, of the paper's steps, of `segment_wall` and of
PCL's `pcl_wall`; and by how much `segment_wall` is ahead of PCL on one and the same
cloud. The truth is what lies at the centres of cells, by geometry.

    python -m benchmarks.findings.masks_pcl [POINTS ...] [--peer PATH] [--seeds N]

--peer or the variable PCL_WALL says where `pcl_wall` is; without it PCL is left out.
"""

import argparse
import os
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.support.wall_peers import Peer
from perception.config import SegmentationConfig
from perception.ground import BoolArray
from perception.paper_steps.pipeline import find_planes, segment_tile
from perception.paper_steps.wall import choose_plane, wall_on_plane
from perception.segmentation import segment_wall
from perception.synthetic.furnished_wall import (
    TILE,
    FurnishedWall,
    Thing,
    furnished_wall,
)
from perception.values import SurfaceMap

POINTS = (100_000, 500_000, 1_000_000)
THINGS = tuple(thing for thing in Thing if thing)


def masks(wall: FurnishedWall, program: str) -> dict[str, BoolArray]:
    """Returns the masks of one cloud by what made them."""
    config = SegmentationConfig()
    found = find_planes(wall.p_CQs, config=config, seed=0)
    total = found.kept_count
    number = choose_plane(found.planes, wall.X_CT, TILE, total=total, config=config)
    plane = wall_on_plane(found.planes[number], wall.X_CT, TILE, total=total)
    tile = segment_tile(found, plane, number + 1, TILE, config=config)
    whole = segment_wall(
        SurfaceMap.of_points(wall.p_CQs), wall.X_CT, TILE, config=config, seed=0
    )
    result = {
        "paper's steps": tile.segmentation.wall_mask,
        "segment_wall": whole.wall_mask,
    }
    if program:
        with tempfile.TemporaryDirectory() as folder:
            peer = Peer(program, wall.p_CQs, Path(folder))
            peer.run("PCL parallel")
            result["PCL"] = peer.wall_mask("PCL parallel")
    return result


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("points", nargs="*", type=int, default=POINTS)
    parser.add_argument("--peer", default=os.environ.get("PCL_WALL", ""))
    parser.add_argument("--seeds", type=int, default=8)
    args = parser.parse_args()
    columns = ["IoU", *(thing.name.lower() for thing in THINGS)]
    print(f"mean and worst of seeds 1 to {args.seeds}")
    print(" " * 24, *(f"{name:>13}" for name in columns))
    for points in args.points:
        figures: dict[str, list[list[float]]] = {}
        for seed in range(1, args.seeds + 1):
            wall = furnished_wall(points, seed=seed)
            for name, mask in masks(wall, args.peer).items():
                recalls = (wall.recall(mask, thing) for thing in THINGS)
                figures.setdefault(name, []).append([wall.iou(mask), *recalls])
        tables = {name: np.array(rows) for name, rows in figures.items()}
        if args.peer:
            tables["ahead of PCL"] = tables["segment_wall"] - tables["PCL"]
        for name, table in tables.items():
            cells = (
                f"{mean:6.4f} {worst:6.4f}"
                for mean, worst in zip(
                    np.mean(table, axis=0), table.min(axis=0), strict=True
                )
            )
            print(f"{points:9d} {name:14}", *cells, flush=True)


if __name__ == "__main__":
    main()
