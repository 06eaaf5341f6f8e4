"""A run folder made from geometry: a wall with a window and a box, no simulator."""

import numpy as np
import pytest
from pydrake.math import RigidTransform

from painter.config import Scenario, dump_scenario
from painter.planning.config import TileConfig
from painter.planning.spray_path import Motion, PaintProgram, Stroke
from painter.planning.tile import nominal_tile_pose
from painter.run.folder.folder import RunFolder
from painter.run.folder.values import Executed, Film, Truth
from perception.values import SurfaceMap, WallSegmentation

CELL = 0.01
SPEED = 0.6
STANDOFF = 0.30
NOMINAL = 100e-6
EFFICIENCY = 0.65
# x0, x1, y0, y1 in T, m: a window 80 mm deep and a box 60 mm proud.
WINDOW = (0.60, 1.20, 0.80, 1.60)
BOX = (1.50, 1.70, 0.30, 0.50)
BOX_KIND, GLASS_KIND = 5, 3


def rectangle(x, y, sides):
    return (x >= sides[0]) & (x < sides[1]) & (y >= sides[2]) & (y < sides[3])


def cell_grid(size, cell, start=0.0):
    centres = start + (np.arange(round(size / cell)) + 0.5) * cell
    return np.meshgrid(centres, centres)


@pytest.fixture
def segmentation():
    x, y = cell_grid(2.0, CELL)
    labels = np.ones(x.shape, dtype=np.uint16)
    labels[rectangle(x, y, WINDOW)] = 2
    labels[rectangle(x, y, BOX)] = 3
    depth = np.select([labels == 2, labels == 3], [-0.08, 0.06], 0.0)
    return WallSegmentation(
        labels=labels,
        depth=depth.astype(np.float32),
        wall_mask=labels == 1,
        X_WT=nominal_tile_pose(TileConfig()),
        cell=CELL,
    )


@pytest.fixture
def truth(segmentation):
    return Truth(
        wall_mask=segmentation.wall_mask.copy(),
        X_WS=segmentation.X_WT,
        source="Rectangles of this test",
    )


@pytest.fixture
def surface_map(segmentation):
    x, y = cell_grid(2.2, 0.01, start=-0.1)
    z = np.select([rectangle(x, y, WINDOW), rectangle(x, y, BOX)], [-0.08, 0.06], 0.0)
    p_TQs = np.stack([x.ravel(), y.ravel(), z.ravel()])
    normal = segmentation.X_WT.rotation().matrix()[:, 2]
    return SurfaceMap(
        p_WQs=segmentation.X_WT @ p_TQs,
        normals_W=np.repeat(normal[:, None], x.size, axis=1).astype(np.float32),
        counts=np.full(x.size, 9),
        variances=np.full(x.size, 1e-6, dtype=np.float32),
        frames=20,
    )


def make_strokes():
    """Vertical strokes 0.125 m apart, up and down in turn, cut by window and box."""
    strokes = []
    for column in range(16):
        x = 0.0625 + 0.125 * column
        gaps = [s[2:] for s in (WINDOW, BOX) if s[0] <= x < s[1]]
        ends = [0.0, *(y for gap in gaps for y in gap), 2.0]
        pieces = [(ends[i], ends[i + 1]) for i in range(0, len(ends), 2)]
        if column % 2:
            pieces = [(end, start) for start, end in reversed(pieces)]
        strokes += [
            Stroke(np.array([x, a]), np.array([x, b]), SPEED, "body", column)
            for a, b in pieces
        ]
    return tuple(strokes)


def gun_poses(X_WT, points_T):
    """Gun square on the wall at `points_T` (n, 2): G z into it, G x along T x."""
    X_WG = np.empty((len(points_T), 4, 4))
    R_TG = np.diag([1.0, -1.0, -1.0])
    for pose, point in zip(X_WG, points_T, strict=True):
        X_TG = np.eye(4)
        X_TG[:3, :3], X_TG[:3, 3] = R_TG, [*point, STANDOFF]
        pose[:] = X_WT @ X_TG
    return X_WG


