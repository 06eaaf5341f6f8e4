"""Proposes where the base stands in front of a tile, from what the arm reaches."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from painter.errors import ReachError
from painter.planning.arm.reach_map import TileReach
from perception.ground import FrozenValue


@dataclass(frozen=True, eq=False)
class Placement(FrozenValue):
    """A proposed distance of the wall from the base axis.

    Attributes:
        distance: Wall to base axis, m.
        nearest: Least distance with the same reach, m.
        farthest: Greatest distance with the same reach, m.
        spray_share: Share of the tile that can be sprayed.
        scan_share: Share of the tile and its margin that can be seen.
    """

    distance: float
    nearest: float
    farthest: float
    spray_share: float
    scan_share: float


def propose_distance(
    reach_at: Callable[[float], TileReach], distances: Sequence[float]
) -> Placement:
    """Proposes the distance with most reach, in the middle of the range that has it.

    Spraying counts before seeing: what is not seen counts as wall, but what cannot be
    sprayed stays bare.

    Args:
        reach_at: Returns the reach with the wall at a distance, m.
        distances: Distances to try, ascending, m.

    Raises:
        ReachError: Nothing of the tile is reached from any of them.
    """
    shares = []
    for distance in distances:
        reach = reach_at(distance)
        shares.append((round(reach.spray_share, 6), round(reach.scan_share, 6)))
    best = max(shares)
    if best[0] <= 0.0:
        raise ReachError(
            f"placement: the arm reaches no point of the tile with the wall "
            f"{distances[0]:.2f} to {distances[-1]:.2f} m from the base axis.",
            code="PNT-REACH-001",
        )
    # The middle of the longest run of equals tolerates the largest error of the base.
    good = np.array([share == best for share in shares])
    bounds = np.flatnonzero(np.diff(good, prepend=False, append=False)).reshape(-1, 2)
    first, end = max(bounds.tolist(), key=lambda run: run[1] - run[0])
    return Placement(
        distance=float(distances[(first + end - 1) // 2]),
        nearest=float(distances[first]),
        farthest=float(distances[end - 1]),
        spray_share=best[0],
        scan_share=best[1],
    )
