"""Strokes that mend what is thin, and no others.

They are found and fitted as cut-ins are, on the film that is there already: from as
near or far as what stands out allows, with no more paint than is lacking.
"""

import numpy as np
from scipy import ndimage

from painter.planning.config import RasterConfig, TipConfig
from painter.planning.film.figures import COVERED
from painter.planning.film.film_cost import FilmCost
from painter.planning.film.film_model import FilmModel, Site
from painter.planning.spray_path import Stroke
from painter.planning.strokes.cut_in import find_cut_ins
from painter.planning.strokes.film_fit import FilmFit
from painter.planning.strokes.raster import fitted_strokes
from perception.ground import FloatArray

_NARROWEST = 0.03  # m; thinner strips are the soft edges that every job has.


def touch_up_strokes(
    film: FloatArray,
    site: Site,
    *,
    nominal: float,
    tip: TipConfig,
    raster: RasterConfig,
) -> tuple[Stroke, ...]:
    """Plans the strokes that mend a film.

    Args:
        film: (ny, nx) of the site, m, what is there.
        site: The tile and its margin.
        nominal: Film that is wanted, m.
        tip: The spray tip, its fan's long axis along T x.
        raster: Speed, stand-offs and shortest stroke.

    Returns:
        Strokes of kind "touch_up"; none where nothing is thin.

    Raises:
        ValueError: The film is not on the site's grid.
    """
    if film.shape != site.wanted.shape:
        raise ValueError(f"film is {film.shape} cells, the site {site.wanted.shape}.")
    narrowest = max(1, round(_NARROWEST / site.cell))
    thin = ndimage.binary_opening(
        site.wanted & (film < COVERED * nominal), np.ones((narrowest, narrowest))
    )
    if not thin.any():
        return ()
    model = FilmModel(site, tip=tip, speed=raster.speed, nominal=nominal)
    fit = FilmFit(model, FilmCost.mending(site), raster=raster, film=film / nominal)
    find_cut_ins(fit, model, tip=tip, raster=raster, where=thin)
    fit.fit()
    strokes = fitted_strokes(fit.spans, tip=tip, raster=raster)
    return tuple(stroke.replace(kind="touch_up") for stroke in strokes)
