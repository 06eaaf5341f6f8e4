"""Configurations of which it is plain that the arm keeps clear, many at once.

Convex bodies whose shadows on a line are some distance apart are at least as far apart
themselves. Shadows of boxes and cylinders are quick to find for many configurations
together, and those on the axes of one of the two links mostly show enough; only what
they leave open has to be asked of a collision checker.
"""

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from pydrake.geometry import Box, Cylinder, Role, Shape
from pydrake.math import RigidTransform
from pydrake.planning import CollisionChecker

from perception.values import BoolArray, FloatArray, FrozenValue, IntArray

_MARGIN = 1e-4  # m, on every distance: far above the rounding of the checker's own.
_NEAR = 2  # Joints between bodies of which each shape is looked at by itself.
_AT_A_TIME = 64  # Configurations; the arrays of more do not stay in the cache.
# Shadows are of single precision: at 10 m that is 1 um, nothing beside the margin.
_Singles = npt.NDArray[np.floating[Any]]

# How many joints move a body, the body (Drake's), and its shapes.
_Part = tuple[int, Any, list["_Shape"]]


@dataclass(frozen=True, eq=False)
class _Shape(FrozenValue):
    """A box or a cylinder, as it is in W while all joints are at 0.

    Attributes:
        vectors: (3, 5), m: its centre, three half edges, and 1 along a cylinder's axis.
            A cylinder has but one edge, a box no axis.
        radius: m, of a cylinder; 0 of a box.
    """

    vectors: FloatArray
    radius: float

    @classmethod
    def of(cls, shape: Shape, X_WS: RigidTransform) -> "_Shape":
        """Makes it of Drake's, at its pose.

        Raises:
            TypeError: It is neither box nor cylinder.
        """
        R = X_WS.rotation().matrix()
        vectors = np.zeros((3, 5))
        vectors[:, 0] = X_WS.translation()
        if isinstance(shape, Box):
            vectors[:, 1:4] = R * (shape.size() / 2.0)
            return cls(vectors, 0.0)
        if not isinstance(shape, Cylinder):
            raise TypeError(f"must be a box or a cylinder, got {type(shape).__name__}.")
        vectors[:, 3] = R[:, 2] * (shape.length() / 2.0)
        vectors[:, 4] = R[:, 2]
        return cls(vectors, shape.radius())


