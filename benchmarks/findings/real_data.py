"""Runs `painter segment` over the recordings of `shared/data/real`.

    python -m benchmarks.findings.real_data --out DIR
    python -m benchmarks.findings.real_data --out DIR --check docs/real-data.md

Writes a folder a recording and `table.md`, which docs/real-data.md holds; with --check
it fails if that file holds another table.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import open3d as o3d

from benchmarks.support.real_cases import CASES, Case, Rectangle
from perception.io.clouds import read_cloud, read_fields
from perception.io.depth_images import read_depth
from perception.io.segmentations import load_segmentation
from perception.values import WallSegmentation

DATA = Path(os.environ.get("PAINTER_DATA", "../shared/data")) / "real"
LEAST_WALL, MOST_WALL = 0.9, 0.1  # Of a rectangle that is wall; that is not.
HIDDEN = 0.05  # m behind what the gun meets first.
HEAD = "| recording | correct result | found | |\n| --- | --- | --- | --- |"


def make_input(case: Case, folder: Path) -> Path:
    """Returns the file to segment; makes what the recordings lack."""
    path = DATA / case.name
    if "--intrinsics=guessed_intrinsics.json" in case.words:
        # The README's guess for the plants.
        guess = {"width": 1280, "height": 720, "fx": 910, "fy": 910}
        words = json.dumps({**guess, "cx": 640, "cy": 360})
        (folder / "guessed_intrinsics.json").write_text(words)
    if case.name == "rgbd_sequence_with_poses":
        return fused_sequence(path, folder / "fused.npy", max_range=3.0)
    return path


def fused_sequence(folder: Path, out: Path, *, max_range: float) -> Path:
    """Fuses depth images at their given poses, a point a 5 mm voxel."""
    clouds = []
    for path in sorted(folder.glob("*.depth.png")):
        X_WC = np.loadtxt(path.with_name(path.name.replace("depth.png", "pose.txt")))
        p_CQs = read_depth(path, folder / "intrinsics.json")
        p_CQs = p_CQs[:, p_CQs[2] <= max_range]
        clouds.append(X_WC[:3, :3] @ p_CQs + X_WC[:3, 3:])
    cloud = o3d.geometry.PointCloud(
        o3d.utility.Vector3dVector(np.concatenate(clouds, axis=1).T)
    )
    np.save(out, np.asarray(cloud.voxel_down_sample(0.005).points))
    return out


def share_of_wall(result: WallSegmentation, rectangle: Rectangle) -> float:
    """Returns the share of a rectangle of the README's wall frame that is wall.

    Raises:
        ValueError: The rectangle is not on the tile.
    """
    foot = result.X_WT.inverse() @ np.zeros(3)  # The sensor, seen straight on.
    left, bottom, right, top = rectangle
    rows = _cells(bottom + foot[1], top + foot[1], result.cell)
    columns = _cells(left + foot[0], right + foot[0], result.cell)
    ny, nx = result.wall_mask.shape
    wall = result.wall_mask[
        rows[(rows >= 0) & (rows < ny)][:, None],
        columns[(columns >= 0) & (columns < nx)],
    ]
    # What is not on the tile is not painted.
    return float(wall.sum() / (rows.size * columns.size))


def _cells(low: float, high: float, cell: float) -> Any:
    return np.arange(round(low / cell), round(high / cell))


def precision_recall(
    result: WallSegmentation, case: Case, limit: float
) -> tuple[float, float]:
    """Compares points with labels by people; all finite points count.

    What the gun meets in a cell is "wall" if the cell is in the mask. Of a point behind
    that, which only a sensor that looks at a slant sees, the mask says nothing: it is
    wall if it lies within `limit`, m, of the wall's plane.
    """
    points = read_cloud(DATA / case.name).p_WQs
    labels = read_fields(DATA / case.name)["label"].ravel()
    p_TQs = result.X_WT.inverse() @ points
    ny, nx = result.wall_mask.shape
    with np.errstate(invalid="ignore"):
        columns, rows = np.floor(p_TQs[:2] / result.cell).astype(int)
    finite = np.isfinite(points).all(axis=0)
    inside = finite & (columns >= 0) & (columns < nx) & (rows >= 0) & (rows < ny)
    cells = (rows[inside], columns[inside])
    z = p_TQs[2, inside]
    front = np.full((ny, nx), -np.inf)
    np.maximum.at(front, cells, z)
    hidden = z < front[cells] - HIDDEN
    level = np.abs(z) <= limit
    said = np.zeros(labels.size, dtype=bool)
    said[inside] = np.where(hidden, level, result.wall_mask[cells])
    truth = np.isin(labels, case.labels) & finite
    hits = np.count_nonzero(said & truth)
    return hits / np.count_nonzero(said), hits / np.count_nonzero(truth)


def judge(case: Case, folder: Path) -> tuple[list[str], list[str]]:
    """Returns what was found, and what of it is wrong."""
    figures = json.loads((folder / "segmentation.json").read_text())
    result = load_segmentation(folder / "segmentation.npz")
    distance, share = figures["wall_distance_m"], figures["wall_point_share"]
    found = [f"{distance:.3f} m", f"{share:.0%} of points"]
    found.append(f"rms {1e3 * figures['wall_rms_m']:.1f} mm")
    wrong = []
    if case.distance is None:
        return found, ["a wall where there is none"]
    if abs(distance - case.distance) > case.tolerance:
        wrong.append(f"not at {case.distance:g} ± {case.tolerance:g} m")
    if not case.share[0] <= share <= case.share[1]:
        wrong.append(f"share not {case.share[0]:.0%} to {case.share[1]:.0%}")
    for name, rectangles, bounds in (
        ("wall", case.wall, (LEAST_WALL, 1.0)),
        ("not wall", case.not_wall, (0.0, MOST_WALL)),
    ):
        for rectangle in rectangles:
            part = share_of_wall(result, rectangle)
            found.append(f"{name}: {part:.0%} painted")
            if not bounds[0] <= part <= bounds[1]:
                wrong.append(f"{name} {part:.0%} painted")
    if case.least_filled:
        part = float(result.wall_mask[result.labels > 0].mean())
        found.append(f"{part:.1%} of what was seen is wall")
        if part < case.least_filled:
            wrong.append(f"under {case.least_filled:.0%} wall")
    if case.labels:
        pair = precision_recall(result, case, figures["inlier_distance_m"])
        found.append("precision {:.3f}, recall {:.3f}".format(*pair))
        if any(value < least for value, least in zip(pair, case.least, strict=True)):
            wrong.append("under {:g} / {:g}".format(*case.least))
    return found, wrong


def run(case: Case, out: Path) -> tuple[str, bool]:
    """Segments a recording; returns its row of the table and whether it is right."""
    name = Path(case.name).with_suffix("").as_posix().replace("/", "-")
    folder = (out / name).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    path = make_input(case, folder).resolve()
    words = [word.replace("{data}", str(DATA.resolve())) for word in case.words]
    program = Path(sys.executable).with_name("painter")
    start = time.perf_counter()
    done = subprocess.run(
        [program, "segment", path, "--out", folder, *words],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    seconds = time.perf_counter() - start
    if done.returncode == 0:
        found, wrong = judge(case, folder)
    else:
        found = [f"refused: {done.stderr.strip().removeprefix('painter: error: ')}"]
        refused = done.returncode == 1 and case.distance is None
        wrong = [] if refused else [f"exit {done.returncode}"]
    verdict = f"**fail**: {'; '.join(wrong)}" if wrong else "pass"
    row = f"| {case.name} | {_expected(case)} | {', '.join(found)} | {verdict} |"
    print(f"{seconds:5.1f} s {row}", flush=True)
    return row, not wrong


def _expected(case: Case) -> str:
    if case.distance is None:
        return case.truth
    return f"{case.distance:.3f} m; {case.truth}"


def main() -> None:
    """Runs all cases, or those whose name holds a word."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder for the result")
    parser.add_argument("--only", default="", help="cases whose name holds this")
    parser.add_argument("--check", type=Path, help="file that is to hold the table")
    arguments = parser.parse_args()
    if not DATA.is_dir():
        raise SystemExit(f"no recordings in {DATA}; set PAINTER_DATA")
    arguments.out.mkdir(parents=True, exist_ok=True)
    chosen = [case for case in CASES if arguments.only in case.name]
    done = [run(case, arguments.out) for case in chosen]
    table = "\n".join([HEAD, *(row for row, _ in done)]) + "\n"
    (arguments.out / "table.md").write_text(table)
    print(f"{sum(right for _, right in done)} of {len(done)} right")
    if arguments.check and table not in arguments.check.read_text():
        raise SystemExit(f"{arguments.check} holds another table than {arguments.out}")


if __name__ == "__main__":
    main()
