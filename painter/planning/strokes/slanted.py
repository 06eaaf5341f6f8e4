"""Lines along slanted sides: of a stick, a rotated box, a wall hung askew."""

import numpy as np
from scipy.ndimage import find_objects, label

from painter.planning.film.film_model import Site
from painter.planning.strokes.film_fit import MOST_SLANT
from perception.ground import BoolArray, FloatArray

# Sides of keep-outs that get slanted lines: at least so long and so straight, in cells,
# and more slanted than fitting alone would find, m/m.
_LONG_SIDE = 12
_STRAIGHT = 1.3
_LEAST_SLANT = 0.04


def slanted_lines(
    site: Site, reach: float, spacing: float
) -> list[tuple[float, FloatArray]]:
    """Returns lines along slanted sides: their slant and where they meet T y = 0, m.

    A side of a keep-out is slanted if a straight line runs along it, cell by cell.

    Args:
        site: The tile.
        reach: How far beside keep-outs lines are tried, m.
        spacing: Between lines, m.
    """
    lines: list[tuple[float, FloatArray]] = []
    regions, _ = label(site.keepout)
    for number, (rows, columns) in enumerate(find_objects(regions), start=1):
        region = regions[rows, columns] == number
        left, right = site.x[columns.start], site.x[columns.stop - 1]
        for slant in _slants(region):
            y = 0.5 * (site.y[rows.start] + site.y[rows.stop - 1])
            slack = reach + 0.5 * abs(slant) * (rows.stop - rows.start) * site.cell
            count = round((right - left + 2.0 * slack) / spacing)
            x = np.linspace(left - slack, right + slack, count + 1)
            lines.append((slant, x - slant * y))
    return lines


def _slants(region: BoolArray) -> set[float]:
    """Returns the slants of a region's sides, m to the right per m up."""
    found: set[float] = set()
    for side in (region.argmax(axis=1), -region[:, ::-1].argmax(axis=1)):
        farthest = int(side.argmin())
        pieces = (slice(0, None), slice(0, farthest + 1), slice(farthest, None))
        for piece in pieces:
            x = side[piece]
            y = np.arange(x.size)
            if x.size < _LONG_SIDE:
                continue
            slant, start = np.polyfit(y, x, 1)
            straight = np.abs(x - start - slant * y).max() < _STRAIGHT
            if straight and _LEAST_SLANT < abs(slant) < MOST_SLANT:
                found.add(round(float(slant), 2))
    return found
