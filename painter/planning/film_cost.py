"""What a film is worth: bare wall, uneven film, paint on what must stay clean."""

from dataclasses import dataclass

import numpy as np

from painter.planning.film_model import Site
from perception.values import BoolArray, FloatArray, FrozenValue

# Costs are areas of wall: a bare cell counts once. The others are chosen by
# benchmarks/bench_strokes.py so that the named scenes keep clear of their bounds.
_UNEVEN = 1.5  # A cell whose film is off by all of nominal.
_SPILT = 0.9  # A cell's worth of paint that lands off the wall.
_SOILED = 0.8  # All that stays clean soiled, as share of all wall bare ...
_SOILED_MOST = 11.0  # ... and the most that one soiled cell counts.
_BEGUN = 0.002  # A stroke, m²: its turn and its valve ...
_LENGTH = 0.001  # ... and a metre of it, m²: both cost time.


@dataclass(frozen=True, eq=False)
class FilmCost(FrozenValue):
    """Cost of film on single cells, as share of a bare cell's.

    Attributes:
        bare: Film below which a cell begins to count as bare, and where it does so in
            full, as shares of nominal.
        soiled: Film from which a cell that stays clean begins to count as soiled, and
            where it does so in full.
        soiled_weight: Cost of a soiled cell.
    """

    bare: tuple[float, float]
    soiled: tuple[float, float]
    soiled_weight: float

    @classmethod
    def coarse(cls) -> "FilmCost":
        """Makes the cost by which strokes are found: gentle slopes lead to them."""
        return cls((0.9, 0.7), (0.02, 0.14), 0.5)

    @classmethod
    def fine(cls, site: Site) -> "FilmCost":
        """Makes the cost by which they are fitted: bounds as `report.json` has them.

        Covered is a film of 80 % of nominal, soiled one of 10 %, both with something
        in hand; small things that stay clean count as much as large ones.
        """
        ratio = site.wanted.sum() / max(site.clean.sum(), 1)
        return cls((0.88, 0.76), (0.05, 0.13), min(_SOILED * ratio, _SOILED_MOST))

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
        on *= _UNEVEN
        on += _ramp(film, *self.bare)
        off = _SPILT * film
        if clean.any():
            off += self.soiled_weight * clean * _ramp(film, *self.soiled)
        return np.asarray(np.where(wanted, on, off))


def _ramp(film: FloatArray, begin: float, full: float) -> FloatArray:
    """Returns 0 up to `begin`, 1 from `full` on, a straight line between them."""
    share = film - begin
    share /= full - begin
    # As `np.clip`, which takes four times as long on a patch of film.
    return np.asarray(np.minimum(np.maximum(share, 0.0, out=share), 1.0, out=share))


def stroke_cost(length: float) -> float:
    """Returns what a stroke of `length`, m, costs in time, as area, m²."""
    return _BEGUN + _LENGTH * length
