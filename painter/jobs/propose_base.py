"""Base positions from which a wall can be painted, from the arm's reach."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from painter.config import Scenario, load_scenario
from painter.errors import InputError
from painter.planning.arm.placement import Placement, propose_distance
from painter.planning.config import ZoneConfig
from painter.planning.strokes.facade import BasePosition, plan_base_positions
from painter.planning.strokes.spray_settings import SpraySettings
from painter.robot.reach_mapper import ReachMapper

_DISTANCES = np.round(np.arange(0.80, 1.46, 0.05), 3)  # m
_STEP = 0.1  # m, between the points of the tile whose reach is checked.


@dataclass(frozen=True)
class BaseProposal:
    """Where the base stands.

    Attributes:
        placement: Distance of the shoulder to the wall, and what is reached from there.
        positions: Base positions along the wall, with tile and strokes of each.
    """

    placement: Placement
    positions: Sequence[BasePosition]

    def document(self) -> dict[str, Any]:
        """Returns the content of stations.json."""
        return {
            "units": "m, on the wall from its lower left corner; strokes in T",
            "distance": self.placement.distance,
            "stations": [
                {
                    "base_x": base.base_x,
                    "lift": base.lift,
                    "tile": [base.left, base.bottom, base.width, base.height],
                    "strokes": [
                        [*stroke.start_T.tolist(), *stroke.end_T.tolist(), stroke.flow]
                        for stroke in base.strokes
                    ],
                }
                for base in self.positions
            ],
        }

    def figures(self) -> dict[str, Any]:
        """Returns distances, m, shares of the tile that are reached, and positions."""
        placement = self.placement
        return {
            "distance": placement.distance,
            "distance_range": [placement.nearest, placement.farthest],
            "spray_share": placement.spray_share,
            "scan_share": placement.scan_share,
            "stations": len(self.positions),
            "base_x": sorted({round(base.base_x, 3) for base in self.positions}),
            "lift": sorted({round(base.lift, 3) for base in self.positions}),
        }


def propose_base(
    scenario: Scenario | str,
    width: float,
    height: float,
    zones: Sequence[ZoneConfig] = (),
) -> BaseProposal:
    """Proposes the distance of the base, and its positions along a wall.

    Example: `propose_base("cubes", 10.0, 6.0).figures()["base_x"]`.

    Args:
        scenario: Robot, tile, tip and raster; a `Scenario`, a name or a path.
        width: Of the wall, m.
        height: Of the wall, m.
        zones: What of the wall is painted and what is not.

    Raises:
        InputError: The wall is too small to be divided into tiles.
        ReachError: The tile cannot be reached from any distance.
    """
    job = load_scenario(scenario) if isinstance(scenario, str) else scenario
    mapper = ReachMapper(job)
    shoulder_height = mapper.arm.shoulder_height
    placement = propose_distance(
        lambda distance: mapper.reach(
            distance=distance, shoulder_height=shoulder_height, step=_STEP
        ),
        _DISTANCES.tolist(),
    )
    try:
        positions = plan_base_positions(
            width,
            height,
            SpraySettings(job.gun.tip, job.raster),
            tile=job.tile,
            zones=list(zones),
        )
    except ValueError as error:
        raise InputError(
            f"wall of {width:g} x {height:g} m: {error}", code="PNT-USE-034"
        ) from error
    return BaseProposal(placement, positions)
