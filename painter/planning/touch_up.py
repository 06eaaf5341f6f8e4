"""Strokes that mend what is thin, and no others.

Thin wall is sprayed from near by, where the fan is narrow, with no more paint than is
lacking: the flow of each stroke is fitted to the film that is there already.
"""

import numpy as np
from scipy import ndimage
from scipy.optimize import lsq_linear

from painter.planning.config import RasterConfig, TipConfig
from painter.planning.deposition import best_pitch, half_axes, predicted_film
from painter.planning.spray_path import Stroke
from painter.planning.tile import cell_centres
from perception.values import BoolArray, FloatArray

_STANDOFF = 0.12  # m; the fan of the default tip is 10 cm wide there.
_WIDE = 3.0  # Fans; thin wall that wide is sprayed from the raster's stand-off.
_NARROWEST = 0.03  # m; thinner strips are the soft edges that every job has.
_LEAST_THIN = 0.3  # Share of the fan's flow over thin wall, for the gun to be on.
_OVERLAP = 0.3  # Half fans by which the outer lines lap over the rim of a spot.
_LACKING = 0.1  # Share of the nominal film; less is the unevenness of any film.
_LEAST_FLOW = 0.05
_SPILL_WEIGHT = 0.25  # Of film where none is lacking, against film that lacks.


def touch_up_strokes(
    film: FloatArray,
    wanted: BoolArray,
    cell: float,
    *,
    nominal: float,
    tip: TipConfig,
    raster: RasterConfig,
    thin_share: float = 0.8,
) -> tuple[Stroke, ...]:
    """Plans the strokes that mend a film.

    Args:
        film: (ny, nx) m, what is on the tile, row 0 at the bottom.
        wanted: (ny, nx) where film is wanted.
        cell: Edge of a cell, m.
        nominal: Film that is wanted, m.
        tip: The spray tip, its fan's long axis along T x.
        raster: Speed, stand-off and shortest stroke.
        thin_share: Film below this share of the nominal one is thin.

    Returns:
        Strokes of kind "touch_up"; none where nothing is thin.

    Raises:
        ValueError: The two grids differ.
    """
    if film.shape != wanted.shape:
        raise ValueError(f"film is {film.shape} cells, wanted is {wanted.shape}.")
    lack = np.where(wanted, np.clip(1.0 - film / nominal, 0.0, None), 0.0)
    narrowest = max(1, round(_NARROWEST / cell))
    thin = ndimage.binary_opening(
        wanted & (film < thin_share * nominal), np.ones((narrowest, narrowest))
    )
    # Spots under one fan are mended together.
    near = max(1, round(half_axes(tip, _STANDOFF)[0] / cell))
    groups, count = ndimage.label(ndimage.binary_dilation(thin, iterations=near))
    strokes: list[Stroke] = []
    for number in range(1, count + 1):
        spot = thin & (groups == number)
        strokes += _mend(spot, lack, cell, nominal, tip=tip, raster=raster)
    return tuple(strokes)


def _mend(
    spot: BoolArray,
    lack: FloatArray,
    cell: float,
    nominal: float,
    *,
    tip: TipConfig,
    raster: RasterConfig,
) -> list[Stroke]:
    """Returns the strokes over one thin spot, with fitted flows."""
    columns = np.flatnonzero(spot.any(axis=0))
    left, right = columns[0] * cell, (columns[-1] + 1) * cell
    wide = right - left > _WIDE * 2.0 * half_axes(tip, raster.standoff)[0]
    standoff = raster.standoff if wide else min(_STANDOFF, raster.standoff)
    a, b = half_axes(tip, standoff)
    left, right = left - _OVERLAP * a, right + _OVERLAP * a
    lines = max(1, int(np.ceil((right - left) / best_pitch(tip, standoff) - 1e-9)))
    places = left + (np.arange(lines) + 0.5) * (right - left) / lines
    x, _ = cell_centres(spot.shape, cell)
    lap = 0.5 * b  # Half the film is there where a stroke ends.
    strokes: list[Stroke] = []
    for column, x_line in enumerate(places):
        under = np.abs(x - x_line) <= a
        share = (1.0 - ((x[under] - x_line) / a) ** 2) ** tip.gamma
        on = spot[:, under] @ share >= _LEAST_THIN * share.sum()
        for first, end in np.flatnonzero(
            np.diff(on, prepend=False, append=False)
        ).reshape(-1, 2):
            if (end - first) * cell >= raster.min_stroke:
                strokes.append(
                    Stroke(
                        start_T=np.array([x_line, first * cell - lap]),
                        end_T=np.array([x_line, end * cell + lap]),
                        speed=raster.speed,
                        kind="touch_up",
                        column=column,
                        standoff=standoff,
                    )
                )
    return _fitted(strokes, lack, cell, nominal, tip=tip)


def _fitted(
    strokes: list[Stroke],
    lack: FloatArray,
    cell: float,
    nominal: float,
    *,
    tip: TipConfig,
) -> list[Stroke]:
    """Returns the strokes with the flows that fill best what lacks."""
    if not strokes:
        return []
    x, y = cell_centres(lack.shape, cell)
    films = [predicted_film([stroke], x, y, tip=tip) / nominal for stroke in strokes]
    reached = np.any([film > 0.0 for film in films], axis=0)
    weight = np.where(lack[reached] > _LACKING, 1.0, _SPILL_WEIGHT)
    matrix = np.stack([film[reached] * weight for film in films], axis=1)
    flows = lsq_linear(matrix, lack[reached] * weight, bounds=(0.0, 1.0)).x
    return [
        stroke.replace(flow=float(flow))
        for stroke, flow in zip(strokes, flows, strict=True)
        if flow >= _LEAST_FLOW
    ]
