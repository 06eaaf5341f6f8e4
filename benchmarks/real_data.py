"""Runs the segmentation over the recordings of `shared/data/real`.

    python -m benchmarks.real_data --out DIR

What is right comes from the recordings' README and `expected.json`. Writes a picture a
recording and `table.md`, which docs/real-data.md holds.
"""

import argparse
import dataclasses
import json
import os
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import open3d as o3d

from painter.run.segmentation_picture import segmentation_picture
from perception.cloud_io import read_cloud, read_depth
from perception.config import SegmentationConfig
from perception.errors import NoWallError
from perception.recorded import segment_recorded
from perception.segmentation import SegmentationSteps
from perception.values import FloatArray

DATA = Path(os.environ.get("PAINTER_DATA", "../shared/data")) / "real"
UP = {
    "z": [0.0, 0.0, 1.0],
    "-z": [0.0, 0.0, -1.0],
    "y": [0, 1.0, 0],
    "-y": [0, -1.0, 0],
}
Rectangle = tuple[float, float, float, float]  # Left, bottom, right, top.


@dataclasses.dataclass(frozen=True, kw_only=True)
class Case:
    """A recording, how to segment it and what is right.

    `distance` (m, from the sensor) and `tolerance` are of the wall's plane; with
    `expect_distance` the segmentation is told it, as a robot would be. Rectangles are
    in the README's wall frame (X right, Y up, from the foot of the perpendicular).
    """

    name: str
    distance: float | None
    tolerance: float = 0.02
    tile: tuple[float, float] = (2.0, 2.0)
    cell: float = 0.01
    up: str | None = None
    threshold: float = 0.03
    wall: tuple[Rectangle, ...] = ()
    not_wall: tuple[Rectangle, ...] = ()
    labels: Callable[[Path], FloatArray] | None = None
    max_range: float = np.inf
    expect_distance: bool = False


def _facade_labels(path: Path) -> FloatArray:
    cloud = o3d.t.io.read_point_cloud(str(path))
    return cloud.point["label"].numpy().ravel() == 0


def _table_labels(path: Path) -> FloatArray:
    labels = o3d.t.io.read_point_cloud(str(path)).point["label"].numpy().ravel()
    return (labels >= 1) & (labels <= 9)


