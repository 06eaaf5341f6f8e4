"""The film that a program will leave, before anything moves."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import map_coordinates

from painter.planning.config import TipConfig
from painter.planning.film.figures import FilmFigures
from painter.planning.film.film_model import FilmModel, Site
from painter.planning.spray_path import Stroke
from perception.ground import FloatArray, FrozenValue
from perception.values import WallSegmentation

_SPEED = 1.0  # m/s, of the lines that strokes are scaled from.


@dataclass(frozen=True, eq=False)
class FilmPreview(FrozenValue):
    """Predicted wet film on the tile and a margin around it.

    Attributes:
        film: (ny, nx) m; row 0 at the bottom.
        cell: Edge of a cell, m.
        border: Cells of margin on each side of the tile.
        figures: Of this film.
    """

    film: FloatArray
    cell: float
    border: int
    figures: FilmFigures

    def film_at(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Returns the film at points of T, m; 0 beyond the margin.

        Args:
            x: Any shape, m.
            y: That shape, m.
        """
        column = x / self.cell + self.border - 0.5
        row = y / self.cell + self.border - 0.5
        return np.asarray(map_coordinates(self.film, [row, column], order=1))


def preview_film(
    strokes: Sequence[Stroke],
    segmentation: WallSegmentation,
    *,
    tip: TipConfig,
    nominal: float,
    before: FloatArray | None = None,
) -> FilmPreview:
    """Predicts the film of strokes on a wall as it was seen.

    Args:
        strokes: Along T y.
        segmentation: Of the tile; things that stand out shade what is behind them.
        tip: The spray tip.
        nominal: Wet film aimed at, m.
        before: Film that is there already, m, on the tile and `margin_cells` around
            it; None = nothing.

    Returns:
        The film and its figures.
    """
    site = Site.of_tile(
        np.asarray(segmentation.wall_mask),
        segmentation.cell,
        np.asarray(segmentation.depth, dtype=np.float64),
    )
    film = FilmModel(site, tip=tip, speed=_SPEED, nominal=nominal).film(strokes)
    if before is not None:
        film = film + before / nominal
    return FilmPreview(
        film=film * nominal,
        cell=site.cell,
        border=site.border,
        figures=FilmFigures.of(film[site.paintable], film[site.keepout], film.sum()),
    )
