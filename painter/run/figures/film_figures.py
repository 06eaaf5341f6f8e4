"""Figures of the paint film."""

import numpy as np
from scipy import ndimage

from painter.planning.film.figures import COVERED, OVERSPRAYED
from painter.run.folder.values import Film
from perception.ground import BoolArray

HALF_COVERED = 0.5  # Share of nominal.


def film_figures(film: Film, *, nominal: float, fan_width: float) -> dict:
    """Coverage, uniformity, overspray and paint on keep-out.

    Args:
        film: The film.
        nominal: Thickness the program aimed at, m.
        fan_width: Length of the fan's long axis on the wall, m.

    Returns:
        `coverage`, `coverage_half`, `thickness_mean_m`, `thickness_cv`,
        `thickness_cv_interior`, `overspray` and `keepout_paint` of DESIGN section 6,
        each a number, or None where nothing is there to be counted.

    Raises:
        ValueError: `nominal` is not above zero.
    """
    if not nominal > 0.0:
        raise ValueError(f"nominal thickness must be > 0 m, got {nominal!r}.")
    on_wall = film.thickness[film.truth_paintable]
    on_keepout = film.thickness[film.truth_keepout]
    far = edge_distance(film.truth_paintable, film.cell) >= 0.5 * fan_width
    return {
        "coverage": _share(on_wall >= COVERED * nominal),
        "coverage_half": _share(on_wall >= HALF_COVERED * nominal),
        "thickness_mean_m": float(on_wall.mean()) if on_wall.size else None,
        "thickness_cv": variation(on_wall),
        "thickness_cv_interior": variation(film.thickness[far]),
        "overspray": overspray(film),
        "keepout_paint": _share(on_keepout >= OVERSPRAYED * nominal),
    }


def overspray(film: Film) -> float | None:
    """Share of the landed volume that is not on paintable cells."""
    if film.landed <= 0.0:
        return None
    on_wall = film.thickness[film.truth_paintable].sum() * film.cell**2
    return float(1.0 - on_wall / film.landed)


def mass_balance_error(film: Film, transfer_efficiency: float) -> float | None:
    """|sprayed x transfer efficiency - landed - missed| / sprayed."""
    if film.sprayed <= 0.0:
        return None
    rest = film.sprayed * transfer_efficiency - film.landed - film.missed
    return float(abs(rest) / film.sprayed)


def edge_distance(paintable: BoolArray, cell: float) -> np.ndarray:
    """Distance of each cell centre to the edge of the paintable area, m; 0 outside it.

    The border of the grid counts as an edge.
    """
    padded = np.pad(paintable, 1)
    steps = ndimage.distance_transform_edt(padded)[1:-1, 1:-1]
    # The edge lies half a cell before the centre of the first cell beyond it.
    return np.where(paintable, (steps - 0.5) * cell, 0.0)


def variation(values: np.ndarray) -> float | None:
    """Coefficient of variation (population), or None for no or unpainted cells."""
    if values.size == 0 or values.mean() <= 0.0:
        return None
    return float(values.std() / values.mean())


def _share(flags: np.ndarray) -> float | None:
    return float(flags.mean()) if flags.size else None
