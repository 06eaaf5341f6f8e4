"""Fuses keyframes into one surface, weighted and counted, without outliers."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import open3d as o3d
from pydrake.math import RigidTransform

from perception.depth_camera.depth import CameraIntrinsics
from perception.ground import BoolArray, FloatArray, FrozenValue, IntArray
from perception.io.ply import write_ply
from perception.mapping.config import MapperConfig
from perception.mapping.fusion.voxels import Voxels, normals_of
from perception.mapping.keyframes.keyframe import BLOCK, Keyframe

_MIN_COUNT = 3
_OUTLIER_SHARE = 0.2
"""Voxels with less than this share of the best voxel around them are outliers."""
_SEEN_THROUGH = 0.02
"""Depth farther than a point by this, m plus share of range, sees through it."""
_CARVERS = 3
"""Every so many-th keyframe carves; neighbours see the same."""
_UNKNOWN_COS = 0.3
"""Cosine of incidence where the grid has no normal."""
_GOOD_RANGE = 0.7
"""Range at which a frontal pixel weighs one, m."""


@dataclass(frozen=True, eq=False)
class FusedMap(FrozenValue):
    """The surface, one point a voxel.

    Attributes:
        p_WQs: (3, N) m, in W.
        normals_W: (3, N) unit, in W, towards the cameras.
        colors: (N, 3) uint8, RGB.
        counts: (N,) int64, pixels fused.
        frames: (N,) int64, keyframes that saw it.
        variances: (N,) m², along the main plane's normal.
        X_WV: Frame of the voxels: z is the main plane's normal.
        carved: Points removed because more keyframes see through them than see them.
    """

    p_WQs: FloatArray
    normals_W: FloatArray
    colors: npt.NDArray[np.uint8]
    counts: IntArray
    frames: IntArray
    variances: FloatArray
    X_WV: RigidTransform
    carved: int


def fuse(
    keyframes: Sequence[Keyframe],
    poses: Sequence[RigidTransform],
    X_WV: RigidTransform,
    intrinsics: CameraIntrinsics,
    config: MapperConfig,
) -> FusedMap:
    """Fuses all keyframes at their poses.

    The weight of a pixel is the inverse variance of its depth, which grows with the
    fourth power of range, times the squared cosine of incidence.

    Args:
        keyframes: With their pictures.
        poses: X_WC of each.
        X_WV: Frame whose z is the main surface's normal, towards the cameras.
        intrinsics: Of the camera.
        config: Voxel size and stride.
    """
    X_VW = X_WV.inverse()
    voxels = Voxels.empty(config.cell, config.layer, colored=True)
    for keyframe, X_WC in zip(keyframes, poses, strict=True):
        p_CQs, weights, colors = _pixels(keyframe, intrinsics)
        X_VC = X_VW @ X_WC
        voxels = voxels.add(X_VC @ p_CQs, X_VC.translation(), weights, colors)
    surface = voxels.surface(_MIN_COUNT, _OUTLIER_SHARE)
    carved = _seen_through(X_WV @ surface.p_VQs, keyframes, poses, intrinsics)
    surface = surface.selected(~carved)
    p_WQs = X_WV @ surface.p_VQs
    return FusedMap(
        p_WQs=p_WQs,
        normals_W=normals_of(p_WQs, X_WV @ surface.p_VCs, 3.0 * config.cell),
        colors=surface.colors,
        counts=surface.counts,
        frames=surface.frames,
        variances=surface.variances,
        X_WV=X_WV,
        carved=int(carved.sum()),
    )


def write_map(path: Path, fused: FusedMap) -> None:
    """Writes the points as PLY with normals, colours, counts, frames and variances."""
    fields = dict(zip(("x", "y", "z"), fused.p_WQs, strict=True))
    fields |= dict(zip(("nx", "ny", "nz"), fused.normals_W, strict=True))
    fields |= dict(zip(("red", "green", "blue"), fused.colors.T, strict=True))
    fields["count"] = fused.counts.astype(np.int32)
    fields["frames"] = fused.frames.astype(np.int32)
    fields["variance"] = fused.variances.astype(np.float32)
    write_ply(path, fields, comment="Painter map: points and normals in W, m")


def write_voxels(path: Path, fused: FusedMap, edge: float) -> int:
    """Writes the cubes that hold points: NPZ with `index`, `count`, `edge` and `X_WV`.

    Row (i, j, k) of `index` (n, 3) int32 is the cube whose lowest corner in V is
    `edge` * (i, j, k); `count` (n,) is its number of pixels. V is the map's own frame,
    z out of the main surface.

    Args:
        path: The file.
        fused: The map.
        edge: Of a cube, m.

    Returns:
        The number of cubes.
    """
    p_VQs = fused.X_WV.inverse() @ fused.p_WQs if fused.p_WQs.size else fused.p_WQs
    cells = np.floor(p_VQs / edge).astype(np.int32)
    index, owner = np.unique(cells, axis=1, return_inverse=True)
    count = np.bincount(owner.ravel(), fused.counts, index.shape[1]).astype(np.int64)
    X_WV = fused.X_WV.GetAsMatrix4()
    np.savez_compressed(path, index=index.T, count=count, edge=edge, X_WV=X_WV)
    return int(index.shape[1])


def write_mesh(path: Path, fused: FusedMap, depth: int = 9) -> int:
    """Writes a Poisson mesh of the points, cut where there are none.

    Source: Kazhdan and Hoppe, "Screened Poisson surface reconstruction", 2013.

    Returns:
        The number of triangles.
    """
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(fused.p_WQs.T.copy()))
    cloud.normals = o3d.utility.Vector3dVector(fused.normals_W.T.copy())
    cloud.colors = o3d.utility.Vector3dVector(fused.colors / 255.0)
    mesh, density = o3d.geometry.TriangleMesh.create_from_point_cloud_poisson(
        cloud, depth=depth
    )
    densities = np.asarray(density)
    mesh.remove_vertices_by_mask(densities < np.quantile(densities, 0.03))
    o3d.io.write_triangle_mesh(path, mesh)
    return len(mesh.triangles)


def _pixels(
    keyframe: Keyframe, intrinsics: CameraIntrinsics
) -> tuple[FloatArray, FloatArray, npt.NDArray[np.uint8]]:
    """Returns p_CQs (3, N), weights and colours of a keyframe's pixels."""
    picture = keyframe.picture
    if picture is None:
        raise ValueError(f"keyframe {keyframe.number} was kept without its picture.")
    depth_mm, stride = picture.depth_mm, picture.stride
    row, column = np.nonzero(depth_mm)
    z = depth_mm[row, column] / 1000.0
    x, y = intrinsics.rays(stride * column, stride * row)
    height, width = keyframe.z.shape
    normals = keyframe.grid(intrinsics).normals[
        np.minimum(stride * row // BLOCK, height - 1),
        np.minimum(stride * column // BLOCK, width - 1),
    ]
    along = -(normals[:, 0] * x + normals[:, 1] * y + normals[:, 2])
    cos = np.where(along > 0, along / np.sqrt(1 + x * x + y * y), _UNKNOWN_COS)
    weights = (_GOOD_RANGE / z) ** 4 * cos**2
    return np.stack([x * z, y * z, z]), weights, picture.colors[row, column]


def _seen_through(
    p_WQs: FloatArray,
    keyframes: Sequence[Keyframe],
    poses: Sequence[RigidTransform],
    intrinsics: CameraIntrinsics,
) -> BoolArray:
    """Finds points that more keyframes see through than see."""
    through = np.zeros(p_WQs.shape[1], dtype=np.int32)
    seen = np.zeros_like(through)
    for keyframe, X_WC in list(zip(keyframes, poses, strict=True))[::_CARVERS]:
        picture = keyframe.picture
        if picture is None:
            continue
        p_CQs = X_WC.inverse() @ p_WQs
        ahead = np.flatnonzero(p_CQs[2] > 0.1)
        depth_of = p_CQs[2, ahead]
        u, v = intrinsics.project(p_CQs[:, ahead]) / picture.stride
        height, width = picture.shape
        inside = (u > 0) & (u < width - 1) & (v > 0) & (v < height - 1)
        ahead, z_in = ahead[inside], depth_of[inside]
        row, column = np.rint(v[inside]).astype(int), np.rint(u[inside]).astype(int)
        depth = picture.depth_mm[row, column] / 1000.0
        margin = _SEEN_THROUGH * (1.0 + z_in)
        through[ahead] += depth > z_in + margin
        seen[ahead] += np.abs(depth - z_in) <= margin
    return np.asarray((through >= 2) & (through > seen))
