"""Triangle meshes of turned and extruded solids, and their glTF files."""

import base64
import itertools
import json
from dataclasses import dataclass

import numpy as np

# Colour (linear RGB), metallic and roughness of glTF's PBR materials.
MATERIALS: dict[str, tuple[tuple[float, float, float], float, float]] = {
    "aluminium": ((0.56, 0.58, 0.60), 0.15, 0.32),
    "paint_white": ((0.84, 0.85, 0.86), 0.0, 0.45),
    "paint_orange": ((0.85, 0.24, 0.03), 0.0, 0.45),
    "paint_grey": ((0.09, 0.10, 0.115), 0.0, 0.5),
    "anodised": ((0.045, 0.049, 0.057), 0.1, 0.38),
    "abs": ((0.022, 0.024, 0.028), 0.0, 0.6),
    "rubber": ((0.012, 0.012, 0.013), 0.0, 0.9),
    "steel": ((0.42, 0.43, 0.45), 0.25, 0.25),
    "brass": ((0.62, 0.38, 0.10), 0.25, 0.3),
    "glass": ((0.008, 0.010, 0.016), 0.2, 0.08),
    "hose": ((0.02, 0.06, 0.22), 0.0, 0.55),
}

Point = tuple[float, float, float]


@dataclass(frozen=True)
class Piece:
    """Flat-indexed triangles of one material.

    Attributes:
        material: A key of `MATERIALS`.
        vertices: (n, 3) m, in the link.
        normals: (n, 3), unit, outwards.
        triangles: (m, 3) indices, counter-clockwise seen from outside.
    """

    material: str
    vertices: np.ndarray
    normals: np.ndarray
    triangles: np.ndarray


def turned(
    material: str,
    profile: list[tuple[float, float]],
    *,
    start: Point = (0.0, 0.0, 0.0),
    axis: str | Point = "x",
    sides: int = 40,
) -> Piece:
    """Makes a solid of revolution with sharp edges between its cones.

    Args:
        material: A key of `MATERIALS`.
        profile: (distance along the axis, radius) from one end to the other, m; a
            first and last radius of 0 closes it.
        start: Where the profile's distances count from, m.
        axis: "x", "y", "z" or a direction.
        sides: Facets around the axis.
    """
    along = np.eye(3)["xyz".index(axis)] if isinstance(axis, str) else np.array(axis)
    along = along / np.linalg.norm(along)
    across = np.eye(3)[np.argmin(np.abs(along))]
    u = np.cross(along, across)
    u /= np.linalg.norm(u)
    w = np.cross(along, u)
    angles = np.linspace(0.0, 2.0 * np.pi, sides + 1)
    ring = np.cos(angles)[:, None] * u + np.sin(angles)[:, None] * w
    vertices, normals, triangles = [], [], []
    for (s0, r0), (s1, r1) in itertools.pairwise(profile):
        first = sum(len(block) for block in vertices)
        slope = np.array([r0 - r1, s1 - s0])
        slope = slope / np.linalg.norm(slope)
        normal = slope[0] * along + slope[1] * ring
        for s, r in ((s0, r0), (s1, r1)):
            vertices.append(np.array(start) + s * along + r * ring)
            normals.append(normal)
        low = first + np.arange(sides)
        high = low + sides + 1
        if r0 > 0.0:
            triangles.append(np.stack([low, low + 1, high], axis=1))
        if r1 > 0.0:
            triangles.append(np.stack([low + 1, high + 1, high], axis=1))
    return Piece(
        material,
        np.concatenate(vertices),
        np.concatenate(normals),
        np.concatenate(triangles),
    )


def rod(
    material: str,
    start: Point,
    length: float,
    radius: float,
    *,
    axis: str | Point = "x",
    bevel: float = 0.003,
    sides: int = 40,
) -> Piece:
    """Makes a closed cylinder with bevelled edges, from `start` on."""
    profile = [
        (0.0, 0.0),
        (0.0, radius - bevel),
        (bevel, radius),
        (length - bevel, radius),
        (length, radius - bevel),
        (length, 0.0),
    ]
    return turned(material, profile, start=start, axis=axis, sides=sides)


