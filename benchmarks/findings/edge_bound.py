"""The most even film that any strokes can leave beside a scene's edges: a convex bound.

Run `python -m benchmarks.findings.edge_bound [--scene terrace]`; the table is printed.

Beside a straight edge along the strokes the film depends on the place across alone, and
it is a sum of the fan's profiles, from any place and from any stand-off not below the
nearest, each with an exposure that is not negative. For a bare strip and a painted
keep-out strip of given widths, the exposures of least variance are a quadratic
programme. The scene's bound takes the best widths that keep coverage, keep-out and
overspray as required. Ends of strokes, corners, the number of strokes, the arm and the
mask are ideal: no plan with this tip does better.
"""

import argparse
import itertools
from typing import NamedTuple

import numpy as np
from pydrake.solvers import ClarabelSolver, MathematicalProgram
from scipy.special import betainc

from benchmarks.findings.edges import CELL, TIP, edges_of
from painter.planning.config import RasterConfig
from painter.planning.film.deposition import half_axes
from painter.planning.film.figures import COVERED, OVERSPRAYED
from painter.scene.load import load_scene
from painter.scene.surface import height_field, is_paintable
from perception.ground import FloatArray

STANDOFFS = (0.12, 0.10, 0.08, 0.06)  # m, nearest of all strokes.
WIDER = (1.0, 1.5, 2.2)  # Times the nearest: other stand-offs that may be used.
REQUIRED = {"coverage": 0.96, "keepout": 0.03, "overspray": 0.05}
STEP = 0.0025  # m, of the film ...
LINE_STEP = 0.005  # m, ... and between lines.
WALL, BEYOND = 0.40, 0.25  # m, evaluated on either side of an edge.
STRIPS = (0.0, 0.0025, 0.005, 0.0075, 0.01, 0.015)  # m, bare and painted.
OVERSPRAY_PRICES = (0.0, 0.1, 0.3)  # Variance that a metre of overspray is worth.


class Edge(NamedTuple):
    """The best film beside an edge, all a metre of edge.

    Attributes:
        bare: Width of the bare strip, m.
        painted: Width of the painted keep-out strip, m.
        variance: Integral of the film's squared deviation from nominal, m.
        overspray: Paint that lands beyond the edge, as width of nominal film, m.
    """

    bare: float
    painted: float
    variance: float
    overspray: float


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scene", default="terrace", help="a named scene")
    field = height_field(load_scene(parser.parse_args().scene, 1), cell=CELL)
    mask, height = is_paintable(field.kind), np.asarray(field.height)
    edges = edges_of(mask, height)
    sides = float(mask[:, 0].sum() + mask[:, -1].sum()) * CELL
    print(f"{edges}; tile's own edges along the strokes {sides:.2f} m")
    print(f"least CV with {REQUIRED}\nnearest      CV   strips beside a keep-out")
    for nearest in STANDOFFS:
        inner = best_films(nearest, edges.recess, keepout=True)
        outer = best_films(nearest, 0.0, keepout=False)
        least, best = np.inf, None
        for one, other in itertools.product(inner, outer):
            bare = edges.along * one.bare + sides * other.bare
            overspray = edges.along * one.overspray + sides * other.overspray
            if (
                bare > (1.0 - REQUIRED["coverage"]) * edges.wall
                or edges.along * one.painted > REQUIRED["keepout"] * edges.keepout
                or overspray > REQUIRED["overspray"] * (edges.wall + overspray)
            ):
                continue
            variance = edges.along * one.variance + sides * other.variance
            if variance < least:
                least, best = variance, one
        if best is None:
            print(f"{nearest:7.2f}    none")
            continue
        print(
            f"{nearest:7.2f} {100 * np.sqrt(least / edges.wall):6.1f} %   bare "
            f"{100 * best.bare:.2f} cm, painted {100 * best.painted:.2f} cm"
        )


def best_films(nearest: float, recess: float, *, keepout: bool) -> list[Edge]:
    """Returns the best films beside one kind of edge, for all widths of strips.

    Args:
        nearest: Least stand-off, m.
        recess: How far the surface beyond the edge lies back, m.
        keepout: Whether that surface is keep-out.
    """
    wall, beyond = profiles(nearest, recess)
    found = []
    for bare, painted, price in itertools.product(
        STRIPS, STRIPS if keepout else (BEYOND,), OVERSPRAY_PRICES
    ):
        films = least_variance(wall, beyond, bare, painted, price)
        if films is not None:
            variance = float(((films[0] - 1.0) ** 2).sum() * STEP)
            overspray = float(films[1].sum() * STEP)
            found.append(Edge(bare, painted if keepout else 0.0, variance, overspray))
    return found


def profiles(nearest: float, recess: float) -> tuple[FloatArray, FloatArray]:
    """Returns the films of single strokes, a column each, on the wall and beyond.

    Rows go away from the edge, a `STEP` each. A ray that passes the edge lands where it
    meets the recess.
    """
    wall = np.arange(0.0, WALL + STEP / 2, STEP)
    beyond = -np.arange(0.0, BEYOND + STEP / 2, STEP)
    on_wall, off_wall = [], []
    for standoff in (*(share * nearest for share in WIDER), RasterConfig().standoff):
        a, _ = half_axes(TIP, standoff)
        spread = 1.0 + recess / standoff
        for x in np.arange(-a, WALL + a, LINE_STEP):
            # No ray beyond the edge has left for the wall's side of it.
            past = np.minimum((beyond - x) / (a * spread), -x / a)
            on_wall.append(np.diff(_landed((wall - x) / a)) / STEP)
            off_wall.append(-np.diff(_landed(past)) / STEP)
    return np.array(on_wall).T, np.array(off_wall).T


def least_variance(
    wall: FloatArray, beyond: FloatArray, bare: float, painted: float, price: float
) -> tuple[FloatArray, FloatArray] | None:
    """Returns the film on the wall and beyond that costs least; None if none can be."""
    count = wall.shape[1]
    programme = MathematicalProgram()
    exposure = programme.NewContinuousVariables(count)
    programme.AddBoundingBoxConstraint(0.0, np.inf, exposure)
    programme.AddQuadraticCost(
        2.0 * STEP * wall.T @ wall + 1e-9 * np.eye(count),
        STEP * (price * beyond.sum(axis=0) - 2.0 * wall.sum(axis=0)),
        exposure,
        is_convex=True,
    )
    covered = wall[round(bare / STEP) :]
    outside = beyond[round(painted / STEP) :]
    bounds_of = ((covered, COVERED, np.inf), (outside, -np.inf, OVERSPRAYED))
    for rows, low, high in bounds_of:
        if len(rows):
            bounds = (np.full(len(rows), bound) for bound in (low, high))
            programme.AddLinearConstraint(rows, *bounds, exposure)
    result = ClarabelSolver().Solve(programme)
    if not result.is_success():
        return None
    best = result.GetSolution(exposure)
    return wall @ best, beyond @ best


def _landed(u: FloatArray) -> FloatArray:
    """Returns the share of the flow at fan coordinates below u."""
    power = TIP.gamma + 1.0
    return np.asarray(betainc(power, power, 0.5 + 0.5 * np.clip(u, -1.0, 1.0)))


if __name__ == "__main__":
    main()