class Separation:
    """Proves that configurations keep clear; what it does not prove stays open."""

    def __init__(self, checker: CollisionChecker, X_WT: RigidTransform) -> None:
        """Reads the robot of a checker, and the shapes that were added around it.

        Args:
            checker: Its positions are those of revolute joints, each of which moves
                all that the next one moves.
            X_WT: Along whose axes added shapes stand that do not stand along W's.
        """
        plant = checker.plant()
        context = plant.CreateDefaultContext()
        plant.SetPositions(context, np.zeros(plant.num_positions()))
        joints = sorted(
            (
                joint
                for joint in map(plant.get_joint, plant.GetJointIndices())
                if joint.num_positions()
            ),
            key=lambda joint: int(joint.position_start()),
        )
        places = [joint.frame_on_parent().CalcPoseInWorld(context) for joint in joints]
        # By Rodrigues a joint moves points by 1 + sin(q) A + (1 - cos(q)) A².
        self._turns = np.zeros((len(joints), 4, 4))
        for turn, joint, X_WJ in zip(self._turns, joints, places, strict=True):
            turn[:3, :3] = np.cross(np.eye(3), X_WJ.rotation() @ joint.revolute_axis())
            turn[:3, 3] = -turn[:3, :3] @ X_WJ.translation()
        moved = [
            set(plant.GetBodiesKinematicallyAffectedBy([joint.index()]))
            for joint in joints
        ]
        inspector = checker.model().scene_graph().model_inspector()
        bodies: dict[int, _Part] = {}
        for geometry in inspector.GetAllGeometryIds(Role.kProximity):
            body = plant.GetBodyFromFrameId(inspector.GetFrameId(geometry))
            link = sum(body.index() in those for those in moved)
            X_WS = body.EvalPoseInWorld(context) @ inspector.GetPoseInFrame(geometry)
            _, _, shapes = bodies.setdefault(int(body.index()), (link, body, []))
            shapes.append(_Shape.of(inspector.GetShape(geometry), X_WS))
        parts = sorted(bodies.values(), key=lambda part: part[0])
        shapes = [shape for _, _, some in parts for shape in some]
        counts = [len(some) for _, _, some in parts]
        self._firsts = np.cumsum([0, *counts])
        vectors = np.stack([shape.vectors for shape in shapes], axis=2)
        self._vectors = np.concatenate([vectors, np.zeros_like(vectors[:1])])
        self._vectors[3, 0] = 1.0  # Centres move as well, edges and axes but turn.
        self._radii = np.array([shape.radius for shape in shapes], np.float32)
        links = np.array([link for link, _, _ in parts])
        # The shapes of each link are a row; those of the robot's foot come first.
        self._rows = np.searchsorted(np.repeat(links, counts), range(len(joints) + 2))
        self._moving = len(shapes) + np.flatnonzero(links > 0)
        self._R_WT = X_WT.rotation().matrix()
        self._pairs(checker, parts)
        self._around = self._shadows_around(checker)

    def proven(self, q: FloatArray, clearance: float) -> BoolArray:
        """Tells of which configurations it is plain that they keep clear.

        Args:
            q: (n, joints) rad.
            clearance: From what was added around the robot, m; of each other the
                robot's parts keep what the checker asked for as this was made.

        Returns:
            (n,) bool; where it is False they may or may not.
        """
        some = [
            self._proven(q[first : first + _AT_A_TIME], clearance + _MARGIN)
            for first in range(0, len(q), _AT_A_TIME)
        ]
        return np.concatenate(some) if some else np.zeros(0, dtype=bool)

    def _proven(self, q: FloatArray, clearance: float) -> BoolArray:
        lows, highs = self._shadows(q)
        apart = np.zeros((len(self._required), len(q)), dtype=bool)
        for one, other in zip(self._one, self._other, strict=True):
            apart |= lows[one] - highs[other] >= self._required
            apart |= lows[other] - highs[one] >= self._required
        near, far = np.split(apart, [self._near])
        clear = near.reshape(-1, 3, len(q)).any(axis=1).all(axis=0) & far.all(axis=0)
        for first, around_low, around_high in self._around:
            beside = np.zeros((self._moving.size, around_low.shape[1], len(q)), bool)
            for axis in range(3):
                rows = self._columns * (first + axis) + self._moving
                beside |= lows[rows, None] >= around_high[axis, :, None] + clearance
                beside |= highs[rows, None] <= around_low[axis, :, None] - clearance
            clear &= beside.all(axis=(0, 1))
        return np.asarray(clear)

    def _shadows(self, q: FloatArray) -> tuple[_Singles, _Singles]:
        """Returns where shadows begin and end on axes, each (axes * parts, n), m.

        Axes are those of the links from the foot on, three each, and those of T; parts
        are shapes, and after them whole bodies.
        """
        count, size = len(q), self._radii.size
        angle = q[:, :, None, None]
        turns = np.eye(4) + np.sin(angle) * self._turns
        turns += (1.0 - np.cos(angle)) * (self._turns @ self._turns)
        placed = np.empty((count, 3, 5, size), np.float32)
        axes = np.empty((count, len(self._rows), 3, 3), np.float32)
        axes[:, -1] = self._R_WT.T
        X = np.tile(np.eye(4), (count, 1, 1))
        for link, (first, last) in enumerate(itertools.pairwise(self._rows)):
            if link:
                X = X @ turns[:, link - 1]
            axes[:, link] = X[:, :3, :3].transpose(0, 2, 1)
            placed[..., first:last] = (
                X[:, :3].reshape(-1, 4) @ self._vectors[..., first:last].reshape(4, -1)
            ).reshape(count, 3, 5, -1)
        along = axes.reshape(count, -1, 3)
        shadows = (along @ placed.reshape(count, 3, -1)).reshape(count, -1, 5, size)
        middle, half = _spans(shadows, self._radii)
        # Rows of many configurations are quicker to pick than columns.
        low, high = np.empty((2, 3 * len(self._rows), self._columns, count), np.float32)
        low[:, :size] = (middle - half).transpose(1, 2, 0)
        high[:, :size] = (middle + half).transpose(1, 2, 0)
        for body, (first, last) in enumerate(itertools.pairwise(self._firsts)):
            low[:, first:last].min(axis=1, out=low[:, size + body])
            high[:, first:last].max(axis=1, out=high[:, size + body])
        return low.reshape(-1, count), high.reshape(-1, count)

    def _pairs(
        self,
        checker: CollisionChecker,
        parts: list[_Part],
    ) -> None:
        """Lists the pairs of parts that may not meet, and on which axes to look."""
        count = self._radii.size
        self._columns = count + len(parts)
        near: list[tuple[int, int, int, float]] = []
        far: list[tuple[int, int, int, float]] = []
        numbered = list(enumerate(parts))
        for (i, (a, first, _)), (j, (b, second, _)) in itertools.combinations(
            numbered, 2
        ):
            if checker.IsCollisionFilteredBetween(first, second):
                continue
            required = float(checker.GetPaddingBetween(first, second)) + _MARGIN
            if b - a > _NEAR:
                far.append((count + i, count + j, b, required))
                continue
            near += [
                (k, m, link, required)
                for k in range(self._firsts[i], self._firsts[i + 1])
                for m in range(self._firsts[j], self._firsts[j + 1])
                # Both links and the one between, if there is one.
                for link in (a, (a + b + 1) // 2, b)
            ]
        one, other, links, needed = (
            np.array(column) for column in zip(*near, *far, strict=True)
        )
        rows = self._columns * (3 * links + np.arange(3)[:, None])
        self._one: IntArray = rows + one
        self._other: IntArray = rows + other
        self._required = needed.astype(np.float32)[:, None]
        self._near = len(near)

    def _shadows_around(
        self, checker: CollisionChecker
    ) -> list[tuple[int, _Singles, _Singles]]:
        """Returns where shadows of what was added begin and end, each (3, shapes), m.

        On T's axes, then on W's, those shapes that are shorter there; before them the
        number of the first of these axes.
        """
        shapes = [
            _Shape.of(added.shape(), added.pose_in_body())
            for group in checker.GetAllAddedCollisionShapes().values()
            for added in group
        ]
        vectors = np.stack([shape.vectors for shape in shapes], axis=2)
        radii = np.array([shape.radius for shape in shapes])
        middles, halves = _spans(
            np.tensordot(np.stack([self._R_WT.T, np.eye(3)]), vectors, axes=1), radii
        )
        in_T = np.less_equal(*halves.prod(axis=1))
        of_T = 3 * len(self._turns) + 3
        return [
            (
                first,
                middle[:, which] - half[:, which],
                middle[:, which] + half[:, which],
            )
            for first, which, middle, half in zip(
                (of_T, 0), (in_T, ~in_T), middles, halves, strict=True
            )
        ]


def _spans(vectors: _Singles, radii: _Singles) -> tuple[_Singles, _Singles]:
    """Returns middles and half lengths of shadows, each (n, axes, shapes), m.

    Args:
        vectors: (n, axes, 5, shapes) components of the shapes' vectors on the axes.
        radii: (shapes,) m.
    """
    half = np.abs(vectors[:, :, 1:4]).sum(axis=2)
    half += radii * np.sqrt(np.maximum(1.0 - vectors[:, :, 4] ** 2, 0.0))
    return vectors[:, :, 0], half