def plate(
    material: str,
    outline: list[tuple[float, float]],
    *,
    normal: str,
    center: Point,
    thickness: float,
    bevel: float = 0.0015,
) -> Piece:
    """Makes a plate with bevelled edges from a convex outline.

    Args:
        material: A key of `MATERIALS`.
        outline: Corners, counter-clockwise about the normal, in the two axes that
            follow it (y z for x, z x for y, x y for z), m from the centre.
        normal: "x", "y" or "z".
        center: m.
        thickness: Along the normal, m.
        bevel: Width of the 45 degree edges, m.
    """
    n = "xyz".index(normal)
    a, b = (n + 1) % 3, (n + 2) % 3
    corners = np.array(outline)
    inset = corners - bevel * np.sign(corners)
    half = thickness / 2.0
    layers = [
        (inset, -half),
        (corners, -half + bevel),
        (corners, half - bevel),
        (inset, half),
    ]
    rings = []
    for flat, height in layers:
        points = np.zeros((len(flat), 3))
        points[:, a], points[:, b], points[:, n] = flat[:, 0], flat[:, 1], height
        rings.append(points + np.array(center))
    faces = [[*rings[0][::-1]], [*rings[-1]]]
    count = len(corners)
    for lower, upper in itertools.pairwise(rings):
        for i in range(count):
            j = (i + 1) % count
            faces.append([lower[i], lower[j], upper[j], upper[i]])
    return _from_faces(material, faces)


def block(material: str, center: Point, size: Point, *, bevel: float = 0.003) -> Piece:
    """Makes a box with edges bevelled all round in x and y and along z."""
    x, y, z = (edge / 2.0 for edge in size)
    cut = bevel
    outline = [
        (x, -y + cut),
        (x, y - cut),
        (x - cut, y),
        (-x + cut, y),
        (-x, y - cut),
        (-x, -y + cut),
        (-x + cut, -y),
        (x - cut, -y),
    ]
    return plate(
        material,
        outline,
        normal="z",
        center=center,
        thickness=2.0 * z,
        bevel=0.7 * bevel,
    )


def hose(material: str, points: list[Point], radius: float) -> Piece:
    """Makes a smooth tube of 12 sides along a Catmull-Rom curve through points."""
    sides = 12
    p = np.array(points)
    p = np.concatenate([[2 * p[0] - p[1]], p, [2 * p[-1] - p[-2]]])
    t = np.linspace(0.0, 1.0, 9)[:-1, None]
    curve = [
        0.5
        * (
            2 * b
            + (c - a) * t
            + (2 * a - 5 * b + 4 * c - d) * t**2
            + (3 * b - a - 3 * c + d) * t**3
        )
        for a, b, c, d in zip(p[:-3], p[1:-2], p[2:-1], p[3:], strict=True)
    ]
    path = np.concatenate([*curve, p[-2:-1]])
    tangents = np.gradient(path, axis=0)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    u = np.cross(tangents[0], np.eye(3)[np.argmin(np.abs(tangents[0]))])
    angles = np.linspace(0.0, 2.0 * np.pi, sides + 1)
    rings = []
    for tangent in tangents:
        u = u - (u @ tangent) * tangent  # Carried along without twisting.
        u /= np.linalg.norm(u)
        w = np.cross(tangent, u)
        rings.append(np.cos(angles)[:, None] * u + np.sin(angles)[:, None] * w)
    normals = np.concatenate(rings)
    vertices = np.repeat(path, sides + 1, axis=0) + radius * normals
    low = (
        np.arange(len(path) - 1)[:, None] * (sides + 1) + np.arange(sides)[None]
    ).ravel()
    high = low + sides + 1
    triangles = np.concatenate(
        [
            np.stack([low, low + 1, high], axis=1),
            np.stack([low + 1, high + 1, high], axis=1),
        ]
    )
    return Piece(material, vertices, normals, triangles)


