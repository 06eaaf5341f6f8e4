"""Strokes that touch up a film where it is thin, and no others.

They are found and fitted as cut-ins are, on the film that is there already: from as
near or far as what stands out allows, with no more paint than is lacking.
"""

import numpy as np
from scipy import ndimage

from painter.planning.film.figures import COVERED
from painter.planning.film.film_cost import FilmCost
from painter.planning.film.film_model import FilmModel, Site
from painter.planning.spray_path import Stroke
from painter.planning.strokes.cut_in import find_cut_ins
from painter.planning.strokes.film_fit import FilmFit
from painter.planning.strokes.raster import fitted_strokes
from painter.planning.strokes.spray_settings import SpraySettings
from perception.ground import FloatArray

_NARROWEST = 0.03  # m; thinner strips are the soft edges that every job has.


def touch_up_strokes(
    film: FloatArray, site: Site, spray: SpraySettings, *, nominal: float
) -> tuple[Stroke, ...]:
    """Plans the strokes that touch up a film.

    Args:
        film: (ny, nx) of the site, m, what is there.
        site: The tile and its margin.
        spray: The tip and the settings of its strokes.
        nominal: Film aimed at, m.

    Returns:
        Strokes of kind "touch_up"; none where nothing is thin.

    Raises:
        ValueError: The film is not on the site's grid.
    """
    if film.shape != site.paintable.shape:
        raise ValueError(
            f"film must be {site.paintable.shape} cells as the site, got {film.shape}."
        )
    narrowest = max(1, round(_NARROWEST / site.cell))
    thin = ndimage.binary_opening(
        site.paintable & (film < COVERED * nominal), np.ones((narrowest, narrowest))
    )
    if not thin.any():
        return ()
    tip, raster = spray
    model = FilmModel(site, tip=tip, speed=raster.speed, nominal=nominal)
    fit = FilmFit(model, FilmCost.touch_up(site), raster=raster, film=film / nominal)
    find_cut_ins(fit, model, spray, where=thin)
    fit.fit()
    return tuple(
        stroke.replace(kind="touch_up") for stroke in fitted_strokes(fit.spans, spray)
    )
