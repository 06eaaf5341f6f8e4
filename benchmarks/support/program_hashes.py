"""Hashes of what is planned and segmented, to prove that a change moves no bit.

Run `python -m benchmarks.support.program_hashes --out FILE` before a change and
`... --compare FILE` after it; the exit status is 1 if anything differs. Programs are
those of all named scenes and of random seeds 1 to 20, on exact masks with noisy
heights; segmentations are those of furnished walls.
"""

import argparse
import hashlib
import json
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from benchmarks.speed.planner import wall_of
from painter.config import load_scenario
from painter.robot.planners import MakeProgramPlanner
from perception.config import SegmentationConfig
from perception.segmentation import segment_wall
from perception.synthetic.furnished_wall import TILE, furnished_wall
from perception.values import SurfaceMap

SCENES = (
    "blank",
    "cubes",
    "obstacles",
    "terrace",
    "room",
    "crowded",
    *(f"random:{seed}" for seed in range(1, 21)),
)
CLOUDS = (1, 2, 3)


def main() -> None:
    """Writes the hashes, or compares them with those of a file."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    choice = parser.add_mutually_exclusive_group(required=True)
    choice.add_argument("--out", type=Path, help="file to write")
    choice.add_argument("--compare", type=Path, help="file to compare with")
    parser.add_argument("--scenes", nargs="*", default=SCENES, help="default: all")
    options = parser.parse_args()
    found = dict(hashes(options.scenes))
    if options.out is not None:
        options.out.write_text(json.dumps(found, indent=2) + "\n")
        return
    before = json.loads(options.compare.read_text())
    differing = [name for name in found if before.get(name) != found[name]]
    print(f"{len(found) - len(differing)} of {len(found)} equal to the bit.")
    if differing:
        sys.exit(f"different: {', '.join(differing)}")


def hashes(scenes: Iterable[str]) -> Iterator[tuple[str, str]]:
    """Yields names and hashes of programs and masks."""
    planner = MakeProgramPlanner(load_scenario("blank"))
    home = np.deg2rad(planner.motion.home_deg)
    for scene in scenes:
        wall = wall_of(scene)
        program = planner.program(planner.strokes(wall), wall, home)
        strokes = [
            (*stroke.start_T, *stroke.end_T, stroke.speed, stroke.standoff, stroke.flow)
            for stroke in program.strokes
        ]
        motion = program.motion
        yield scene, digest(strokes, motion.time, motion.q, motion.v, motion.spray_on)
    for seed in CLOUDS:
        wall = furnished_wall(100_000, seed=seed)
        found = segment_wall(
            SurfaceMap.of_points(wall.p_CQs),
            wall.X_CT,
            TILE,
            config=SegmentationConfig(),
            seed=seed,
        )
        yield f"cloud:{seed}", digest(found.labels, found.depth, found.wall_mask)


def digest(*arrays: object) -> str:
    """Returns one hash of the bytes of some arrays."""
    whole = hashlib.sha256()
    for array in arrays:
        whole.update(np.ascontiguousarray(array).tobytes())
    return whole.hexdigest()[:16]


if __name__ == "__main__":
    main()
