"""Walls and strokes for tests of their film."""

import numpy as np

from painter.planning.config import RasterConfig, TipConfig
from painter.planning.film.film_model import FilmModel, Site
from painter.planning.spray_path import Stroke
from painter.planning.strokes.spray_settings import SpraySettings

CELL = 0.01
TIP = TipConfig()
RASTER = RasterConfig()
SPRAY = SpraySettings(TIP, RASTER)
NOMINAL = SPRAY.nominal_film(2.0)


def model(mask, height=None):
    site = Site.of_tile(mask, CELL, height)
    return FilmModel(site, tip=TIP, speed=RASTER.speed, nominal=NOMINAL)


def wall(*keepouts):
    """A 2 x 2 m wall with rectangles (x, y, width, height), m, of keep-out."""
    mask = np.ones((200, 200), dtype=bool)
    for x, y, w, h in keepouts:
        rows = slice(round(y / CELL), round((y + h) / CELL))
        mask[rows, round(x / CELL) : round((x + w) / CELL)] = False
    return mask


def stroke(x, low, high, **changes):
    return Stroke(
        np.array([x, low]), np.array([x, high]), RASTER.speed, "body", 0, **changes
    )
