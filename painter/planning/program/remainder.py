"""What is left to do on a tile that was seen before."""

from dataclasses import dataclass

from painter.planning.spray_path import Stroke
from perception.ground import FrozenValue
from perception.values import WallSegmentation


@dataclass(frozen=True, eq=False)
class Remainder(FrozenValue):
    """Strokes that a wall still needs: the rest of a job, or its touch-up.

    It holds while the base stands where it stood: the wall is not looked at again.

    Attributes:
        segmentation: Of the tile, as it was seen.
        strokes: In T, in any order.
    """

    segmentation: WallSegmentation
    strokes: tuple[Stroke, ...]
