"""Frozen values of a run: what was executed, the paint film and the truth."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from pydrake.math import RigidTransform

from painter.planning.tile import cell_centres, grid_points
from perception.ground import BoolArray, FloatArray, FrozenValue


@dataclass(frozen=True, eq=False)
class Executed(FrozenValue):
    """Log of the arm and gun over the whole cycle.

    Attributes:
        time: (n,) s, strictly increasing, from the start of the cycle.
        q: (n, 5) rad, measured.
        v: (n, 5) rad/s, measured.
        trigger: (n,) 0 to 1, as the gun received it.
        X_WG: (n, 4, 4) pose of the gun's nozzle in W as it was.
        X_WG_desired: (n, 4, 4) pose commanded for the same instants.
    """

    time: FloatArray
    q: FloatArray
    v: FloatArray
    trigger: FloatArray
    X_WG: FloatArray
    X_WG_desired: FloatArray


@dataclass(frozen=True, eq=False)
class Film(FrozenValue):
    """Wet paint on the true surface as seen from the robot; simulation only.

    The grid lies in the scene's frame S (x right, y up, z out of the wall): the centre
    of cell (row, column) is at x0 + (column + 1/2) cell, y0 + (row + 1/2) cell.

    Attributes:
        thickness: (ny, nx) m, wet; row 0 at the bottom.
        kind: (ny, nx) uint8, kind of surface of the scene (`painter.scene`).
        truth_paintable: (ny, nx) bool, wall inside the robot's tile.
        truth_keepout: (ny, nx) bool, anything else inside the robot's tile.
        cell: Edge of a cell, m.
        x0: Left edge of the grid, m in S.
        y0: Lower edge of the grid, m in S.
        sprayed: Volume that left the gun, m³.
        landed: Volume that landed on the grid, m³.
        missed: Volume that was to land (transfer efficiency taken off) but went past
            the grid, m³.
        before: (ny, nx) m, what of `thickness` an earlier run left; None = nothing.
    """

    thickness: FloatArray
    kind: np.ndarray
    truth_paintable: BoolArray
    truth_keepout: BoolArray
    cell: float
    x0: float
    y0: float
    sprayed: float
    landed: float
    missed: float
    before: FloatArray | None = None

    def centres(self) -> tuple[FloatArray, FloatArray]:
        """Returns x (nx,) of the columns and y (ny,) of the rows, m in S."""
        x, y = cell_centres(self.thickness.shape, self.cell)
        return x + self.x0, y + self.y0

    @classmethod
    def on_tile(
        cls,
        *,
        thickness: FloatArray,
        kind: np.ndarray,
        paintable: BoolArray,
        cell: float,
        x0: float,
        y0: float,
        X_ST: RigidTransform,
        tile_size: tuple[float, float],
        sprayed: float,
        landed: float,
        missed: float,
        before: FloatArray | None = None,
    ) -> Self:
        """Makes a film and marks which cells the robot had to paint or keep clean.

        Args:
            thickness: (ny, nx) m, wet.
            kind: (ny, nx) kind of surface at each cell centre.
            paintable: (ny, nx) where that kind is to be painted.
            cell: Edge of a cell, m.
            x0: Left edge of the grid, m in S.
            y0: Lower edge of the grid, m in S.
            X_ST: The robot's tile frame in S.
            tile_size: Width and height of the tile, m.
            sprayed: See the class; m³.
            landed: See the class; m³.
            missed: See the class; m³.
            before: See the class; m.

        Returns:
            The film.
        """
        x, y = cell_centres(thickness.shape, cell)
        p_TQs = X_ST.inverse() @ grid_points(x + x0, y + y0)
        inside = (
            (p_TQs[0] >= 0)
            & (p_TQs[0] < tile_size[0])
            & (p_TQs[1] >= 0)
            & (p_TQs[1] < tile_size[1])
        ).reshape(thickness.shape)
        return cls(
            thickness=np.array(thickness, dtype=float),
            kind=np.array(kind, dtype=np.uint8),
            truth_paintable=inside & paintable,
            truth_keepout=inside & ~paintable,
            cell=cell,
            x0=x0,
            y0=y0,
            sprayed=sprayed,
            landed=landed,
            missed=missed,
            before=before,
        )


@dataclass(frozen=True, eq=False)
class Truth(FrozenValue):
    """What is true of the tile, from the scene's geometry; simulation only.

    Attributes:
        wall_mask: (ny, nx) bool on the grid of the segmentation: the cell centre lies
            on wall that is to be painted.
        X_WS: True pose of the scene in W; S is the tile frame as the job wants it.
        source: One sentence on how truth was made.
    """

    wall_mask: BoolArray
    X_WS: RigidTransform
    source: str