SCAN = {"tile": (4.0, 4.0), "cell": 0.05, "up": "-z"}
ARM = "d415_on_robot_arm"
CASES = (
    Case(
        name="painting_robot_wall_scans/02_protruding_wall.pcd",
        distance=1.840,
        wall=((-1.5, -1.6, 1.4, 0.35),),
        not_wall=((-1.5, 0.5, 1.4, 1.15),),
        **SCAN,
    ),
    Case(
        name="painting_robot_wall_scans/03_wall_between_two_windows.pcd",
        distance=0.997,
        wall=((-0.2, -1.65, 0.95, 0.5),),
        not_wall=((-0.55, -1.6, -0.3, 0.5), (1.25, -1.6, 1.75, 0.5)),
        **SCAN,
    ),
    Case(
        name="painting_robot_wall_scans/05_wall_and_door.pcd",
        distance=1.510,
        wall=((-0.2, -1.6, 1.0, 0.5),),
        not_wall=((-0.34, -1.1, -0.27, -0.8),),
        **SCAN,
    ),
    Case(
        name="painting_robot_wall_scans/09_plain_wall.pcd",
        distance=1.429,
        wall=((-1.1, -1.65, 0.8, 1.0),),
        **SCAN,
    ),
    Case(
        name="painting_robot_wall_scans/10_wall_with_small_columns.pcd",
        distance=1.134,
        wall=((-0.8, -1.65, 0.45, 1.0),),
        not_wall=((0.52, -1.6, 0.63, 1.0), (0.87, -1.6, 0.91, 1.0)),
        **SCAN,
    ),
    Case(
        name="facade_laser_scans_labelled/building_1.ply",
        distance=93.109,
        tolerance=0.05,
        tile=(22.0, 12.0),
        cell=0.05,
        up="z",
        labels=_facade_labels,
    ),
    Case(
        name="facade_laser_scans_labelled/building_3.ply",
        distance=124.372,
        tolerance=0.05,
        tile=(24.0, 9.0),
        cell=0.05,
        up="z",
        labels=_facade_labels,
    ),
    Case(
        name="tabletop_objects_labelled/test0.pcd", distance=0.586, labels=_table_labels
    ),
    Case(
        name="tabletop_objects_labelled/test50.pcd",
        distance=0.587,
        labels=_table_labels,
    ),
    Case(name=f"{ARM}/table_0p50m/depth_0.png", distance=0.504, tile=(1.2, 1.2)),
    Case(name=f"{ARM}/table_0p50m/depth_1.png", distance=0.505, tile=(1.2, 1.2)),
    Case(name=f"{ARM}/table_0p80m_empty/depth_0.png", distance=0.796, tile=(1.2, 1.2)),
    Case(name=f"{ARM}/table_0p80m_empty/depth_1.png", distance=0.796, tile=(1.2, 1.2)),
    Case(name=f"{ARM}/table_0p80m_cable/depth_0.png", distance=0.796, tile=(1.2, 1.2)),
    Case(name=f"{ARM}/table_0p80m_cable/depth_1.png", distance=0.796, tile=(1.2, 1.2)),
    Case(
        name="d415_static_table/depth_00.png",
        distance=0.631,
        tile=(1.2, 1.2),
        max_range=1.0,
    ),
    Case(
        name="d435_tabletop/data1_depth_0.png",
        distance=0.151,
        tile=(0.8, 0.8),
        cell=0.005,
        max_range=0.55,
        threshold=0.006,
    ),
    Case(name="d435_room/wall_close_with_bag.ply", distance=0.99, up="y"),
    Case(
        name="d435_room/wall_with_open_doorway.ply",
        distance=2.95,
        tolerance=0.15,
        tile=(4.0, 4.0),
        cell=0.03,
        threshold=0.06,
        up="y",
        expect_distance=True,
    ),
    Case(
        name="d435_room/room_corner.ply",
        distance=3.15,
        tolerance=0.08,
        tile=(4.0, 4.0),
        cell=0.03,
        up="y",
        threshold=0.06,
    ),
    Case(name="realsense_floor_objects/one_cube.ply", distance=0.534),
    Case(
        name="d435_fused_map/room_map.pcd",
        distance=1.93,
        tolerance=0.08,
        tile=(7.0, 2.0),
        cell=0.03,
        up="-y",
    ),
    Case(name="rgbd_sequence_with_poses", distance=2.867, tile=(3.0, 3.0)),
    Case(name="kinect_office_views/capture0001.pcd", distance=2.45, tile=(3.0, 3.0)),
    Case(name="kinect_office_views/capture0003.pcd", distance=2.52, tile=(3.0, 3.0)),
    Case(name="kinect_office_views/capture0005.pcd", distance=2.61, tile=(3.0, 3.0)),
    Case(name="depth_camera_box/caixa.ply", distance=None, tile=(1.0, 1.0)),
    Case(name="d435i_no_wall/plants_day_depth.png", distance=None),
)


def read(case: Case, folder: Path) -> FloatArray:
    """Reads a recording in its own frame, m."""
    path = DATA / case.name
    if path.is_dir():
        return read_sequence(path, max_range=3.0)
    if path.suffix == ".png":
        places = (path.parent / "intrinsics.json", path.parents[1] / "intrinsics.json")
        camera = next((place for place in places if place.exists()), None)
        if camera is None:  # The README's guess for the plants.
            camera = folder / "guessed_intrinsics.json"
            guess = {"width": 1280, "height": 720, "fx": 910, "fy": 910}
            camera.write_text(json.dumps({**guess, "cx": 640, "cy": 360}))
        points = read_depth(path, camera)
        return points[:, points[2] <= case.max_range]
    return read_cloud(path)


def read_sequence(folder: Path, *, max_range: float) -> FloatArray:
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
    return np.asarray(cloud.voxel_down_sample(0.005).points).T