def make_run(strokes, period=0.01):
    """Times, points on the wall and trigger of strokes joined by 0.5 s ways."""
    points, trigger = [], []
    for i, stroke in enumerate(strokes):
        steps = round(stroke.length / SPEED / period)
        points.append(np.linspace(stroke.start_T, stroke.end_T, steps + 1))
        trigger.append(np.ones(steps + 1))
        if i + 1 < len(strokes):
            way = np.linspace(stroke.end_T, strokes[i + 1].start_T, 51)[1:-1]
            points.append(way)
            trigger.append(np.zeros(len(way)))
    points, trigger = np.concatenate(points), np.concatenate(trigger)
    return period * np.arange(len(points)), points, trigger


@pytest.fixture
def program(segmentation):
    strokes = make_strokes()
    time, _, trigger = make_run(strokes)
    edges = np.flatnonzero(np.diff(np.concatenate([[0.0], trigger, [0.0]])))
    motion = Motion(
        time=time,
        q=np.zeros((time.size, 5)),
        v=np.zeros((time.size, 5)),
        spray_on=np.append(time, time[-1] + 0.01)[edges].reshape(-1, 2),
    )
    return PaintProgram(
        strokes=strokes,
        motion=motion,
        X_WT=segmentation.X_WT,
        standoff=STANDOFF,
        nominal_thickness=NOMINAL,
    )


@pytest.fixture
def executed(program):
    """The program from 40 s on, with the gun 1 mm to the right of its command."""
    time, points, trigger = make_run(program.strokes)
    X_WT = program.X_WT.GetAsMatrix4()
    return Executed(
        time=40.0 + time,
        q=np.zeros((time.size, 5)),
        v=np.zeros((time.size, 5)),
        trigger=trigger,
        X_WG=gun_poses(X_WT, points + np.array([0.001, 0.0])),
        X_WG_desired=gun_poses(X_WT, points),
    )


@pytest.fixture
def film():
    """Strokes of cross profile (1 - x²/a²)² smeared over each stroke's length."""
    size, cell, start, a = 2.2, 0.01, -0.1, 0.125
    x, y = cell_grid(size, cell, start)
    kind = np.ones(x.shape, dtype=np.uint8)
    kind[rectangle(x, y, WINDOW)] = GLASS_KIND
    kind[rectangle(x, y, BOX)] = BOX_KIND
    thickness = np.zeros(x.shape)
    for stroke in make_strokes():
        low, high = sorted([stroke.start_T[1], stroke.end_T[1]])
        across = np.clip(1 - ((x - stroke.start_T[0]) / a) ** 2, 0, None) ** 2
        along = np.clip(0.5 + (y - low) / 0.05, 0, 1) * np.clip(
            0.5 + (high - y) / 0.05, 0, 1
        )
        # Integral of the profile over x is 16/15 a; strokes are 0.125 m apart.
        thickness += NOMINAL * 0.125 / (16 / 15 * a) * across * along
    landed = float(thickness.sum() * cell**2)
    return Film.on_tile(
        thickness=thickness,
        kind=kind,
        paintable=kind == 1,
        cell=cell,
        x0=start,
        y0=start,
        X_ST=RigidTransform(),
        tile_size=(2.0, 2.0),
        sprayed=landed / EFFICIENCY,
        landed=landed,
        missed=0.0,
    )


@pytest.fixture
def started_folder(tmp_path):
    folder = RunFolder.create(tmp_path / "run", dump_scenario(Scenario(name="cubes")))
    folder.log(0.0, "started", versions={"painter": "0.1.0"})
    folder.log(0.0, "phase", phase="HOME")
    return folder


@pytest.fixture
def full_folder(
    started_folder, surface_map, segmentation, truth, program, executed, film
):
    """All files of a run that came to RETRACT, not yet finished."""
    folder = started_folder
    folder.log(2.0, "phase", phase="LOOK")
    folder.log(5.0, "stage", stage="wall_finder", goal="", compute_s=0.4)
    folder.log(5.0, "phase", phase="SCAN")
    folder.log(30.0, "phase", phase="SEGMENT")
    folder.log(30.0, "stage", stage="wall_segmenter", goal="", compute_s=2.1)
    folder.log(30.02, "phase", phase="PLAN")
    folder.log(30.02, "stage", stage="spray_path_planner", goal="", compute_s=1.5)
    folder.log(30.04, "phase", phase="PAINT")
    folder.log(110.0, "phase", phase="RETRACT")
    folder.log(113.0, "phase", phase="DONE")
    folder.save_map(surface_map)
    folder.save_segmentation(segmentation)
    folder.save_truth(truth)
    folder.save_program(program)
    folder.save_executed(executed)
    folder.save_film(film)
    return folder
