"""Pictures of plaster and brick, and the textured mesh of a wall with openings."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from PIL import Image
from scipy import ndimage

from painter.scene.config import WallConfig
from painter.scene.solids import Solid
from perception.ground import FloatArray

# Pixels a metre; a D435 at 0.7 m sees about 600 a metre.
_PIXELS = 300.0
# Bricks with their joints, m. Source: German normal format, DIN 105: 240 x 71 mm
# bricks, joints 10 mm upright and 12 mm flat.
_BRICK = (0.250, 0.083)
_JOINT = (0.010, 0.012)
_MORTAR = (0.70, 0.68, 0.64)
# The picture of a wall is always the same, whatever the seed of a run.
_SEED = 435


def wall_picture(wall: WallConfig) -> FloatArray:
    """Draws the wall's front.

    Args:
        wall: The wall; its texture and colour.

    Returns:
        (ny, nx, 3) float64, 0 to 1, row 0 at the bottom.
    """
    rng = np.random.default_rng(_SEED)
    shape = round(wall.height * _PIXELS), round(wall.width * _PIXELS)
    color = np.array(wall.color)
    shade = _DRAWERS[wall.texture](shape, rng)
    picture = color * shade[..., None]
    if wall.texture == "brick":
        picture[_joints(shape)] = _MORTAR
        picture *= 1.0 + 0.03 * _noise(shape, 1.0, rng)[..., None]
    return np.clip(picture, 0.0, 1.0)


def write_textured_wall(wall: WallConfig, pieces: list[Solid], folder: Path) -> Path:
    """Writes the wall's pieces as one mesh with the wall's picture on it.

    Args:
        wall: The wall.
        pieces: Its boxes, in S.
        folder: Existing folder; gets wall.obj, wall.mtl and wall.png.

    Returns:
        Path of the mesh.
    """
    picture = np.round(255 * wall_picture(wall)[::-1]).astype(np.uint8)
    Image.fromarray(picture).save(folder / "wall.png")
    (folder / "wall.mtl").write_text("newmtl wall\nKd 1 1 1\nmap_Kd wall.png\n")
    path = folder / "wall.obj"
    path.write_text(_obj(wall, pieces))
    return path


def _obj(wall: WallConfig, pieces: list[Solid]) -> str:
    """Returns the boxes as Wavefront OBJ; the picture lies flat on x and y of S."""
    lines = ["mtllib wall.mtl", "usemtl wall"]
    # Corners of a face, counter-clockwise seen from outside, for each axis and sign.
    square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) / 2
    count = 0
    for piece in pieces:
        for axis in range(3):
            for sign in (-1, 1):
                corners = np.full((4, 3), sign / 2)
                corners[:, [(axis + 1) % 3, (axis + 2) % 3]] = square[::sign]
                p_SQs = corners * piece.size + piece.X_SP.translation()
                uv = (p_SQs[:, :2] - [wall.x, wall.y]) / [wall.width, wall.height]
                normal = np.zeros(3)
                normal[axis] = sign
                lines += [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in p_SQs]
                lines += [f"vt {u:.6f} {v:.6f}" for u, v in uv]
                lines.append("vn {:.0f} {:.0f} {:.0f}".format(*normal))
                face = range(4 * count + 1, 4 * count + 5)
                count += 1
                lines.append("f " + " ".join(f"{i}/{i}/{count}" for i in face))
    return "\n".join(lines) + "\n"


def _plain(shape: tuple[int, int], rng: np.random.Generator) -> FloatArray:
    return np.ones(shape)


def _plaster(shape: tuple[int, int], rng: np.random.Generator) -> FloatArray:
    """Grain of 2-3 mm and broad clouds."""
    grain = 0.05 * _noise(shape, 0.8, rng)
    shade: FloatArray = 1.0 + grain + 0.03 * _noise(shape, 40.0, rng)
    return shade


def _brick(shape: tuple[int, int], rng: np.random.Generator) -> FloatArray:
    """Running bond: every brick has a shade of its own."""
    row, column, _, _ = _bond(shape)
    shades = rng.normal(1.0, 0.12, (int(row.max()) + 1, int(column.max()) + 2))
    shade: FloatArray = shades[row, column] + 0.05 * _noise(shape, 1.0, rng)
    return shade


def _joints(shape: tuple[int, int]) -> "np.typing.NDArray[np.bool_]":
    _, _, along, up = _bond(shape)
    joints: np.typing.NDArray[np.bool_] = (along < _JOINT[0]) | (up < _JOINT[1])
    return joints


def _bond(
    shape: tuple[int, int],
) -> tuple[
    "np.typing.NDArray[np.intp]", "np.typing.NDArray[np.intp]", FloatArray, FloatArray
]:
    """Returns each pixel's row and column of bricks, and its place in its brick, m."""
    y, x = (np.indices(shape) + 0.5) / _PIXELS
    row = (y / _BRICK[1]).astype(np.intp)
    x = x + 0.5 * _BRICK[0] * (row % 2)
    column = (x / _BRICK[0]).astype(np.intp)
    return row, column, x - column * _BRICK[0], y - row * _BRICK[1]


def _noise(
    shape: tuple[int, int], sigma: float, rng: np.random.Generator
) -> FloatArray:
    """Returns smooth noise of unit variance; `sigma` in pixels."""
    noise = ndimage.gaussian_filter(rng.standard_normal(shape), sigma)
    unit: FloatArray = noise / noise.std()
    return unit


_DRAWERS: dict[str, Callable[[tuple[int, int], np.random.Generator], FloatArray]] = {
    "none": _plain,
    "plaster": _plaster,
    "brick": _brick,
}
