"""What a film costs: bare wall, uneven film, paint on a keep-out."""

from dataclasses import dataclass

import numpy as np

from painter.planning.film.film_model import Site
from perception.ground import BoolArray, FloatArray, FrozenValue


@dataclass(frozen=True, eq=False)
class CostWeights(FrozenValue):
    """Costs, as areas of wall: a bare cell counts once.

    Attributes:
        uneven: A cell whose film is off by all of nominal.
        overspray: A cell's worth of paint that lands off the wall.
        keepout: All of the keep-out painted, as share of all wall bare, where there is
            as much of the one as of the other.
        rarity: Power of wall over keep-out by which one painted keep-out cell counts.
        bare: Film below which a cell begins to count as bare, and where it does so in
            full, as shares of nominal.
        painted: Film above which a keep-out cell begins to count as painted, and where
            it does so in full.
    """

    uneven: float
    overspray: float
    keepout: float
    rarity: float
    bare: tuple[float, float]
    painted: tuple[float, float]


# Beside openings the film can be even up to the edge, and evenness is what is hard to
# get. In the shade of things that stand out it is uneven at any cost, and what evenness
# would cost is better spent on coverage.
# Source: chosen by benchmarks/findings/edges.py, by plans from scans (scanned_film.py)
# and by whole cycles, so that the named scenes keep clear of their bounds.
OPENINGS = CostWeights(9.0, 1.65, 1.4, 1.8, (0.95, 0.72), (0.0625, 0.125))
_THINGS = CostWeights(1.0, 0.4, 0.5, 1.0, (0.88, 0.76), (0.05, 0.13))
_BARE_WALL = CostWeights(1.5, 0.9, 0.8, 1.0, (0.88, 0.76), (0.05, 0.13))
_MOST_KEEPOUT = 15.0  # Cost of one painted keep-out cell, at most.
_BEGUN = 0.002  # Cost of a stroke, m²: its turn and its valve ...
_LENGTH = 0.001  # ... and of a metre of it, m²: both cost time.


@dataclass(frozen=True, eq=False)
class FilmCost(FrozenValue):
    """Cost of film on single cells, as share of a bare cell's.

    Attributes:
        uneven: Cost of a cell to be painted whose film is off by all of nominal.
        overspray: Cost of a cell's worth of paint that lands elsewhere.
        bare: Film below which a cell begins to count as bare, and where it does so in
            full, as shares of nominal.
        painted: Film above which a keep-out cell begins to count as painted, and where
            it does so in full.
        keepout: Cost of a painted keep-out cell.
    """

    uneven: float
    overspray: float
    bare: tuple[float, float]
    painted: tuple[float, float]
    keepout: float

    @classmethod
    def touch_up(cls, site: Site) -> "FilmCost":
        """Makes the cost of a touch-up, which may leave uneven film but none thin.

        Along the edge of a touched-up spot the film is there already, and evenness
        would leave a thin line between the two.
        """
        fine = cls.fine(site)
        return fine.replace(
            uneven=min(fine.uneven, _THINGS.uneven),
            overspray=min(fine.overspray, _THINGS.overspray),
        )

    @classmethod
    def coarse(cls, site: Site) -> "FilmCost":
        """Makes the cost by which strokes are found: gentle slopes lead to them."""
        weights = _weights(site)
        return cls(weights.uneven, weights.overspray, (0.9, 0.7), (0.02, 0.14), 0.5)

    @classmethod
    def fine(cls, site: Site) -> "FilmCost":
        """Makes the cost by which strokes are fitted.

        Its ramps lie around the bounds of the figures, `COVERED` and `OVERSPRAYED`,
        with something in hand; small keep-outs count as much as large ones.
        """
        weights = _weights(site)
        ratio = site.paintable.sum() / max(site.keepout.sum(), 1)
        return cls(
            weights.uneven,
            weights.overspray,
            weights.bare,
            weights.painted,
            min(weights.keepout * ratio**weights.rarity, _MOST_KEEPOUT),
        )

    def on(self, paintable: BoolArray, keepout: BoolArray) -> "CellCosts":
        """Returns the costs of given cells.

        Args:
            paintable: (ny, nx), cells to be painted.
            keepout: (ny, nx), cells of the tile's keep-out.
        """
        # Of every cell: film at which its ramp begins and ends, and the ramp's cost.
        begin = np.where(paintable, self.bare[0], self.painted[0])
        full = np.where(paintable, self.bare[1], self.painted[1])
        weight = np.where(paintable, 1.0, self.keepout * keepout)
        square = np.where(paintable, self.uneven, 0.0)
        linear = np.where(paintable, -2.0 * self.uneven, self.overspray)
        return CellCosts(square, linear, begin, 1.0 / (full - begin), weight)


@dataclass(frozen=True, eq=False)
class CellCosts(FrozenValue):
    """Costs of film on certain cells: a parabola and a ramp for each.

    Attributes:
        square: (ny, nx), cost of the film squared, and of no film.
        linear: (ny, nx), cost of the film.
        begin: (ny, nx), film at which the ramp begins.
        slope: (ny, nx), of the ramp until it is 1.
        weight: (ny, nx), cost of the whole ramp.
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


def stroke_cost(length: float) -> float:
    """Returns what a stroke of `length`, m, costs in time, as area, m²."""
    return _BEGUN + _LENGTH * length


def _weights(site: Site) -> CostWeights:
    if not site.keepout.any():
        return _BARE_WALL
    return _THINGS if site.stands_out else OPENINGS