def _from_faces(material: str, faces: list[list[np.ndarray]]) -> Piece:
    """Flat-shaded convex polygons, each counter-clockwise seen from outside."""
    vertices, normals, triangles = [], [], []
    for face in faces:
        points = np.array(face)
        normal = np.cross(points[1] - points[0], points[2] - points[0])
        normal /= np.linalg.norm(normal)
        first = sum(len(block_) for block_ in vertices)
        vertices.append(points)
        normals.append(np.broadcast_to(normal, points.shape))
        fan = np.arange(1, len(points) - 1)
        triangles.append(first + np.stack([np.zeros_like(fan), fan, fan + 1], axis=1))
    return Piece(
        material,
        np.concatenate(vertices),
        np.concatenate(normals),
        np.concatenate(triangles),
    )


def write_gltf(pieces: list[Piece]) -> str:
    """Returns a glTF 2.0 file, its buffer inside, of pieces given in z-up axes.

    glTF is y-up and Drake turns it back, so (x, y, z) is written as (x, z, -y).
    """
    data = bytearray()
    views: list[dict] = []
    accessors: list[dict] = []
    primitives: list[dict] = []
    names = sorted({piece.material for piece in pieces})

    def add(array: np.ndarray, kind: str, component: int, target: int) -> int:
        views.append(
            {
                "buffer": 0,
                "byteOffset": len(data),
                "byteLength": array.nbytes,
                "target": target,
            }
        )
        accessor = {
            "bufferView": len(views) - 1,
            "componentType": component,
            "count": array.size if kind == "SCALAR" else len(array),
            "type": kind,
        }
        if target == 34962:
            accessor |= {
                "min": array.min(axis=0).tolist(),
                "max": array.max(axis=0).tolist(),
            }
        accessors.append(accessor)
        data.extend(array.tobytes())
        data.extend(b"\0" * (-len(data) % 4))
        return len(accessors) - 1

    def y_up(points: np.ndarray) -> np.ndarray:
        # Rounded, so that every machine writes the same file; + 0.0 makes -0.0 one.
        turned_up = np.round(points[:, [0, 2, 1]] * [1, 1, -1], 6) + 0.0
        return np.ascontiguousarray(turned_up, dtype="<f4")

    for name in names:
        chosen = [piece for piece in pieces if piece.material == name]
        starts = np.cumsum([0, *(len(piece.vertices) for piece in chosen[:-1])])
        vertices = y_up(np.concatenate([piece.vertices for piece in chosen]))
        normals = y_up(np.concatenate([piece.normals for piece in chosen]))
        triangles = np.concatenate(
            [piece.triangles + s for piece, s in zip(chosen, starts, strict=True)]
        )
        primitives.append(
            {
                "attributes": {
                    "POSITION": add(vertices, "VEC3", 5126, 34962),
                    "NORMAL": add(normals, "VEC3", 5126, 34962),
                },
                "indices": add(triangles.astype("<u2").ravel(), "SCALAR", 5123, 34963),
                "material": len(primitives),
            }
        )
    document = {
        "asset": {"version": "2.0", "generator": "python -m painter_models.generate"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": primitives}],
        "materials": [
            {
                "name": name,
                "pbrMetallicRoughness": {
                    "baseColorFactor": [*MATERIALS[name][0], 1.0],
                    "metallicFactor": MATERIALS[name][1],
                    "roughnessFactor": MATERIALS[name][2],
                },
            }
            for name in names
        ],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [
            {
                "byteLength": len(data),
                "uri": "data:application/octet-stream;base64,"
                + base64.b64encode(bytes(data)).decode(),
            }
        ],
    }
    return json.dumps(document, separators=(",", ":")) + "\n"
