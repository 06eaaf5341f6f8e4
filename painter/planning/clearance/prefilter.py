"""A separating-axis prefilter: proves clearance of many configurations at once.

Convex bodies whose projections on an axis are some distance apart are at least as far
apart themselves. Projections of boxes and cylinders are quick to compute for many
configurations together, and those on the axes of one of the two links are mostly
enough; a collision checker has to answer only for the rest.
"""

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from pydrake.geometry import Box, Cylinder, Role, Shape
from pydrake.math import RigidTransform
from pydrake.planning import CollisionChecker

from perception.ground import BoolArray, FloatArray, FrozenValue, IntArray

_MARGIN = 1e-4  # m, on every distance: far above the rounding of the checker's own.
_NEAR = 2  # Joints between bodies whose shapes are checked one by one.
_AT_A_TIME = 64  # Configurations; the arrays of more do not fit into the cache.
# Projections are of single precision: at 10 m that is 1 um, far below the margin.
_Singles = npt.NDArray[np.floating[Any]]

# How many joints move a body, the body (Drake's), and its shapes.
_Part = tuple[int, Any, list["_Shape"]]


@dataclass(frozen=True, eq=False)
class _Shape(FrozenValue):
    """A box or a cylinder, in W with all joints at 0.

    Attributes:
        vectors: (3, 5), m: its centre, three half edges, and 1 along a cylinder's axis.
            A cylinder has only the third edge, a box no axis.
        radius: m, of a cylinder; 0 of a box.
    """

    vectors: FloatArray
    radius: float

    @classmethod
    def of(cls, shape: Shape, X_WS: RigidTransform) -> "_Shape":
        """Makes it from a shape of Drake's at its pose.

        Raises:
            TypeError: The shape is neither a box nor a cylinder.
        """
        R = X_WS.rotation().matrix()
        vectors = np.zeros((3, 5))
        vectors[:, 0] = X_WS.translation()
        if isinstance(shape, Box):
            vectors[:, 1:4] = R * (shape.size() / 2.0)
            return cls(vectors, 0.0)
        if not isinstance(shape, Cylinder):
            raise TypeError(
                f"shape must be a Box or a Cylinder, got {type(shape).__name__}."
            )
        vectors[:, 3] = R[:, 2] * (shape.length() / 2.0)
        vectors[:, 4] = R[:, 2]
        return cls(vectors, shape.radius())


class _Shapes:
    """Vectors of many shapes side by side, and their projections.

    Attributes:
        count: How many shapes.
        vectors: (k, 3), m: all centres, the first, second and third edges of boxes,
            the edges of cylinders and their axes.
        owners: (k,) the shape that each of these belongs to.
    """

    def __init__(self, shapes: list[_Shape]) -> None:
        """Collects the vectors of shapes; centres are in their order."""
        vectors = np.stack([shape.vectors for shape in shapes])
        radii = np.array([shape.radius for shape in shapes], np.float32)
        self._boxes, self._round = np.flatnonzero(radii == 0.0), np.flatnonzero(radii)
        self._radii = radii[self._round, None]
        self.count = len(shapes)
        self.owners = np.concatenate(
            [np.arange(self.count), *3 * [self._boxes], *2 * [self._round]]
        )
        kinds = np.repeat(
            [0, 1, 2, 3, 3, 4],
            [self.count, *3 * [self._boxes.size], *2 * [self._round.size]],
        )
        self.vectors = vectors[self.owners, :, kinds]

    def spans(self, components: _Singles) -> tuple[_Singles, _Singles]:
        """Returns middles and half lengths of projections, each (axes, shapes, n), m.

        Args:
            components: (axes, k, n) of the vectors along the axes.
        """
        boxes, count = self._boxes.size, self._round.size
        edges = np.abs(components[:, self.count : len(self.vectors) - count])
        first, second, third, along = np.split(
            edges, [boxes, 2 * boxes, 3 * boxes], axis=1
        )
        across = 1.0 - components[:, len(self.vectors) - count :] ** 2
        half = np.empty_like(components[:, : self.count])
        half[:, self._boxes] = first + second + third
        half[:, self._round] = along + self._radii * np.sqrt(np.maximum(across, 0.0))
        return components[:, : self.count], half


