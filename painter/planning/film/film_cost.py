"""What a film is worth: bare wall, uneven film, paint on what must stay clean."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from painter.planning.film.film_model import Site
from perception.ground import BoolArray, FloatArray, FrozenValue


class _Weights(NamedTuple):
    """Costs, as areas of wall: a bare cell counts once.

    Attributes:
        uneven: A cell whose film is off by all of nominal.
        spilt: A cell's worth of paint that lands off the wall.
        soiled: All that stays clean soiled, as share of all wall bare, where there is
            as much of the one as of the other.
        rarity: Power of wall over what stays clean by which one soiled cell counts.
        bare: Film at which a cell begins to count as bare, and does so in full.
        dirty: Film at which a cell that stays clean begins to count as soiled, and
            does so in full.
    """

    uneven: float
    spilt: float
    soiled: float
    rarity: float
    bare: tuple[float, float]
    dirty: tuple[float, float]


# Chosen by benchmarks/findings/edges.py, by plans from scans (scanned_film.py)
# and by whole cycles, so that the named scenes keep clear of their bounds. Beside
# openings the film can be even up to the edge, and evenness is what is hard to get.
# Where things stand out their shade is uneven at any price, and what evenness would
# cost is better spent on coverage.
_OPENINGS = _Weights(9.0, 1.65, 1.4, 1.8, (0.95, 0.72), (0.0625, 0.125))
_THINGS = _Weights(1.0, 0.4, 0.5, 1.0, (0.88, 0.76), (0.05, 0.13))
_BARE_WALL = _Weights(1.5, 0.9, 0.8, 1.0, (0.88, 0.76), (0.05, 0.13))
_SOILED_MOST = 15.0  # That one soiled cell counts.
_BEGUN = 0.002  # A stroke, m²: its turn and its valve ...
_LENGTH = 0.001  # ... and a metre of it, m²: both cost time.


@dataclass(frozen=True, eq=False)
class FilmCost(FrozenValue):
    """Cost of film on single cells, as share of a bare cell's.

    Attributes:
        uneven: Cost of a cell to be painted whose film is off by all of nominal.
        spilt: Cost of a cell's worth of paint that lands elsewhere.
        bare: Film below which a cell begins to count as bare, and where it does so in
            full, as shares of nominal.
        soiled: Film from which a cell that stays clean begins to count as soiled, and
            where it does so in full.
        soiled_weight: Cost of a soiled cell.
    """

    uneven: float
    spilt: float
    bare: tuple[float, float]
    soiled: tuple[float, float]
    soiled_weight: float

    @classmethod
    def mending(cls, site: Site) -> "FilmCost":
        """Makes the cost of mending: a seam may be uneven, if only nothing stays thin.

        Along the edge of what is mended the film is there already, and evenness would
        leave a thin line between the two.
        """
        fine = cls.fine(site)
        uneven, spilt = min(fine.uneven, _THINGS.uneven), min(fine.spilt, _THINGS.spilt)
        return fine.replace(uneven=uneven, spilt=spilt)

    @classmethod
    def coarse(cls, site: Site) -> "FilmCost":
        """Makes the cost by which strokes are found: gentle slopes lead to them."""
        weights = _weights(site)
        return cls(weights.uneven, weights.spilt, (0.9, 0.7), (0.02, 0.14), 0.5)

    @classmethod
    def fine(cls, site: Site) -> "FilmCost":
        """Makes the cost by which they are fitted: bounds as `report.json` has them.

        Covered is a film of 80 % of nominal, soiled one of 10 %, both with something
        in hand; small things that stay clean count as much as large ones.
        """
        weights = _weights(site)
        ratio = site.wanted.sum() / max(site.clean.sum(), 1)
        return cls(
            weights.uneven,
            weights.spilt,
            weights.bare,
            weights.dirty,
            min(weights.soiled * ratio**weights.rarity, _SOILED_MOST),
        )

    def on(self, wanted: BoolArray, clean: BoolArray) -> "CellCosts":
        """Returns the costs of given cells.

        Args:
            wanted: (ny, nx), cells to be painted.
            clean: (ny, nx), cells of the tile that stay clean.
        """
        # Of every cell: which film begins to cost, which does so in full, and what.
        begin = np.where(wanted, self.bare[0], self.soiled[0])
        full = np.where(wanted, self.bare[1], self.soiled[1])
        weight = np.where(wanted, 1.0, self.soiled_weight * clean)
        square = np.where(wanted, self.uneven, 0.0)
        linear = np.where(wanted, -2.0 * self.uneven, self.spilt)
        return CellCosts(square, linear, begin, 1.0 / (full - begin), weight)

    def __call__(
        self, film: FloatArray, wanted: BoolArray, clean: BoolArray
    ) -> FloatArray:
        """Returns the cost of each cell.

        Args:
            film: As shares of nominal, any shape.
            wanted: Cells to be painted, the last axes of that shape.
            clean: Cells of the tile that stay clean.
        """
        return self.on(wanted, clean)(film)


@dataclass(frozen=True, eq=False)
class CellCosts(FrozenValue):
    """Costs of film on certain cells: a parabola and a ramp for each.

    Attributes:
        square: (ny, nx), of the film squared, and what no film costs.
        linear: (ny, nx), of the film.
        begin: (ny, nx), film at which the ramp begins.
        slope: (ny, nx), of the ramp until it is 1.
        weight: (ny, nx), of the ramp.
    """

    square: FloatArray
    linear: FloatArray
    begin: FloatArray
    slope: FloatArray
    weight: FloatArray

    def __call__(self, film: FloatArray, where: tuple[slice, ...] = ()) -> FloatArray:
        """Returns the cost of each cell.

        Args:
            film: As shares of nominal, its last axes as those of the cells.
            where: On which rows and columns it lies; () = on all.
        """
        square = self.square[where]
        cost: FloatArray = square * film
        cost += self.linear[where]
        cost *= film
        cost += square
        ramp = film - self.begin[where]
        ramp *= self.slope[where]
        # As `np.clip`, which takes four times as long on a patch of film.
        np.minimum(np.maximum(ramp, 0.0, out=ramp), 1.0, out=ramp)
        ramp *= self.weight[where]
        cost += ramp
        return cost


def _weights(site: Site) -> _Weights:
    if not site.clean.any():
        return _BARE_WALL
    return _THINGS if site.stands_out else _OPENINGS


def stroke_cost(length: float) -> float:
    """Returns what a stroke of `length`, m, costs in time, as area, m²."""
    return _BEGUN + _LENGTH * length
