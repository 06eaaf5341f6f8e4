"""Paint cycles with a misplaced base and a misaligned camera mount.

`python -m benchmarks.findings.misplaced --out runs/misplaced` paints all named scenes
with the base 2 cm and 2 deg from where the job has it and the camera 3 mm and 0.3 deg
from its modelled mount, both at once, and compares them with the README's bounds.
"""

import argparse
import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.cycles import SCENES, simulate
from painter.scene import dump_scene, load_scene
from painter.scene.config import BaseErrorConfig

# Directions of the errors: each of the six axes alike, signs mixed.
BASE = np.array([1.0, -1.0, 1.0]) / np.sqrt(3.0)
MOUNT = np.array([1.0, -1.0, 1.0]) / np.sqrt(3.0)
BASE_SHIFT, BASE_TURN_DEG = 0.020, 2.0
MOUNT_SHIFT, MOUNT_TURN_DEG = 0.003, 0.3
AT_LEAST = {"mask_iou": 0.95, "coverage": 0.85}
AT_MOST = {"collisions": 0, "overspray": 0.10, "mass_balance_error": 0.001}
BLANK_COVERAGE = 0.95
CYCLE_TIME = 150.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--out", type=Path, default=Path("runs/misplaced"), help="folder of the runs"
    )
    parser.add_argument("--scenes", nargs="*", default=[*SCENES, "random"])
    parser.add_argument(
        "--sign", type=float, default=1.0, help="-1 = all errors turned"
    )
    parser.add_argument("--jobs", type=int, default=2, help="runs at a time")
    words = parser.parse_args()
    words.out.mkdir(parents=True, exist_ok=True)

    def run(scene: str) -> dict[str, Any]:
        return painted(scene, words.sign, words.out)

    with ThreadPoolExecutor(words.jobs) as pool:
        for scene, figures in zip(
            words.scenes, pool.map(run, words.scenes), strict=True
        ):
            print(row(scene, figures), flush=True)


def painted(scene: str, sign: float, out: Path) -> dict[str, Any]:
    """Paints one scene with all errors and returns its figures."""
    x, y, z = (sign * BASE_SHIFT * BASE).tolist()
    roll, pitch, yaw = (sign * BASE_TURN_DEG * BASE).tolist()
    moved = load_scene(scene, 1)
    moved.base_error = BaseErrorConfig(
        x=x, y=y, z=z, roll_deg=roll, pitch_deg=pitch, yaw_deg=yaw
    )
    path = out / f"{scene}.scene.yaml"
    path.write_text(dump_scene(moved))
    settings = [
        f"scene={path}",
        f"wall_camera.mount_error_m={(sign * MOUNT_SHIFT * MOUNT).tolist()}",
        f"wall_camera.mount_error_deg={(sign * MOUNT_TURN_DEG * MOUNT).tolist()}",
    ]
    simulate(scene, 1, out / scene, settings)
    report: dict[str, Any] = json.loads((out / scene / "report.json").read_text())
    return report


def row(scene: str, figures: dict[str, Any]) -> str:
    """Returns a line with a scene's figures and which bounds it misses."""
    if figures.get("result", "DONE") != "DONE":
        return f"{scene}: {figures['result']}: {figures['cause']}"
    bounds = AT_LEAST | ({"coverage": BLANK_COVERAGE} if scene == "blank" else {})
    missed = [name for name, bound in bounds.items() if figures[name] < bound]
    missed += [name for name, bound in AT_MOST.items() if figures[name] > bound]
    cycle_time = figures["timing"]["cycle_time_s"]
    missed += ["cycle_time_s"] if cycle_time > CYCLE_TIME else []
    names = (*AT_LEAST, *AT_MOST, "wall_tilt_error_deg", "wall_distance_error_m")
    values = ", ".join(f"{name} {figures[name]:.4g}" for name in names)
    offset = [round(1000.0 * value, 1) for value in figures["tile_offset_m"]]
    return (
        f"{scene}: {values}, tile_offset_mm {offset}, cycle_time_s {cycle_time:.0f}; "
        f"{'misses ' + ', '.join(missed) if missed else 'all met'}"
    )


if __name__ == "__main__":
    main()
