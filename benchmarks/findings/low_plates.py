"""Low steps in a scanned scene: plates whose edges lie anywhere on the tile's grid.

Each scene holds three plates of 20 x 20 cm raised 10 mm and one panel of that size
20 mm behind the wall, one in each quarter of the tile, at a place drawn to the
millimetre; the wall is off by up to 1 cm and 0.5 degrees. It is looked at, scanned
from 0.7 m and segmented in full simulation. A cell is a plate's if a ray through its
centre meets it; false cells are cells of wall that are lost, at the edges too.

    python -m benchmarks.findings.low_plates [SEEDS]
"""

import sys
import tempfile
from pathlib import Path

import numpy as np
from scipy import ndimage

from benchmarks.support.scanned_scenes import scan_and_segment
from painter.config import load_scenario
from painter.scene import SurfaceKind

SIZE = 0.2  # Of a plate, m.
QUARTERS = ((0.15, 0.15), (1.15, 0.15), (0.15, 1.15), (1.15, 1.15))  # Lower left, m.
PLAY = 0.5  # A plate's lower left corner lies up to so far from its quarter's, m.


def write_scene(folder: Path, seed: int) -> Path:
    """Writes a scene and a scenario for it; returns the scenario's file."""
    rng = np.random.default_rng(seed)
    corners = np.round(np.array(QUARTERS) + rng.uniform(0.0, PLAY, (4, 2)), 3)
    (x, y), plates = corners[0], corners[1:] + SIZE / 2
    error = dict(zip("xyz", rng.uniform(-0.01, 0.01, 3), strict=True))
    turns = zip(("roll", "pitch", "yaw"), rng.uniform(-0.5, 0.5, 3), strict=True)
    error |= {f"{name}_deg": turn for name, turn in turns}
    lines = [
        "plates:",
        "  wall: {color: [0.80, 0.82, 0.84]}",
        "  openings:",
        f"  - {{kind: door, x: {x:.3f}, y: {y:.3f}, width: {SIZE}, height: {SIZE},"
        " recess: 0.02, frame_width: 0.02, panel_share: 1.0}",
        "  objects:",
        *(
            f"  - {{name: plate{number}, size: [{SIZE}, {SIZE}, 0.01],"
            f" position: [{x:.3f}, {y:.3f}, 0.005]}}"
            for number, (x, y) in enumerate(plates)
        ),
        "  base_error: {" + ", ".join(f"{k}: {v:.4f}" for k, v in error.items()) + "}",
    ]
    scene = folder / f"plates_{seed}.scene.yaml"
    scene.write_text("\n".join(lines) + "\n")
    scenario = folder / f"plates_{seed}.scenario.yaml"
    scenario.write_text(f"plates:\n  scene: {scene}\n")
    return scenario


def main() -> None:
    """Prints a row a scene and the figures over all."""
    seeds = range(1, 1 + (int(sys.argv[1]) if len(sys.argv) > 1 else 3))
    print("seed    raised found  worst plate    recess found   false cells", flush=True)
    rows = []
    for seed in seeds:
        with tempfile.TemporaryDirectory() as folder:
            scenario = load_scenario(str(write_scene(Path(folder), seed)), [])
            result = scan_and_segment(scenario)
        kind, lost = result.kind, ~result.segmentation.wall_mask
        plates, count = ndimage.label(kind == SurfaceKind.OBJECT)
        each = ndimage.mean(lost, plates, np.arange(1, count + 1))
        wall = kind == SurfaceKind.WALL
        recess = ~wall & (plates == 0)
        rows.append(
            (
                lost[plates > 0].mean(),
                each.min(),
                lost[recess].mean(),
                lost[wall].mean(),
            )
        )
        raised, worst, behind, false = rows[-1]
        print(
            f"{seed:4d}  {raised:14.2%} {worst:12.2%} {behind:15.2%} {false:12.3%}",
            f"({np.count_nonzero(lost & wall)} of {np.count_nonzero(wall)})",
            flush=True,
        )
    raised, worst, behind, false = np.transpose(rows)
    print(
        f"mean  {raised.mean():14.2%} {worst.min():12.2%} {behind.mean():15.2%}"
        f" {false.mean():12.3%}"
    )


if __name__ == "__main__":
    main()
