"""The film that a program will leave, before anything moves."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import map_coordinates

from painter.planning.config import TipConfig
from painter.planning.film.film_model import FilmModel, Site
from painter.planning.spray_path import Stroke
from perception.ground import FloatArray, FrozenValue
from perception.values import WallSegmentation

_COVERED = 0.8  # Shares of nominal, as `report.json` counts.
_SOILED = 0.1
_SPEED = 1.0  # m/s, of the lines that strokes are scaled from.


@dataclass(frozen=True, eq=False)
class FilmPreview(FrozenValue):
    """Predicted wet film on the tile and a margin around it.

    Attributes:
        film: (ny, nx) m; row 0 at the bottom.
        cell: Edge of a cell, m.
        border: Cells of margin on each side of the tile.
        coverage: Share of the cells to be painted with at least 80 % of nominal.
        thickness_cv: Standard deviation / mean over these cells.
        overspray: Share of the landed paint that is not on them.
        keepout_paint: Share of what stays clean with at least 10 % of nominal; 0 where
            nothing does.
    """

    film: FloatArray
    cell: float
    border: int
    coverage: float
    thickness_cv: float
    overspray: float
    keepout_paint: float

    def film_at(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Returns the film at points of T, m; 0 beyond the margin.

        Args:
            x: Any shape, m.
            y: That shape, m.
        """
        column = x / self.cell + self.border - 0.5
        row = y / self.cell + self.border - 0.5
        return np.asarray(map_coordinates(self.film, [row, column], order=1))

    def figures(self) -> dict[str, float]:
        """Returns the figures by their names in `report.json`."""
        names = ("coverage", "thickness_cv", "overspray", "keepout_paint")
        return {name: float(getattr(self, name)) for name in names}


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
    wall, clean, landed = film[site.wanted], film[site.clean], film.sum()
    mean = wall.mean() if wall.size else 0.0
    return FilmPreview(
        film=film * nominal,
        cell=site.cell,
        border=site.border,
        coverage=float((wall >= _COVERED).mean()) if wall.size else 0.0,
        thickness_cv=float(wall.std() / mean) if mean > 0.0 else 0.0,
        overspray=float(1.0 - wall.sum() / landed) if landed > 0.0 else 0.0,
        keepout_paint=float((clean >= _SOILED).mean()) if clean.size else 0.0,
    )
