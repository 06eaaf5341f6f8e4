"""What the wall segmentation is measured against: PCL's program and Open3D's calls.

`pcl_wall` writes PREFIX.json, PREFIX.csv and, on request, what its filter kept, out of
IN.ply.
"""

import json
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import open3d as o3d

from perception.ground import BoolArray, FloatArray

OPTIONS = {
    "PCL": (),
    "PCL parallel": ("--sor", "omp", "--ransac-threads", "0"),
}
# Steps of ours and, by name in the peer's JSON file, of PCL.
STEPS = {
    "filter": ("sor",),
    "planes": ("ransac",),
    "tile": ("resample", "split_euclid", "split_cc", "tiny", "sort"),
}
Times = dict[str, float]


@contextmanager
def timed(times: Times, name: str) -> Iterator[None]:
    """Adds the seconds of a block to `times[name]`."""
    start = time.perf_counter()
    yield
    times[name] = times.get(name, 0.0) + time.perf_counter() - start


def time_open3d(p_CQs: FloatArray) -> Times:
    """Times Open3D's plain calls for filter and planes, as its tutorial has them."""
    times: Times = {}
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(p_CQs.T.copy()))
    cpu = time.process_time()
    with timed(times, "filter"):
        cloud, _ = cloud.remove_statistical_outlier(51, 3.5)
    least = 0.005 * p_CQs.shape[1]
    with timed(times, "planes"):
        for _ in range(20):
            if len(cloud.points) < least:
                break
            _, inliers = cloud.segment_plane(0.03, 3, 1000)
            cloud = cloud.select_by_index(inliers, invert=True)
    times["total"] = times["filter"] + times["planes"]
    times["cpu"] = time.process_time() - cpu
    return times


class Peer:
    """The Point Cloud Library's program, run on one cloud."""

    def __init__(self, program: str, p_CQs: FloatArray, folder: Path) -> None:
        """Saves the cloud for the program `program` in a folder."""
        self._program = program
        self._folder = folder
        self._cloud = folder / "cloud.ply"
        points = o3d.core.Tensor(np.ascontiguousarray(p_CQs.T.astype(np.float32)))
        o3d.t.io.write_point_cloud(str(self._cloud), o3d.t.geometry.PointCloud(points))

    def run(self, name: str) -> Times:
        """Runs it with one of `OPTIONS`; returns seconds by step, without loading."""
        subprocess.run(
            [self._program, self._cloud, "-o", self._folder / name, *OPTIONS[name]]
            + ["--dump-kept", self._file(name, "kept")],
            check=True,
            stdout=subprocess.DEVNULL,
        )
        answer = self.answer(name)
        seconds = answer["seconds"]
        times = {
            step: sum(seconds[part] for part in parts) for step, parts in STEPS.items()
        }
        times["total"] = seconds["total_without_load"]
        return {**times, "cpu": answer["cpu_seconds"]["total_without_load"]}

    def answer(self, name: str) -> dict:
        """What the last run of a name wrote of itself."""
        return json.loads(self._file(name, "json").read_text())

    def kept(self, name: str) -> BoolArray:
        """(N,) True = kept by the filter of the last run of a name."""
        return np.fromfile(self._file(name, "kept"), dtype=np.bool_)

    def wall_mask(self, name: str) -> BoolArray:
        """(ny, nx) the wall: all regions of the wall's plane; row 0 at the bottom."""
        labels = np.loadtxt(self._file(name, "csv"), delimiter=",", dtype=int)
        answer = self.answer(name)
        wall = [
            region["label"]
            for region in answer["regions"]
            if region["plane"] == answer["wall"]["plane"]
        ]
        return np.isin(labels, wall)[::-1]

    def _file(self, name: str, suffix: str) -> Path:
        return self._folder / f"{name}.{suffix}"
