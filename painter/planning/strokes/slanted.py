"""Lines along the sides of what leans: a stick, a rotated box, a wall hung askew."""

import numpy as np
from scipy.ndimage import find_objects, label

from painter.planning.film.film_model import Site
from painter.planning.strokes.film_fit import MOST_LEAN
from perception.ground import BoolArray, FloatArray

# Sides of what stays clean along which lines lean: at least so long and so straight, in
# cells, and leaning more than fitting alone would find, m/m.
_LONG_SIDE = 12
_STRAIGHT = 1.3
_LEAST_LEAN = 0.04


def slanted_lines(
    site: Site, reach: float, spacing: float
) -> list[tuple[float, FloatArray]]:
    """Returns lines along what leans: their lean and where they meet T y = 0, m.

    A side of what stays clean leans if a straight line runs along it, cell by cell.

    Args:
        site: The tile.
        reach: How far beside such things lines are tried, m.
        spacing: Between lines, m.
    """
    lines: list[tuple[float, FloatArray]] = []
    regions, _ = label(site.clean)
    for number, (rows, columns) in enumerate(find_objects(regions), start=1):
        region = regions[rows, columns] == number
        left, right = site.x[columns.start], site.x[columns.stop - 1]
        for lean in _leans(region):
            y = 0.5 * (site.y[rows.start] + site.y[rows.stop - 1])
            slack = reach + 0.5 * abs(lean) * (rows.stop - rows.start) * site.cell
            count = round((right - left + 2.0 * slack) / spacing)
            x = np.linspace(left - slack, right + slack, count + 1)
            lines.append((lean, x - lean * y))
    return lines


def _leans(region: BoolArray) -> set[float]:
    """Returns by how much sides of a region go to the right in going up, m/m."""
    found: set[float] = set()
    for side in (region.argmax(axis=1), -region[:, ::-1].argmax(axis=1)):
        farthest = int(side.argmin())
        pieces = (slice(0, None), slice(0, farthest + 1), slice(farthest, None))
        for piece in pieces:
            x = side[piece]
            y = np.arange(x.size)
            if x.size < _LONG_SIDE:
                continue
            lean, start = np.polyfit(y, x, 1)
            straight = np.abs(x - start - lean * y).max() < _STRAIGHT
            if straight and _LEAST_LEAN < abs(lean) < MOST_LEAN:
                found.add(round(float(lean), 2))
    return found
