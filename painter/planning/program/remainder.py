"""The strokes that remain on a tile that was segmented before."""

from dataclasses import dataclass

from painter.planning.spray_path import Stroke
from perception.ground import FrozenValue
from perception.values import WallSegmentation


@dataclass(frozen=True, eq=False)
class Remainder(FrozenValue):
    """Strokes that a wall still needs: the rest of a job, or its touch-up.

    It is valid while the base does not move: the wall is not scanned again.

    Attributes:
        segmentation: Of the tile, from the first scan.
        strokes: In T, in any order.
    """

    segmentation: WallSegmentation
    strokes: tuple[Stroke, ...]