def share_of_wall(steps: SegmentationSteps, rectangle: Rectangle) -> float:
    """Returns the share of a rectangle of the README's wall frame that is wall."""
    result = steps.segmentation
    foot = result.X_WT.inverse() @ np.zeros(3)  # The sensor, seen straight on.
    left, bottom, right, top = rectangle
    rows = slice(*(round((y + foot[1]) / result.cell) for y in (bottom, top)))
    columns = slice(*(round((x + foot[0]) / result.cell) for x in (left, right)))
    return float(result.wall_mask[rows, columns].mean())


def precision_recall(
    steps: SegmentationSteps, truth: FloatArray, points: FloatArray
) -> tuple[float, float]:
    """Compares points in cells of the mask, within 5 cm of the wall, with labels."""
    truth = truth[np.isfinite(points).all(axis=0)]
    result = steps.segmentation
    p_TQs = result.X_WT.inverse() @ steps.found.p_WQs
    columns, rows = np.floor(p_TQs[:2] / result.cell).astype(int)
    ny, nx = result.wall_mask.shape
    inside = (columns >= 0) & (columns < nx) & (rows >= 0) & (rows < ny)
    said = inside & (np.abs(p_TQs[2]) <= 0.05)
    said[said] = result.wall_mask[rows[said], columns[said]]
    hits = np.count_nonzero(said & truth)
    return hits / np.count_nonzero(said), hits / np.count_nonzero(truth)


def judge(case: Case, steps: SegmentationSteps, points: FloatArray) -> tuple[bool, str]:
    """Says whether the plane and the mask are right, and what was found."""
    plane = steps.found.planes[steps.wall_plane - 1]
    distance = abs(plane.offset)
    right = case.distance is not None
    words = [f"{distance:.3f} m", f"{steps.wall.inlier_share:.0%}"]
    words.append(f"rms {1e3 * steps.wall.rms:.1f} mm")
    if case.distance is not None:
        right &= abs(distance - case.distance) <= case.tolerance
    for rectangle in case.wall:
        share = share_of_wall(steps, rectangle)
        right &= share >= 0.9
        words.append(f"wall {share:.0%}")
    for rectangle in case.not_wall:
        share = share_of_wall(steps, rectangle)
        right &= share <= 0.1
        words.append(f"not wall {1.0 - share:.0%}")
    if case.labels is not None:
        precision, recall = precision_recall(
            steps, case.labels(DATA / case.name), points
        )
        words.append(f"precision {precision:.3f}, recall {recall:.3f}")
    return bool(right), ", ".join(words)


def run(case: Case, folder: Path) -> str:
    """Segments a recording, draws it, and returns its row of the table."""
    points = read(case, folder)
    config = SegmentationConfig(cell=case.cell, distance_threshold=case.threshold)
    start = time.perf_counter()
    try:
        steps = segment_recorded(
            points,
            width=case.tile[0],
            height=case.tile[1],
            config=config,
            seed=1,
            up_W=None if case.up is None else np.array(UP[case.up]),
            distance=case.distance if case.expect_distance else None,
        )
    except NoWallError as error:
        right, found = case.distance is None, f"no wall ({error})"
    else:
        right, found = judge(case, steps, points)
        name = Path(case.name).with_suffix("").as_posix().replace("/", "-")
        segmentation_picture(folder / f"{name}.png", steps, title=case.name)
    seconds = time.perf_counter() - start
    wanted = "no wall" if case.distance is None else f"{case.distance:.3f} m"
    row = f"| {case.name} | {wanted} | {found} | {'yes' if right else '**no**'} |"
    print(f"{seconds:5.1f} s {row}", flush=True)
    return row


def main() -> None:
    """Runs all cases, or those whose name holds a word."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder for the result")
    parser.add_argument("--only", default="", help="cases whose name holds this")
    arguments = parser.parse_args()
    if not DATA.is_dir():
        raise SystemExit(f"no recordings in {DATA}; set PAINTER_DATA")
    arguments.out.mkdir(parents=True, exist_ok=True)
    rows = [run(case, arguments.out) for case in CASES if arguments.only in case.name]
    head = ["| recording | expected | found | right |", "| --- | --- | --- | --- |"]
    (arguments.out / "table.md").write_text("\n".join([*head, *rows]) + "\n")


if __name__ == "__main__":
    main()
