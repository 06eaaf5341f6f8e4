"""Keyframes with their constraints and planes: an immutable graph to be optimised."""

import bisect
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Self, TypeVar

import numpy as np
from pydrake.math import RigidTransform

from perception.depth_camera.depth import CameraIntrinsics
from perception.ground import FloatArray, FrozenValue, IntArray
from perception.mapping.config import PoseGraphConfig
from perception.mapping.keyframes.keyframe import Keyframe, PlaneSight
from perception.mapping.pose_graph.constraints import PoseConstraint
from perception.mapping.pose_graph.graph import (
    Estimate,
    Graph,
    Problem,
    Settled,
    Sighting,
)
from perception.mapping.pose_graph.observability import (
    observed_directions,
    prior_sigmas,
)
from perception.mapping.pose_graph.poses import Poses, angle_deg, pose_of
from perception.mapping.pose_graph.registration import find_constraints, overlap
from perception.paper_steps.wall import upright_rotation
from perception.settings import validate

_Part = TypeVar("_Part")

_PLANE_ANGLE_DEG = 5.0
_PLANE_DISTANCE = 0.03
"""A plane nearer than this, m, and less tilted, to a known one is the same."""


@dataclass(frozen=True, eq=False)
class KeyframeGraph(FrozenValue):
    """Keyframes, their estimated poses, and the measurements between them.

    Attributes:
        intrinsics: Of the camera.
        config: Sigmas and thresholds; never changed.
        keyframes: In order of time.
        poses: Estimated X_WC of each.
        constraints: Between them, ascending by the newer keyframe.
        sightings: Of planes, ascending by keyframe.
        planes: (m, 4): unit normal in W and offset, n . p = d.
        sighted: (m,) number of sightings of each.
        mount: (6,) estimated step from the nominal camera frame N to C.
        base: (n) estimated steps of the base in W at every keyframe, about its origin.
    """

    intrinsics: CameraIntrinsics
    config: PoseGraphConfig
    keyframes: tuple[Keyframe, ...]
    poses: tuple[RigidTransform, ...]
    constraints: tuple[PoseConstraint, ...]
    sightings: tuple[Sighting, ...]
    planes: FloatArray
    sighted: IntArray
    mount: FloatArray
    base: Poses

    @classmethod
    def empty(cls, intrinsics: CameraIntrinsics, config: PoseGraphConfig) -> Self:
        """Makes an empty graph.

        Args:
            intrinsics: Of the camera.
            config: Sigmas and thresholds.

        Raises:
            ValueError: A setting is out of bounds.
        """
        validate(config, "mapping")
        return cls(
            intrinsics=intrinsics,
            config=config,
            keyframes=(),
            poses=(),
            constraints=(),
            sightings=(),
            planes=np.zeros((0, 4)),
            sighted=np.zeros(0, np.int64),
            mount=np.zeros(6),
            base=Poses.identity(0),
        )

    @property
    def has_arm(self) -> bool:
        """Whether any keyframe has a pose by the arm."""
        return any(keyframe.X_WN is not None for keyframe in self.keyframes)

    def predicted(self, X_WN: RigidTransform) -> RigidTransform:
        """Returns X_WC of a picture, given the nominal camera's pose by the arm."""
        if self.keyframes and (X_before := self.keyframes[-1].X_WN) is not None:
            return self.poses[-1] @ X_before.inverse() @ X_WN
        return X_WN

    def is_new(self, X_KC: RigidTransform) -> bool:
        """Tells whether a picture shows enough new to become a keyframe.

        Args:
            X_KC: Pose of its camera in the last keyframe's.
        """
        config = self.config
        if np.linalg.norm(X_KC.translation()) > config.keyframe_distance:
            return True
        if angle_deg(X_KC.rotation()) > config.keyframe_angle_deg:
            return True
        seen = overlap(self.keyframes[-1], X_KC.inverse(), self.intrinsics)
        return seen < 1.0 - config.keyframe_coverage

    def extended(
        self,
        keyframe: Keyframe,
        X_WC: RigidTransform,
        constraints: list[PoseConstraint] | None = None,
    ) -> Self:
        """Returns the graph with one more keyframe.

        Args:
            keyframe: The new one.
            X_WC: First guess of its pose.
            constraints: To older ones; None = registers it to them.
        """
        index = len(self.keyframes)
        base = self.base[-1:] if index else Poses.identity(1)
        grown = self.replace(
            keyframes=(*self.keyframes, keyframe),
            poses=(*self.poses, X_WC),
            base=self.base.followed_by(base),
        )
        if constraints is None:
            constraints = find_constraints(
                grown.keyframes, grown.poses, self.intrinsics, self.config
            )
        planes, sightings = list(self.planes), list(self.sightings)
        for sight in keyframe.planes:
            number = _associate(sight, X_WC, planes)
            sightings.append(Sighting(index, number, sight))
        sighted = np.bincount(
            [s.plane for s in sightings[len(self.sightings) :]], minlength=len(planes)
        )
        sighted[: len(self.sighted)] += self.sighted
        return grown.replace(
            constraints=(*self.constraints, *constraints),
            sightings=tuple(sightings),
            planes=np.array(planes).reshape(-1, 4),
            sighted=sighted,
        )

    def optimized(self) -> tuple[Self, Estimate]:
        """Returns the graph with all keyframes optimised, and the estimate."""
        problem = self._problem(range(len(self.keyframes)))
        estimate = Graph(problem, self.config).optimize()
        return self._moved(problem, estimate), estimate

    def settled(self, members: Sequence[int]) -> Self:
        """Returns the graph with some keyframes optimised, in fewer rounds.

        The others are held fixed, and so are the mount and the planes that others saw.
        The cost depends on the number of members alone.

        Args:
            members: Numbers of the keyframes to optimise, ascending.
        """
        problem = self._problem(members)
        return self._moved(problem, Graph(problem, self.config).optimize(quick=True))

    def _problem(self, members: Sequence[int]) -> Problem:
        """Returns the members with the older keyframes of their constraints."""
        constraints = _of_numbers(self.constraints, members, lambda part: part.j)
        sightings = _of_numbers(self.sightings, members, lambda part: part.k)
        ends = [*members, *(constraint.i for constraint in constraints)]
        numbers = np.unique(np.array(ends, dtype=np.int64))
        settled = None
        if len(members) < len(self.keyframes):
            planes = [sighting.plane for sighting in sightings]
            settled = Settled(
                keyframes=~np.isin(numbers, members),
                planes=self.sighted > np.bincount(planes, minlength=len(self.planes)),
                mount=self.mount,
                base=self.base[numbers],
            )
        keyframes = [self.keyframes[k] for k in numbers]
        return Problem(
            X_WC=Poses.of([self.poses[k] for k in numbers]),
            X_WN=Poses.of([k.X_WN or RigidTransform() for k in keyframes]),
            has_arm=np.array([k.X_WN is not None for k in keyframes]),
            constraints=constraints,
            sightings=sightings,
            planes=self.planes,
            numbers=numbers,
            settled=settled,
        )

    def _moved(self, problem: Problem, estimate: Estimate) -> Self:
        """Returns the graph with the estimate of a problem in it."""
        poses = list(self.poses)
        for k, X_WC in zip(problem.numbers, estimate.X_WC.list(), strict=True):
            poses[k] = X_WC
        return self.replace(
            poses=tuple(poses),
            planes=estimate.planes.copy(),
            mount=estimate.mount.copy(),
            base=self.base.with_rows(
                problem.numbers, estimate.base.about(-estimate.middle)
            ),
        )

    def solved(self) -> "Solution":
        """Optimises all; corrects the arm's poses along observed directions."""
        graph, estimate = self.optimized()
        observed = np.array(
            [observed_directions(part, self.config) for part in estimate.observed]
        )
        steps = np.zeros((len(self.keyframes), 6))
        known = [k for k, frame in enumerate(self.keyframes) if frame.X_WN is not None]
        poses = list(graph.poses)
        if known:
            by_arm = [self.keyframes[k].X_WN for k in known]
            arm = Poses.of([X for X in by_arm if X is not None])
            sigma = prior_sigmas(self.config)
            scaled = arm.steps_to(estimate.X_WC[np.array(known)]) / sigma
            steps[known] = np.einsum("nij,nj->ni", observed[known], scaled) * sigma
            for k, X_WC in zip(known, arm.moved(steps[known]).list(), strict=True):
                poses[k] = X_WC
        return Solution(
            graph=graph.replace(poses=tuple(poses)),
            estimate=estimate,
            observed=observed,
            corrections=steps,
        )

    def main_frame(self) -> RigidTransform:
        """Returns X_WV: z is the most seen plane's normal, y the first camera's up."""
        R_WC = self.poses[0].rotation().matrix()
        up_W = -R_WC[:, 1]
        if not len(self.planes):
            R = upright_rotation(-R_WC[:, 2], up_W)
            return RigidTransform(R, self.poses[0].translation())
        seen = np.zeros(len(self.planes))
        for sighting in self.sightings:
            seen[sighting.plane] += sighting.sight.share
        *normal, offset = self.planes[int(np.argmax(seen))]
        normal_W = np.array(normal)
        if abs(normal_W @ up_W) > 0.98:
            up_W = np.roll(up_W, 1)
        R = upright_rotation(normal_W, up_W)
        middle = np.mean([X.translation() for X in self.poses], axis=0)
        return RigidTransform(R, middle - (normal_W @ middle - offset) * normal_W)


