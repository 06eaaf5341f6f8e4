"""Strokes side by side: a plain raster, lines placed for edges, cut in, in two coats.

Run `python -m benchmarks.findings.strokes [SCENE ...]`. The masks are exact and the gun
is where it should be: what a simulated cycle gives is this less the errors of map, base
and arm. Film is that of `FilmModel`, shaded by what stands out; spray beyond the tile's
edge is overspray too. Time is the strokes' and the estimated moves' between them.

The plain raster is the paper's way: evenly spaced lines, the gun open where its axis
points at wall (Tadic et al. 2021).
"""

import sys
import time
from collections.abc import Callable

import numpy as np

from painter.planning.config import RasterConfig, TipConfig
from painter.planning.film.figures import FilmFigures
from painter.planning.film.film_model import FilmModel, Site
from painter.planning.spray_path import Stroke
from painter.planning.strokes.raster import plan_strokes
from painter.planning.strokes.spray_settings import SpraySettings
from painter.planning.strokes.stroke_order import order_strokes, transition_time
from painter.scene.load import load_scene
from painter.scene.surface import height_field, is_paintable
from perception.ground import BoolArray, FloatArray

CELL = 0.01
SCENES = ("blank", "terrace", "room", "cubes", "obstacles")
TIP = TipConfig()
HOME_T = np.array([1.0, 1.0, 0.5])


def main() -> None:
    """Prints the table."""
    ways: dict[str, Callable[[BoolArray, FloatArray], tuple[Stroke, ...]]] = {
        "plain": plain,
        "placed": lambda mask, height: planned(mask, height, cut_in=False),
        "cut in": lambda mask, height: planned(mask, height),
        "2 coats": lambda mask, height: planned(mask, height, coats=2),
    }
    print("scene      way     strokes  time  >=80 %   over     CV  keep-out   plan")
    for scene in sys.argv[1:] or SCENES:
        field = height_field(load_scene(scene, 1), cell=CELL)
        mask, height = is_paintable(field.kind), np.asarray(field.height)
        for way, plan in ways.items():
            start = time.process_time()
            strokes = plan(mask, height)
            elapsed = time.process_time() - start
            print(f"{scene:10} {way:7} {row(mask, height, strokes)} {elapsed:5.2f} s")


def plain(mask: BoolArray, height: FloatArray) -> tuple[Stroke, ...]:
    """Returns evenly spaced strokes, open where the axis points at wall."""
    raster = RasterConfig()
    width = mask.shape[1] * CELL
    pitch = SpraySettings(TIP, raster).nominal_pitch(width)
    strokes = []
    for column in range(round(width / pitch)):
        x_line = (column + 0.5) * pitch
        on = mask[:, int(x_line / CELL)]
        edges = np.flatnonzero(np.diff(on, prepend=False, append=False))
        strokes += [
            Stroke(
                np.array([x_line, low * CELL]),
                np.array([x_line, high * CELL]),
                raster.speed,
                "body",
                column,
                raster.standoff,
            )
            for low, high in edges.reshape(-1, 2)
        ]
    return tuple(strokes)


def planned(
    mask: BoolArray, height: FloatArray, *, cut_in: bool = True, coats: int = 1
) -> tuple[Stroke, ...]:
    """Returns our strokes."""
    raster = RasterConfig(cut_in=cut_in, coats=coats)
    return plan_strokes(mask, CELL, SpraySettings(TIP, raster), height=height)


def row(mask: BoolArray, height: FloatArray, strokes: tuple[Stroke, ...]) -> str:
    """Returns the figures of strokes as text."""
    raster = RasterConfig()
    site = Site.of_tile(mask, CELL, height)
    nominal = SpraySettings(TIP, raster).nominal_film(mask.shape[1] * CELL)
    model = FilmModel(site, tip=TIP, speed=raster.speed, nominal=nominal)
    film = model.film(strokes)
    on, off = film[site.paintable], film[site.keepout]
    seconds = sum(stroke.length / stroke.speed for stroke in strokes)
    for coat in {stroke.coat for stroke in strokes}:
        of_coat = [stroke for stroke in strokes if stroke.coat == coat]
        ordered = order_strokes(of_coat, HOME_T, HOME_T)
        seconds += transition_time(ordered, HOME_T, HOME_T)
    found = FilmFigures.of(on, off, film.sum())
    keepout = f"{100 * found.keepout_paint:7.1f} %" if off.size else "        -"
    return (
        f"{len(strokes):7d} {seconds:5.0f} s {100 * found.coverage:5.1f} % "
        f"{100 * found.overspray:4.1f} % "
        f"{100 * found.thickness_cv:4.1f} % {keepout}"
    )


if __name__ == "__main__":
    main()
