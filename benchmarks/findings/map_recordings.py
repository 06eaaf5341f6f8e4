"""The mapper on recordings: `python -m benchmarks.findings.map_recordings [DATA]`.

DATA, if left out, `real` in the folder that the variable PAINTER_DATA names, holds
`rgbd_sequence_with_poses` (7-Scenes, Kinect, KinectFusion's poses) and
`d415_on_robot_arm` (two views of a table from an arm). The given poses are no truth: of
the tables, the planes that the two views see are compared.
"""

import argparse
import os
from pathlib import Path

import numpy as np

from benchmarks.findings.map_sessions import ate
from perception.io.frames import open_recording
from perception.mapping.config import MapperConfig
from perception.mapping.sessions.mapper import Mapper
from perception.mapping.sessions.session import run_session

TABLES = ("table_0p50m", "table_0p80m_empty", "table_0p80m_cable")
# The sequence reaches 4 m; its poses are a tracker's, good to about a centimetre.
SEQUENCE = MapperConfig(max_range=4.0, arm_sigma=0.010, arm_sigma_deg=0.5)
# Every view is a keyframe; the arm's hand-eye error is a degree.
TABLE = MapperConfig(
    arm_sigma=0.005, arm_sigma_deg=1.0, keyframe_distance=1e-4, keyframe_angle_deg=0.01
)
SLAB = 0.03
DATA = Path(os.environ.get("PAINTER_DATA", "../shared/data")) / "real"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", nargs="?", type=Path, default=DATA)
    data = parser.parse_args().data
    folder = data / "rgbd_sequence_with_poses"
    given = {entry.time: entry.X_WC for entry in open_recording(folder).entries}
    for use_poses in (True, False):
        _, result = mapped(folder, SEQUENCE, use_poses)
        z = (result.fused.X_WV.inverse() @ result.fused.p_WQs)[2]
        z = z[np.abs(z) < SLAB]
        print(
            f"sequence, {'with' if use_poses else 'without'} poses: "
            f"{len(result.poses)} of {len(given)} frames, ATE to the given poses "
            f"{ate(result.poses, given):.1f} mm, main plane's spread within 3 cm "
            f"{1e3 * z.std():.2f} mm"
        )
    for name in TABLES:
        mapper, result = mapped(data / "d415_on_robot_arm" / name, TABLE, True)
        before = disagreement(mapper, [k.X_WN for k in mapper.graph.keyframes])
        after = disagreement(mapper, result.solution.graph.poses)
        print(
            f"{name}: planes {before[0]:.2f} deg, {before[1]:.2f} mm apart -> "
            f"{after[0]:.3f} deg, {after[1]:.3f} mm"
        )


def mapped(folder, config, use_poses):
    recording = open_recording(folder, use_poses=use_poses)
    mapper = Mapper(recording.intrinsics, config)
    return mapper, run_session(mapper, recording.frames())


def disagreement(mapper, poses) -> tuple[float, float]:
    """Angle, deg, and distance, mm, between the first planes of two keyframes."""
    sights = [keyframe.planes[0] for keyframe in mapper.graph.keyframes]
    normals = [X.rotation() @ s.normal for X, s in zip(poses, sights, strict=True)]
    centers = [X @ s.center for X, s in zip(poses, sights, strict=True)]
    mean = sum(normals) / np.linalg.norm(sum(normals))
    sine = np.linalg.norm(np.cross(*normals))
    angle = np.degrees(np.arctan2(sine, normals[0] @ normals[1]))
    return float(angle), float(1e3 * abs(mean @ (centers[1] - centers[0])))


if __name__ == "__main__":
    main()
