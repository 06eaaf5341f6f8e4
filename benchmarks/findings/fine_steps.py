"""Detection of low steps: share of cells found against step height and distance.

A plate of 20 x 20 cm, raised or recessed by the step, on a flat wall 0.6 x 0.5 m, seen
by the full stereo model from a camera square to the wall that moves along two rows. The
sides of the plate are not drawn: they are less than a pixel wide in most pictures. A
cell is the plate's if its centre is; false cells are all other cells that are lost, at
the plate's edges too, of all other cells. The first table is of plates whose edges lie
on the grid's lines, the second of plates shifted by parts of a cell: there the mask
must tell an edge 2.5 mm beside a cell's centre from one on it.

    python -m benchmarks.findings.fine_steps [PICTURE.png]

Prints the tables and draws the first.
"""

import itertools
import sys

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from perception.config import MapConfig, SegmentationConfig, StereoConfig
from perception.depth_camera.depth import CameraIntrinsics, depth_points, usable_pixels
from perception.depth_camera.stereo import StereoModel
from perception.mapping.fusion.voxel_map import VoxelMap
from perception.segmentation import segment_wall
from perception.values import TileSize

STEPS_MM = (-20, 5, 7, 10, 15, 20, 40)
DISTANCES = (0.5, 0.7, 0.75, 0.8, 1.0, 1.25, 1.5)
SHIFTED_STEPS_MM = (-20, 10, 20)
SHIFTED_DISTANCES = (0.7, 0.75, 0.8)
SHIFTS = ((0.0025, 0.005), (0.005, 0.0075), (0.0075, 0.0))  # Along x and y, m
WIDTH, HEIGHT = 0.6, 0.5
PLATE = ((0.2, 0.4), (0.15, 0.35))  # x and y in T, m
# The camera, in T: its x right, y down, z into the wall.
R_TC = RotationMatrix(np.diag([1.0, -1.0, -1.0]))
OFFSETS_X = np.linspace(-0.25, 0.25, 6)
OFFSETS_Y = (-0.1, 0.1)
Shift = tuple[float, float]


def on_plate(x: np.ndarray, y: np.ndarray, shift: Shift) -> np.ndarray:
    """Tells which places, m in T, are the plate's."""
    (left, right), (low, high) = PLATE
    x, y = x - shift[0], y - shift[1]
    return (x > left) & (x < right) & (y > low) & (y < high)


def true_depth(
    p_TC: np.ndarray, step: float, shift: Shift, intrinsics: CameraIntrinsics
) -> np.ndarray:
    """Returns the picture without errors, (H, W) m."""
    column, row = np.meshgrid(np.arange(intrinsics.width), np.arange(intrinsics.height))
    x, y = intrinsics.rays(column, row)
    y = -y
    # A ray meets the plate if it passes the nearer of plate and wall within its sides.
    near = p_TC[2] - max(step, 0.0)
    on = on_plate(p_TC[0] + near * x, p_TC[1] + near * y, shift)
    return np.where(on, p_TC[2] - step, p_TC[2]).astype(np.float32)


def measure(
    step: float, distance: float, shift: Shift = (0.0, 0.0)
) -> tuple[float, float]:
    """Returns the share of the plate's cells found, and of all others lost."""
    stereo, config = StereoConfig(), MapConfig()
    intrinsics = CameraIntrinsics.from_stereo(stereo)
    model = StereoModel(stereo, 1)
    voxels = VoxelMap.empty(RigidTransform(), WIDTH, HEIGHT, config)
    for number, (dy, dx) in enumerate(np.ndindex(len(OFFSETS_Y), len(OFFSETS_X))):
        p_TC = np.array(
            [WIDTH / 2 + OFFSETS_X[dx], HEIGHT / 2 + OFFSETS_Y[dy], distance]
        )
        depth = true_depth(p_TC, step, shift, intrinsics)
        depth_mm = model.measure(depth, depth, np.random.default_rng([1, number]))
        p_CQs = depth_points(
            depth_mm, usable_pixels(depth_mm, config), intrinsics, config.stride
        )
        voxels = voxels.fuse(RigidTransform(R_TC, p_TC) @ p_CQs, p_TC)
    result = segment_wall(
        voxels.surface_map,
        RigidTransform(),
        TileSize(WIDTH, HEIGHT),
        config=SegmentationConfig(),
        seed=1,
    )
    ny, nx = result.labels.shape
    p_TQs = [(np.arange(count) + 0.5) * result.cell for count in (nx, ny)]
    plate = on_plate(*np.meshgrid(*p_TQs), shift)
    lost = ~result.wall_mask
    return lost[plate].mean(), lost[~plate].mean()


def main() -> None:
    """Prints the tables and draws the picture."""
    print("edges on the grid's lines\nstep mm  distance m   found  false cells")
    found = np.zeros((len(STEPS_MM), len(DISTANCES)))
    for i, j in np.ndindex(found.shape):
        found[i, j], false = measure(STEPS_MM[i] / 1000, DISTANCES[j])
        place = f"{STEPS_MM[i]:7d}  {DISTANCES[j]:10.2f}"
        print(f"{place}  {found[i, j]:6.1%}  {false:11.2%}", flush=True)
    print("\nedges beside them: mean and worst of the shifts")
    print("step mm  distance m          found    false cells")
    for step, distance in itertools.product(SHIFTED_STEPS_MM, SHIFTED_DISTANCES):
        part = np.array([measure(step / 1000, distance, shift) for shift in SHIFTS])
        found_, false_ = part.T
        print(
            f"{step:7d}  {distance:10.2f}  {found_.mean():6.1%} {found_.min():6.1%}  "
            f"{false_.mean():6.2%} {false_.max():6.2%}",
            flush=True,
        )
    if len(sys.argv) > 1:
        draw(found, sys.argv[1])


def draw(found: np.ndarray, path: str) -> None:
    """Draws share found against distance, one line a step."""
    figure, axes = plt.subplots(figsize=(7, 4.2), layout="constrained")
    colors = plt.get_cmap("viridis")(np.linspace(0.0, 0.9, len(STEPS_MM)))
    for step, row, color in zip(STEPS_MM, found, colors, strict=True):
        name = f"{step} mm" if step > 0 else f"recess {-step} mm"
        axes.plot(DISTANCES, 100 * row, "o-", color=color, label=name)
    axes.set(xlabel="camera to wall, m", ylabel="cells of the plate found, %")
    axes.set_title("Low steps found on a 20 x 20 cm plate, full stereo noise")
    axes.grid(alpha=0.3)
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    main()
