"""Batches of poses: products, errors and small steps, for the pose graph.

A step is (6,): rotation vector, rad, and displacement, m, both in the pose's own axes:
R <- R Exp(a), p <- p + R v.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
import numpy.typing as npt
from pydrake.math import RigidTransform, RotationMatrix
from scipy.spatial.transform import Rotation

from perception.ground import FloatArray, IntArray


def skew(v: FloatArray) -> FloatArray:
    """Returns (..., 3, 3) matrices of the cross products with (..., 3) vectors."""
    result = np.zeros((*v.shape, 3))
    result[..., 0, 1], result[..., 0, 2] = -v[..., 2], v[..., 1]
    result[..., 1, 0], result[..., 1, 2] = v[..., 2], -v[..., 0]
    result[..., 2, 0], result[..., 2, 1] = -v[..., 1], v[..., 0]
    return result


@dataclass(frozen=True, eq=False)
class Poses:
    """Many poses X_AB.

    Attributes:
        R: (n, 3, 3).
        p: (n, 3) m.
    """

    R: FloatArray
    p: FloatArray

    @classmethod
    def of(cls, poses: list[RigidTransform]) -> Self:
        """Stacks poses."""
        if not poses:
            return cls(np.zeros((0, 3, 3)), np.zeros((0, 3)))
        return cls(
            np.stack([X.rotation().matrix() for X in poses]),
            np.stack([X.translation() for X in poses]),
        )

    @classmethod
    def identity(cls, count: int) -> Self:
        """Makes identity poses."""
        return cls(np.tile(np.eye(3), (count, 1, 1)), np.zeros((count, 3)))

    def __len__(self) -> int:
        return len(self.p)

    def __getitem__(self, index: IntArray | slice) -> "Poses":
        return Poses(self.R[index], self.p[index])

    def __matmul__(self, other: "Poses") -> "Poses":
        p = self.p + np.einsum("nij,nj->ni", self.R, other.p)
        return Poses(self.R @ other.R, p)

    def inverse(self) -> "Poses":
        """Returns X_BA."""
        R = np.swapaxes(self.R, 1, 2)
        return Poses(R, -np.einsum("nij,nj->ni", R, self.p))

    def moved(self, steps: FloatArray) -> "Poses":
        """Returns the poses after (n, 6) steps."""
        R = self.R @ Rotation.from_rotvec(steps[:, :3].copy()).as_matrix()
        return Poses(R, self.p + np.einsum("nij,nj->ni", self.R, steps[:, 3:]))

    def followed_by(self, other: "Poses") -> "Poses":
        """Returns these poses followed by others."""
        return Poses(
            np.concatenate([self.R, other.R]), np.concatenate([self.p, other.p])
        )

    def with_rows(self, index: IntArray, other: "Poses") -> "Poses":
        """Returns the poses with those at `index` replaced."""
        R, p = self.R.copy(), self.p.copy()
        R[index], p[index] = other.R, other.p
        return Poses(R, p)

    def about(self, p_AM: FloatArray) -> "Poses":
        """Returns the same motions of A, about a point M instead of A's origin.

        Args:
            p_AM: (3,) m.
        """
        return Poses(self.R, self.p + self.R @ p_AM - p_AM)

    def steps_to(self, other: "Poses") -> FloatArray:
        """Returns the (n, 6) steps from these poses to others."""
        difference = self.inverse() @ other
        turn = Rotation.from_matrix(difference.R).as_rotvec()
        return np.hstack([turn, difference.p])

    def list(self) -> list[RigidTransform]:
        """Returns them as rigid transforms."""
        return [
            RigidTransform(RotationMatrix.ProjectToRotationMatrix(R), p)
            for R, p in zip(self.R, self.p, strict=True)
        ]


def pose_of(step: npt.ArrayLike) -> RigidTransform:
    """Returns the pose after a (6,) step from the identity."""
    return Poses.identity(1).moved(np.asarray(step, dtype=float)[None]).list()[0]


def step_to(X: RigidTransform) -> FloatArray:
    """Returns the (6,) step from the identity to a pose."""
    return np.asarray(Poses.identity(1).steps_to(Poses.of([X]))[0])


def angle_deg(R: RotationMatrix) -> float:
    """Returns the angle of a rotation, deg."""
    cos = (np.trace(R.matrix()) - 1.0) / 2.0
    return float(np.degrees(np.arccos(np.clip(cos, -1.0, 1.0))))
