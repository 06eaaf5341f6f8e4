"""Normal equations of least squares over poses and planes."""

from dataclasses import dataclass, field

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from perception.ground import BoolArray, FloatArray, IntArray

_WEAK = 1e-3
"""Prior that makes the matrix regular, in inverse squared metres or radians."""


@dataclass
class NormalEquations:
    """A sparse least-squares step, assembled block by block.

    Attributes:
        size: Number of unknowns.
        slope: (size,) gradient of half the sum of squares.
        rows: Rows of the matrix's entries, block by block.
        columns: Their columns.
        values: The entries; entries of one place are summed.
    """

    size: int
    slope: FloatArray = field(init=False)
    rows: list[IntArray] = field(default_factory=list)
    columns: list[IntArray] = field(default_factory=list)
    values: list[FloatArray] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.slope = np.zeros(self.size)

    def add(
        self, parts: list[tuple[IntArray, FloatArray]], e: FloatArray, W: FloatArray
    ) -> None:
        """Adds factors.

        Args:
            parts: First unknown (f,) and Jacobian (f, r, c) of each state involved.
            e: (f, r) residuals.
            W: (f, r, r) information of the residuals.
        """
        for start, J in parts:
            JW = np.swapaxes(J, 1, 2) @ W
            index = start[:, None] + np.arange(J.shape[2])
            np.add.at(self.slope, index, np.einsum("fcr,fr->fc", JW, e))
            for start2, J2 in parts:
                index2 = start2[:, None] + np.arange(J2.shape[2])
                block = JW @ J2
                self.values.append(block.ravel())
                self.rows.append(
                    np.broadcast_to(index[:, :, None], block.shape).ravel()
                )
                self.columns.append(
                    np.broadcast_to(index2[:, None, :], block.shape).ravel()
                )

    def solve(self, free: BoolArray, block: int) -> tuple[FloatArray, FloatArray]:
        """Solves for the Gauss-Newton step.

        Args:
            free: (size,) bool, unknowns to solve for; the steps of the others are zero.
            block: First of the six unknowns whose covariance is returned.

        Returns:
            (size,) step and (6, 6) covariance, zero for unknowns that are not free.
        """
        count = np.count_nonzero(free)
        place = np.cumsum(free) - 1
        everywhere = np.flatnonzero(free)
        rows = np.concatenate([*self.rows, everywhere])
        columns = np.concatenate([*self.columns, everywhere])
        values = np.concatenate([*self.values, np.full(count, _WEAK)])
        kept = free[rows] & free[columns]
        matrix = sparse.csc_matrix(
            (values[kept], (place[rows[kept]], place[columns[kept]])),
            shape=(count, count),
        )
        factors = splu(matrix, permc_spec="MMD_AT_PLUS_A")
        units = np.zeros((self.size, 6))
        units[block : block + 6] = np.eye(6)
        units[free] = factors.solve(units[free])
        units[~free] = 0.0
        step = np.zeros(self.size)
        step[free] = -factors.solve(self.slope[free])
        return step, units[block : block + 6]