@dataclass(frozen=True, eq=False)
class _Pairs(FrozenValue):
    """Pairs of parts, each compared along three axes in both directions.

    Attributes:
        one: (6, pairs) rows of the ends of the one part's projections; see `_ends`.
        other: (6, pairs) rows of the ends of the other part that face them.
        required: (pairs, 1) m, least distance.
    """

    one: IntArray
    other: IntArray
    required: _Singles

    def of(self, few: IntArray) -> "_Pairs":
        """Returns some of the pairs."""
        return _Pairs(self.one[:, few], self.other[:, few], self.required[few])

    def apart(self, ends: _Singles) -> BoolArray:
        """Returns which pairs are proven to be far enough apart, (pairs, n)."""
        overlap = ends[self.one]
        overlap += ends[self.other]
        return np.asarray(overlap.min(axis=0) <= -self.required)


class SeparatingAxisPrefilter:
    """Proves that configurations keep clear; what it cannot prove stays open."""

    def __init__(self, checker: CollisionChecker, X_WT: RigidTransform) -> None:
        """Reads the robot of a checker, and the shapes that were added around it.

        Args:
            checker: Its positions are those of a serial chain of revolute joints.
            X_WT: Frame along whose axes added shapes lie that do not lie along W's.
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
        self._squares = self._turns @ self._turns
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
        counts = [len(shapes) for _, _, shapes in parts]
        links = np.array([link for link, _, _ in parts])
        self._shapes = _Shapes([shape for _, _, some in parts for shape in some])
        self._firsts = np.cumsum([0, *counts])
        # The columns of each link's pose: three axes and its origin.
        vectors = self._shapes.vectors
        self._vectors = np.zeros((len(joints) + 1, 4, len(vectors)), np.float32)
        of_link = np.repeat(links, counts)[self._shapes.owners]
        self._vectors[of_link, :3, np.arange(len(vectors))] = vectors
        # Centres turn and move, edges and axes only turn.
        centres = np.arange(self._shapes.count)
        self._vectors[of_link[centres], 3, centres] = 1.0
        self._R_WT = X_WT.rotation().matrix()
        self._parts = self._shapes.count + len(parts)
        self._pairs(checker, parts)
        moving = self._shapes.count + np.flatnonzero(links > 0)
        self._around = self._ends_around(checker, moving)

    def passes(self, q: FloatArray, clearance: float) -> BoolArray:
        """Returns which configurations are proven to keep clear.

        Args:
            q: (n, joints) rad.
            clearance: From the shapes added around the robot, m. Between the robot's
                own parts it is the checker's padding when this was made.

        Returns:
            (n,) bool; where it is False the configuration may keep clear or not.
        """
        some = [
            self._passes(q[first : first + _AT_A_TIME], clearance + _MARGIN)
            for first in range(0, len(q), _AT_A_TIME)
        ]
        return np.concatenate(some) if some else np.zeros(0, dtype=bool)

    def _passes(self, q: FloatArray, clearance: float) -> BoolArray:
        ends = self._ends(q)
        clear = self._far.apart(ends).all(axis=0)
        # The axes of one link prove it for nearly all pairs.
        first, *others = self._near
        apart = first.apart(ends)
        few = np.flatnonzero(~apart.all(axis=1))
        if few.size:
            for pairs in others:
                apart[few] |= pairs.of(few).apart(ends)
        clear &= apart.all(axis=0)
        for rows, facing in self._around:
            overlap = ends[rows][:, :, None] + facing[:, None]
            clear &= (overlap.min(axis=0) <= -clearance).all(axis=(0, 1))
        return np.asarray(clear)

    def _ends(self, q: FloatArray) -> _Singles:
        """Returns the ends of projections along axes and against them, (rows, n), m.

        Axes are those of the links from the base on, three each, and those of T. Parts
        are shapes, and after them whole bodies. An end against an axis is the negative
        of the lower end. `_rows` gives the order.
        """
        count, size, vectors = len(q), self._shapes.count, len(self._shapes.vectors)
        angle = q[:, :, None, None]
        turns = np.eye(4) + np.sin(angle) * self._turns
        turns += (1.0 - np.cos(angle)) * self._squares
        X = np.empty((1 + len(self._turns), count, 4, 4))
        X[0] = np.eye(4)
        for link, before in enumerate(X[:-1]):
            np.matmul(before, turns[:, link], out=X[link + 1])
        poses = X[:, :, :3].transpose(1, 2, 0, 3).astype(np.float32)
        placed = poses.reshape(3 * count, -1) @ self._vectors.reshape(-1, vectors)
        axes = np.empty((count, len(X) + 1, 3, 3), np.float32)
        axes[:, :-1] = poses[..., :3].transpose(0, 2, 3, 1)
        axes[:, -1] = self._R_WT.T
        components = axes.reshape(count, -1, 3) @ placed.reshape(count, 3, -1)
        # Configurations come last, so that all else works on whole rows of them.
        components = np.ascontiguousarray(components.reshape(count, -1).T)
        middle, half = self._shapes.spans(components.reshape(-1, vectors, count))
        ends = np.empty((2, len(half), self._parts, count), np.float32)
        np.add(half, middle, out=ends[0, :, :size])
        np.subtract(half, middle, out=ends[1, :, :size])
        for body, (first, last) in enumerate(itertools.pairwise(self._firsts)):
            ends[:, :, first:last].max(axis=2, out=ends[:, :, size + body])
        return ends.reshape(-1, count)

    def _rows(self, axes: IntArray, parts: IntArray) -> tuple[IntArray, IntArray]:
        """Returns the rows of the ends of parts along axes, and against them."""
        along = self._parts * axes + parts
        return along, along + self._parts * 3 * (len(self._turns) + 2)

    def _pairs(self, checker: CollisionChecker, parts: list[_Part]) -> None:
        """Lists the pairs of parts that may collide, and the axes to project on."""
        count = self._shapes.count
        near: list[tuple[int, int, float, tuple[int, ...]]] = []
        far: list[tuple[int, int, float, tuple[int, ...]]] = []
        numbered = list(enumerate(parts))
        for (i, (a, first, _)), (j, (b, second, _)) in itertools.combinations(
            numbered, 2
        ):
            if checker.IsCollisionFilteredBetween(first, second):
                continue
            required = float(checker.GetPaddingBetween(first, second)) + _MARGIN
            if b - a > _NEAR:
                far.append((count + i, count + j, required, (b,)))
                continue
            near += [
                # Both links and the one between, if there is one.
                (k, m, required, (b, (a + b + 1) // 2, a))
                for k in range(self._firsts[i], self._firsts[i + 1])
                for m in range(self._firsts[j], self._firsts[j + 1])
            ]
        (self._far,) = self._listed(far)
        self._near = self._listed(near)

    def _listed(
        self, pairs: list[tuple[int, int, float, tuple[int, ...]]]
    ) -> list[_Pairs]:
        """Returns pairs (one, other, required, links) for the axes of each link."""
        one, other, required, links = (
            np.array(column) for column in zip(*pairs, strict=True)
        )
        listed = []
        for of_pair in links.T:
            axes = 3 * of_pair + np.arange(3)[:, None]
            (ahead, back), (beyond, before) = (
                self._rows(axes, part) for part in (one, other)
            )
            listed.append(
                _Pairs(
                    np.concatenate([ahead, back]),
                    np.concatenate([before, beyond]),
                    required.astype(np.float32)[:, None],
                )
            )
        return listed

    def _ends_around(
        self, checker: CollisionChecker, moving: IntArray
    ) -> list[tuple[IntArray, _Singles]]:
        """Returns the ends of added shapes' projections that moving parts face.

        Shapes are projected on T's axes or on W's, on whichever they are shorter.

        Returns:
            For T and for W: rows (6, moving) of ends and the ends (6, shapes, 1), m.
        """
        shapes = _Shapes(
            [
                _Shape.of(added.shape(), added.pose_in_body())
                for group in checker.GetAllAddedCollisionShapes().values()
                for added in group
            ]
        )
        of_T = 3 * len(self._turns) + 3
        axes = np.concatenate([self._R_WT.T, np.eye(3)])
        middle, half = shapes.spans((axes @ shapes.vectors.T)[..., None])
        in_T = np.less_equal(*half.reshape(2, 3, -1).prod(axis=1))
        return [
            (
                np.concatenate(self._rows(first + np.arange(3)[:, None], moving)),
                # Against the axes first: those face the ends along them.
                np.concatenate([half - middle, half + middle])[:, which],
            )
            for first, which, middle, half in zip(
                (of_T, 0),
                (in_T, ~in_T),
                np.split(middle, 2),
                np.split(half, 2),
                strict=True,
            )
        ]
