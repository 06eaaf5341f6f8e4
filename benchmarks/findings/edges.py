"""What an edge allows: coverage against painted keep-out, by theory and as planned.

Run `python -m benchmarks.findings.edges --out DIR [--scene terrace]`; DIR gets
`edges.png` and the table is printed.

By theory: one stroke of a fan with half width a runs beside a straight edge at an
free offset. Wall counts as covered from `COVERED` of the nominal film, keep-out as
painted from `OVERSPRAYED`; a recess catches thinner film farther in. Along edges across
the strokes the fan's thickness does the same. Everything else is ideal: bare and
painted strips alone, no corners, no errors of mask, base or arm.

As planned: strokes from `plan_strokes` on the exact mask, by `FilmModel`, with more and
more weight on the keep-out.
"""

import argparse
from dataclasses import dataclass
from pathlib import Path
from unittest import mock

import matplotlib.pyplot as plt
import numpy as np

from painter.planning.config import RasterConfig, TipConfig
from painter.planning.film import film_cost
from painter.planning.film.deposition import half_axes
from painter.planning.film.figures import COVERED, OVERSPRAYED, FilmFigures
from painter.planning.film.film_model import FilmModel, Site
from painter.planning.strokes.raster import plan_strokes
from painter.planning.strokes.spray_settings import SpraySettings
from painter.scene.load import load_scene
from painter.scene.surface import height_field, is_paintable
from perception.ground import BoolArray, FloatArray

CELL = 0.01
TIP = TipConfig()
STANDOFFS = (0.30, 0.20, 0.10, 0.08, 0.06)  # m, of the strokes beside edges.
FLOWS = (1.0, 1.25, 1.5)  # Peak of such a stroke's film, as share of nominal.
# Of the keep-out: half of the planner's own weight, that, and twice as much.
WEIGHTS = tuple(share * film_cost.OPENINGS.keepout for share in (0.5, 1.0, 2.0))
REQUIRED = {"terrace": (0.96, 0.03), "room": (0.96, 0.03)}  # Coverage, keepout_paint.


@dataclass(frozen=True)
class Edges:
    """Lengths of a scene's edges and its areas; m and m².

    Attributes:
        along: Edges of keep-outs that run along the strokes.
        across: Those that run across them.
        wall: Area to be painted.
        keepout: Area of keep-outs.
        recess: How far keep-outs lie back.
    """

    along: float
    across: float
    wall: float
    keepout: float
    recess: float


def main() -> None:
    """Prints the table and draws the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--out", type=Path, default=Path("runs/edges"), help="folder of the picture"
    )
    parser.add_argument("--scene", default="terrace", help="a named scene")
    arguments = parser.parse_args()
    field = height_field(load_scene(arguments.scene, 1), cell=CELL)
    mask, height = is_paintable(field.kind), np.asarray(field.height)
    edges = edges_of(mask, height)
    print(f"{arguments.scene}: {edges}")
    arguments.out.mkdir(parents=True, exist_ok=True)
    figure, axes = plt.subplots(figsize=(7.0, 5.0), layout="constrained")
    print("\nby theory: least keep-out painted, %, at a coverage of")
    shares = (0.94, 0.95, 0.96, 0.97, 0.98)
    print("stand-off  flow " + "".join(f"{share:8.2f}" for share in shares))
    for standoff in STANDOFFS:
        for flow in FLOWS:
            coverage, painted = theory(edges, standoff, flow)
            lowest = [painted[coverage >= share].min() for share in shares]
            row = "".join(f"{100 * value:8.1f}" for value in lowest)
            print(f"{standoff:9.2f} {flow:5.2f} {row}")
        axes.plot(coverage, 100 * painted, label=f"theory, {100 * standoff:.0f} cm")
    print("\nas planned, exact mask")
    print("stand-off  weight coverage keep-out overspray      CV")
    for standoff in STANDOFFS[2:]:
        rows = [planned(mask, height, standoff, weight) for weight in WEIGHTS]
        for weight, row_of in zip(WEIGHTS, rows, strict=True):
            print(
                f"{standoff:9.2f} {weight:7.1f} {row_of.coverage:8.3f} "
                f"{100 * row_of.keepout_paint:6.1f} % {100 * row_of.overspray:7.1f} % "
                f"{100 * row_of.thickness_cv:5.1f} %"
            )
        points = np.array([(row.coverage, row.keepout_paint) for row in rows])
        name = f"planned, {100 * standoff:.0f} cm"
        axes.plot(points[:, 0], 100 * points[:, 1], "o--", label=name)
    if arguments.scene in REQUIRED:
        least, most = REQUIRED[arguments.scene]
        axes.plot(least, 100 * most, "k*", markersize=14, label="required")
    axes.set(
        xlim=(0.92, 1.0), ylim=(0.0, 16.0), xlabel="coverage", ylabel="keep-out, %"
    )
    axes.legend(fontsize="small")
    figure.savefig(arguments.out / f"edges_{arguments.scene}.png", dpi=110)


def edges_of(mask: BoolArray, height: FloatArray) -> Edges:
    """Measures a scene's edges inside the tile."""
    along = np.abs(np.diff(mask.astype(int), axis=1)).sum() * CELL
    across = np.abs(np.diff(mask.astype(int), axis=0)).sum() * CELL
    heights = height[~mask & np.isfinite(height)]
    return Edges(
        along=float(along),
        across=float(across),
        wall=float(mask.sum()) * CELL**2,
        keepout=float((~mask).sum()) * CELL**2,
        recess=float(max(-np.median(heights), 0.0)) if heights.size else 0.0,
    )


