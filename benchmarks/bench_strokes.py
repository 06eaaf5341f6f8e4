"""Coverage and overspray of planned strokes, by the closed form of the film.

Run `python benchmarks/bench_strokes.py`. The masks are exact and the gun is where it
should be: what a simulated cycle gives is this less the errors of map, base and arm.
Spray beyond the tile's edge is overspray too.
"""

import time
from collections.abc import Sequence

import numpy as np

from painter.planning.config import RasterConfig, TipConfig
from painter.planning.deposition import mean_film, predicted_film
from painter.planning.raster import plan_strokes
from painter.planning.stroke_lines import nominal_pitch
from painter.planning.tile import cell_centres
from painter.scene.load import load_scene
from painter.scene.surface import height_field, is_paintable
from perception.values import BoolArray

CELL = 0.01
MARGIN = 0.3
OPENINGS = ((0.5, 0.6, 1.0, 1.2), (1.6, 0.2, 0.2, 0.2))
CUBES = (
    (0.25, 0.25),
    (0.85, 0.35),
    (1.55, 0.30),
    (0.45, 0.95),
    (1.15, 1.05),
    (1.65, 1.45),
    (0.65, 1.65),
)


def main() -> None:
    """Prints the table."""
    tips = {
        "25 cm": TipConfig(),
        "12 cm": TipConfig(fan_width=0.12, flow=7.28e-6),
    }
    print("fan    lead    mask       lines strokes  >=80 %  >=50 %    over    CV  plan")
    for fan, tip in tips.items():
        for lead in (0.0, 0.005, 0.01, 0.02):
            for name, mask in masks().items():
                print(f"{fan}  {lead:.3f} m {name:10}", row(mask, tip, lead))


def masks() -> dict[str, BoolArray]:
    """Returns the tiles: painting.md's, and the truth of the named scenes."""
    cubes = [(x, y, 0.1, 0.1) for x, y in CUBES]
    own = {"openings": _wall(OPENINGS), "seven": _wall(cubes)}
    for scene in ("blank", "cubes", "obstacles", "room", "terrace"):
        field = height_field(load_scene(scene, 1), cell=CELL)
        own[scene] = is_paintable(field.kind)
    return own


def row(mask: BoolArray, tip: TipConfig, lead: float) -> str:
    """Plans a tile and returns its figures as text."""
    raster = RasterConfig(lead=lead)
    start = time.perf_counter()
    strokes = plan_strokes(mask, CELL, tip=tip, raster=raster)
    elapsed = time.perf_counter() - start
    pitch = nominal_pitch(mask.shape[1] * CELL, tip=tip, raster=raster)
    nominal = mean_film(tip, speed=raster.speed, pitch=pitch)
    wide = np.pad(mask, round(MARGIN / CELL))
    x, y = cell_centres(wide.shape, CELL, margin=MARGIN)
    film = predicted_film(strokes, x, y, tip=tip)
    on = film[wide] / nominal
    lines = len({stroke.column for stroke in strokes})
    return (
        f"{lines:5d} {len(strokes):7d} {100 * np.mean(on >= 0.8):7.1f} "
        f"{100 * np.mean(on >= 0.5):7.1f} {100 * film[~wide].sum() / film.sum():7.1f} "
        f"{100 * on.std() / on.mean():5.1f} {elapsed:4.2f} s"
    )


def _wall(keepouts: Sequence[tuple[float, ...]]) -> BoolArray:
    mask = np.ones((200, 200), dtype=bool)
    for x, y, width, height in keepouts:
        rows = slice(round(y / CELL), round((y + height) / CELL))
        mask[rows, round(x / CELL) : round((x + width) / CELL)] = False
    return mask


if __name__ == "__main__":
    main()
