"""The spray tip and the raster's settings, which together decide on strokes."""

import math
from typing import NamedTuple

from painter.planning.config import RasterConfig, TipConfig
from painter.planning.film.deposition import best_pitch, mean_film


class SpraySettings(NamedTuple):
    """A spray tip and the settings of its strokes.

    Attributes:
        tip: The spray tip, its fan's long axis along T x.
        raster: Speed, stand-offs, pitch and shortest stroke.
    """

    tip: TipConfig
    raster: RasterConfig

    @property
    def widest_pitch(self) -> float:
        """The pitch that strokes must not exceed, m.

        It is `raster.overlap_pitch`, or where that is 0 the pitch of least variance.
        """
        return self.raster.overlap_pitch or best_pitch(self.tip, self.raster.standoff)

    @property
    def shortest_gap(self) -> float:
        """The shortest gap between two strokes on a line, m.

        The valve cannot close and open again in less than two delays.
        """
        return max(
            self.raster.min_stroke, 2.0 * self.tip.valve_delay * self.raster.speed
        )

    def nominal_pitch(self, width: float) -> float:
        """Returns the pitch that fills a tile exactly, at most the widest, m.

        Args:
            width: Of the tile, m.
        """
        return width / math.ceil(width / self.widest_pitch - 1e-9)

    def nominal_film(self, width: float) -> float:
        """Returns the wet film that the raster of a tile aims at, m.

        Args:
            width: Of the tile, m.
        """
        pitch = self.nominal_pitch(width)
        return mean_film(self.tip, speed=self.raster.speed, pitch=pitch)
