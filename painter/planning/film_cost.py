"""What a film is worth: bare wall, uneven film, paint on what must stay clean."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from painter.planning.film_model import Site
from perception.values import BoolArray, FloatArray, FrozenValue


class _Weights(NamedTuple):
    """Costs, as areas of wall: a bare cell counts once.

    Attributes:
        uneven: A cell whose film is off by all of nominal.
        spilt: A cell's worth of paint that lands off the wall.
        soiled: All that stays clean soiled, as share of all wall bare.
        bare: Film at which a cell begins to count as bare, and does so in full.
        dirty: Film at which a cell that stays clean begins to count as soiled, and
            does so in full.
    """

    uneven: float
    spilt: float
    soiled: float
    bare: tuple[float, float]
    dirty: tuple[float, float]


# Chosen by benchmarks/bench_edges.py so that the named scenes keep clear of their
# bounds. Beside openings the film can be even up to the edge, and evenness is what is
# hard to get. Where things stand out their shade is uneven at any price, and what
# evenness would cost is better spent on coverage.
_OPENINGS = _Weights(10.0, 1.6, 1.6, (0.95, 0.72), (0.06, 0.12))
_THINGS = _Weights(1.0, 0.4, 0.4, (0.88, 0.76), (0.05, 0.13))
_BARE_WALL = _Weights(1.5, 0.9, 0.8, (0.88, 0.76), (0.05, 0.13))
_SOILED_MOST = 13.0  # That one soiled cell counts.
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
            min(weights.soiled * ratio, _SOILED_MOST),
        )

    def __call__(
        self, film: FloatArray, wanted: BoolArray, clean: BoolArray
    ) -> FloatArray:
        """Returns the cost of each cell.

        Args:
            film: As shares of nominal, any shape.
            wanted: Cells to be painted, the last axes of that shape.
            clean: Cells of the tile that stay clean.
        """
        on = film - 1.0
        on *= on
        on *= self.uneven
        on += _ramp(film, *self.bare)
        off = self.spilt * film
        if clean.any():
            off += self.soiled_weight * clean * _ramp(film, *self.soiled)
        return np.asarray(np.where(wanted, on, off))


def _weights(site: Site) -> _Weights:
    if not site.clean.any():
        return _BARE_WALL
    return _THINGS if site.stands_out else _OPENINGS


def _ramp(film: FloatArray, begin: float, full: float) -> FloatArray:
    """Returns 0 up to `begin`, 1 from `full` on, a straight line between them."""
    share = film - begin
    share /= full - begin
    # As `np.clip`, which takes four times as long on a patch of film.
    return np.asarray(np.minimum(np.maximum(share, 0.0, out=share), 1.0, out=share))


def stroke_cost(length: float) -> float:
    """Returns what a stroke of `length`, m, costs in time, as area, m²."""
    return _BEGUN + _LENGTH * length