@dataclass(frozen=True, eq=False)
class Solution(FrozenValue):
    """A graph, optimised.

    Attributes:
        graph: With the final poses of its keyframes.
        estimate: Of the optimisation, with mount, base and weights.
        observed: (n, 6, 6) projections of the keyframes; see `observed_directions`.
        corrections: (n, 6) steps from the arm's X_WN to X_WC; 0 without an arm.
    """

    graph: KeyframeGraph
    estimate: Estimate
    observed: FloatArray
    corrections: FloatArray

    @property
    def mount(self) -> RigidTransform:
        """The mount's error X_NC: the camera in the nominal camera frame."""
        return pose_of(self.estimate.mount)


def _of_numbers(
    parts: Sequence[_Part], numbers: Sequence[int], key: Callable[[_Part], int]
) -> list[_Part]:
    """Returns the parts with some numbers, of parts in ascending order of them."""
    found: list[_Part] = []
    for k in numbers:
        start = bisect.bisect_left(parts, k, key=key)
        found += parts[start : bisect.bisect_right(parts, k, start, key=key)]
    return found


def _associate(
    sight: PlaneSight, X_WC: RigidTransform, planes: list[FloatArray]
) -> int:
    """Returns the number of a plane's landmark; appends a new one if none matches."""
    normal = X_WC.rotation() @ sight.normal
    center = X_WC @ sight.center
    best, number = np.inf, len(planes)
    for k, (*n, d) in enumerate(planes):
        away = abs(float(np.dot(n, center)) - d)
        cos = float(np.dot(n, normal))
        if cos > np.cos(np.deg2rad(_PLANE_ANGLE_DEG)) and away < min(
            best, _PLANE_DISTANCE
        ):
            best, number = away, k
    if number == len(planes):
        planes.append(np.array([*normal, normal @ center]))
    return number
