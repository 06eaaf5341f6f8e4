"""Simulates whole paint cycles and prints their figures as one table.

python -m benchmarks.cycles --out runs/cycles            # the named scenes
python -m benchmarks.cycles --out runs/cycles --seeds 20 # and random ones

With --keep a run that is there is not repeated: what was broken off goes on.
"""

import argparse
import json
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

SCENES = ("blank", "cubes", "obstacles", "terrace", "room")
FIGURES = (
    "mask_iou",
    "coverage",
    "thickness_cv",
    "thickness_cv_interior",
    "overspray",
    "keepout_paint",
    "collisions",
    "mass_balance_error",
    "tip_error_rms_m",
    "gun_angle_error_max_deg",
    "speed_within_2pct",
    "motion_time_s",
)
TIMING = ("compute_time_s", "cycle_time_s", "wall_clock_s")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder of the runs")
    parser.add_argument("--scenes", nargs="*", default=SCENES, help="named scenarios")
    parser.add_argument("--seeds", type=int, default=1, help="random scenes 1 to N")
    parser.add_argument("--jobs", type=int, default=1, help="runs at a time")
    parser.add_argument("--set", nargs="*", default=[], help="KEY=VALUE over all")
    parser.add_argument(
        "--keep", action="store_true", help="keep runs that are there, settings or not"
    )
    arguments = parser.parse_args()
    jobs = [(scene, 1) for scene in arguments.scenes]
    jobs += [("random", seed) for seed in range(1, arguments.seeds + 1)]

    def run(job: tuple[str, int]) -> dict[str, Any]:
        folder = arguments.out / f"{job[0]}-{job[1]}"
        report = folder / "report.json"
        if not (arguments.keep and report.is_file()):
            simulate(*job, folder, arguments.set)
        return json.loads(report.read_text())

    rows = []
    print("| scene | " + " | ".join((*FIGURES, *TIMING)) + " |")
    print("| --- " * (1 + len(FIGURES) + len(TIMING)) + "|")
    with ThreadPoolExecutor(arguments.jobs) as pool:
        for (scene, seed), figures in zip(jobs, pool.map(run, jobs), strict=True):
            name = f"{scene} {seed}" if scene == "random" else scene
            rows.append([name, figures])
            print(row(name, figures), flush=True)
    drawn = [figures for name, figures in rows if name.startswith("random")]
    if len(drawn) > 1:
        for name, statistic in (
            ("median", np.median),
            ("least", np.min),
            ("most", np.max),
        ):
            summary = {
                key: float(statistic([f[key] for f in drawn if f.get(key) is not None]))
                for key in FIGURES
            }
            print(row(f"random, {name}", summary))


def simulate(scene: str, seed: int, folder: Path, settings: list[str]) -> None:
    """Runs `painter simulate` in a process of its own."""
    painter = Path(sys.executable).with_name("painter")
    words = [word for setting in settings for word in ("--set", setting)]
    subprocess.run(
        [painter, "simulate", scene, "--seed", str(seed), "--no-replay", *words]
        + ["--out", folder],
        capture_output=True,
        check=False,  # A cycle that ends in FAULT is a row, too.
    )


def row(name: str, figures: dict[str, Any]) -> str:
    """Returns a line of the table; a cycle that did not end says why."""
    if figures.get("result", "DONE") != "DONE":
        return f"| {name} | {figures['result']}: {figures['cause']} |"
    values = [figures.get(key) for key in FIGURES]
    values += [figures.get("timing", {}).get(key) for key in TIMING]
    cells = ["" if value is None else f"{value:.3g}" for value in values]
    return f"| {name} | " + " | ".join(cells) + " |"


if __name__ == "__main__":
    main()
