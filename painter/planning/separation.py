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
from pydrake.geometry import Box, Cylinder, Role, Shape
from pydrake.math import RigidTransform
from pydrake.planning import CollisionChecker

from perception.values import BoolArray, FloatArray, FrozenValue, IntArray

_MARGIN = 1e-4  # m, on every distance: far above the rounding of the checker's own.
_NEAR = 2  # Joints between bodies of which each shape is looked at by itself.
_AT_A_TIME = 64  # Configurations; the arrays of more do not stay in the cache.

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
        self._points = [X_WJ.translation() for X_WJ in places]
        self._crosses = [
            np.cross(np.eye(3), X_WJ.rotation() @ joint.revolute_axis())
            for joint, X_WJ in zip(joints, places, strict=True)
        ]
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
        self._vectors = np.stack([shape.vectors for shape in shapes], axis=2)
        self._radii = np.array([shape.radius for shape in shapes])
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
        clear = np.logical_or.reduceat(apart, self._tries, axis=0).all(axis=0)
        for first, around_low, around_high in self._around:
            beside = np.zeros((self._moving.size, around_low.shape[1], len(q)), bool)
            for axis in range(3):
                rows = self._columns * (first + axis) + self._moving
                beside |= lows[rows, None] >= around_high[axis, :, None] + clearance
                beside |= highs[rows, None] <= around_low[axis, :, None] - clearance
            clear &= beside.all(axis=(0, 1))
        return np.asarray(clear)

    def _shadows(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Returns where shadows begin and end on axes, each (axes * parts, n), m.

        Axes are those of the links from the foot on, three each, and those of T; parts
        are shapes, and after them whole bodies.
        """
        count, size = len(q), self._radii.size
        R, t = np.tile(np.eye(3), (count, 1, 1)), np.zeros((count, 3))
        placed = np.empty((count, 3, 5, size))
        axes = [R]
        for link, row in enumerate(itertools.pairwise(self._rows)):
            if link:
                angle = q[:, link - 1, None, None]
                cross, point = self._crosses[link - 1], self._points[link - 1]
                about = np.eye(3) + np.sin(angle) * cross
                about += (1.0 - np.cos(angle)) * (cross @ cross)
                t = t + (R @ (point - about @ point)[:, :, None])[:, :, 0]
                R = R @ about
                axes.append(R)
            shapes = slice(*row)
            vectors = self._vectors[:, :, shapes]
            placed[..., shapes] = (R.reshape(-1, 3) @ vectors.reshape(3, -1)).reshape(
                count, *vectors.shape
            )
            placed[:, :, 0, shapes] += t[:, :, None]
        axes.append(np.broadcast_to(self._R_WT, R.shape))
        along = np.concatenate(axes, axis=2).transpose(0, 2, 1)
        shadows = (along @ placed.reshape(count, 3, -1)).reshape(count, -1, 5, size)
        middle, half = _spans(shadows, self._radii)
        # Rows of many configurations are quicker to pick than columns.
        low, high = (
            np.ascontiguousarray(ends.transpose(1, 2, 0))
            for ends in (middle - half, middle + half)
        )
        firsts = self._firsts[:-1]
        low = np.concatenate([low, np.minimum.reduceat(low, firsts, axis=1)], axis=1)
        high = np.concatenate([high, np.maximum.reduceat(high, firsts, axis=1)], axis=1)
        return low.reshape(-1, count), high.reshape(-1, count)

    def _pairs(
        self,
        checker: CollisionChecker,
        parts: list[_Part],
    ) -> None:
        """Lists the pairs of parts that may not meet, and on which axes to look."""
        count = self._radii.size
        self._columns = count + len(parts)
        one: list[IntArray] = []
        other: list[IntArray] = []
        required: list[float] = []
        tries: list[int] = []
        numbered = list(enumerate(parts))
        for (i, (a, first, _)), (j, (b, second, _)) in itertools.combinations(
            numbered, 2
        ):
            if checker.IsCollisionFilteredBetween(first, second):
                continue
            padding = float(checker.GetPaddingBetween(first, second)) + _MARGIN
            near = b - a <= _NEAR
            pairs = [(count + i, count + j)]
            if near:
                pairs = list(
                    itertools.product(
                        range(self._firsts[i], self._firsts[i + 1]),
                        range(self._firsts[j], self._firsts[j + 1]),
                    )
                )
            for k, m in pairs:
                tries.append(len(one))
                for link in range(a, b + 1) if near else (b,):
                    rows = self._columns * (3 * link + np.arange(3))
                    one.append(rows + k)
                    other.append(rows + m)
                    required.append(padding)
        self._one: IntArray = np.stack(one, axis=1)
        self._other: IntArray = np.stack(other, axis=1)
        self._required, self._tries = np.array(required)[:, None], np.array(tries)

    def _shadows_around(
        self, checker: CollisionChecker
    ) -> list[tuple[int, FloatArray, FloatArray]]:
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
        of_T = 3 * len(self._crosses) + 3
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


def _spans(vectors: FloatArray, radii: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Returns middles and half lengths of shadows, each (n, axes, shapes), m.

    Args:
        vectors: (n, axes, 5, shapes) components of the shapes' vectors on the axes.
        radii: (shapes,) m.
    """
    half = np.abs(vectors[:, :, 1:4]).sum(axis=2)
    half += radii * np.sqrt(np.maximum(1.0 - vectors[:, :, 4] ** 2, 0.0))
    return vectors[:, :, 0], half
