"""Times of one depth picture, of the map's surface and of its pose graph.

Sensor model, usable pixels and points, fusion, and what the cycle does with it in all.

The pictures are of a bare wall 0.7 m away, along one row of a scan.
"""

import time

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from painter.planning.config import TileConfig
from painter.planning.tile import nominal_tile_pose
from perception.config import MapConfig, StereoConfig
from perception.depth_camera.depth import CameraIntrinsics, depth_points, usable_pixels
from perception.depth_camera.stereo import StereoModel
from perception.mapping.config import PoseGraphConfig
from perception.mapping.fusion.voxel_map import VoxelMap
from perception.mapping.sessions.live_map import LiveMap

PICTURES = 60
R_WC = RotationMatrix([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])


def main() -> None:
    stereo, config, tile = StereoConfig(), MapConfig(), TileConfig()
    intrinsics = CameraIntrinsics.from_stereo(stereo)
    model = StereoModel(stereo, 1)
    wall = np.full((stereo.height, stereo.width), 0.7, dtype=np.float32)
    window = wall.copy()
    window[100:300, 300:600] = 2.0
    voxels = VoxelMap.empty(nominal_tile_pose(tile), tile.width, tile.height, config)
    live = LiveMap.empty(
        nominal_tile_pose(tile),
        (tile.width, tile.height),
        config,
        intrinsics,
        PoseGraphConfig(),
    )
    names = ("picture", "picture with glass", "points", "fusion", "all of it")
    seconds = {name: [] for name in names}
    for number in range(PICTURES):
        p_WC = [tile.distance - 0.7, 0.9 - 0.03 * number, 0.6 + 0.4 * (number % 4)]
        X_WC = RigidTransform(R_WC, p_WC)
        marks = [time.perf_counter()]
        depth_mm = model.measure(wall, wall, np.random.default_rng([1, number]))
        marks.append(time.perf_counter())
        model.measure(window, wall, np.random.default_rng([1, number]))
        marks.append(time.perf_counter())
        usable = usable_pixels(depth_mm, config)
        p_WQs = X_WC @ depth_points(depth_mm, usable, intrinsics, config.stride)
        marks.append(time.perf_counter())
        voxels = voxels.fuse(p_WQs, X_WC.translation())
        marks.append(time.perf_counter())
        live = live.fused(float(number), depth_mm, X_WC)
        marks.append(time.perf_counter())
        for name, duration in zip(names, np.diff(marks), strict=True):
            seconds[name].append(1000 * duration)
    count = voxels.voxels.keys.size
    print(f"{stereo.width} x {stereo.height} px, {count} voxels at the end")
    for name, durations in seconds.items():
        low, high = np.median(durations), np.max(durations)
        print(f"{name:>20}: median {low:5.1f} ms, worst {high:5.1f} ms")
    start = time.perf_counter()
    count = voxels.surface_map.counts.size
    duration = 1000 * (time.perf_counter() - start)
    print(f"{'surface map':>20}: {duration:.0f} ms for {count} points")
    start = time.perf_counter()
    moved = 1000 * live.moved_by
    duration = 1000 * (time.perf_counter() - start)
    keyframes = len(live.graph.keyframes)
    print(f"{'pose graph':>20}: {duration:.0f} ms for {keyframes} keyframes; it moves")
    print(f"{'':>20}  the wall by {moved:.2f} mm")


if __name__ == "__main__":
    main()