def theory(edges: Edges, standoff: float, flow: float) -> tuple[FloatArray, FloatArray]:
    """Returns coverage and painted keep-out (n,) over the offset of strokes from edges.

    Strokes along both kinds of edges have the same offset, so that either kind gains as
    much coverage for a centimetre of painted keep-out.

    Args:
        edges: Of the scene.
        standoff: Of the strokes beside edges, m.
        flow: Peak of their film, as share of nominal.
    """
    a, b = half_axes(TIP, standoff)
    spread = 1.0 + edges.recess / standoff  # Of what lands in a recess.

    def reach(film: float) -> float:
        """Share of the half width within which a stroke leaves at least `film`."""
        core = 1.0 - min(film / flow, 1.0) ** (1.0 / TIP.gamma)
        return float(np.sqrt(max(core, 0.0)))

    covers, paints = a * reach(COVERED), a * reach(OVERSPRAYED * spread)
    # A stroke's end: of the flow a share 1/2 + 3/4 s - 1/4 s³ has passed (beta2 = 2).
    s = np.linspace(-1.0, 1.0, 4001)
    passed = 0.5 + 0.75 * s - 0.25 * s**3
    end_covers = b * float(np.interp(COVERED, passed, s))
    end_paints = -b * float(np.interp(min(OVERSPRAYED * spread, 0.5), passed, s))

    shift = np.linspace(0.0, 0.08, 641)  # m, strokes towards the keep-out.
    bare = np.maximum(paints - covers - shift, 0.0)
    painted = np.maximum(shift * spread, 0.0)
    end_bare = np.maximum(end_covers + end_paints - shift, 0.0)
    lost = edges.along * bare + edges.across * end_bare
    lost_keepout = (edges.along + edges.across) * painted
    return 1.0 - lost / edges.wall, lost_keepout / edges.keepout


def planned(
    mask: BoolArray, height: FloatArray, standoff: float, weight: float
) -> FilmFigures:
    """Returns the figures of the planner's strokes."""
    raster = RasterConfig(cut_in_standoff=standoff)
    weights = film_cost.OPENINGS.replace(keepout=weight)
    with mock.patch.object(film_cost, "OPENINGS", weights):
        strokes = plan_strokes(mask, CELL, SpraySettings(TIP, raster), height=height)
    nominal = SpraySettings(TIP, raster).nominal_film(mask.shape[1] * CELL)
    site = Site.of_tile(mask, CELL, height)
    film = FilmModel(site, tip=TIP, speed=raster.speed, nominal=nominal).film(strokes)
    return FilmFigures.of(film[site.paintable], film[site.keepout], film.sum())


if __name__ == "__main__":
    main()
