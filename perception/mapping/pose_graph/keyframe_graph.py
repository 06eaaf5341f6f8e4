"""Keyframes with their links and planes: a value that grows, and is solved at need."""

import bisect
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Self, TypeVar

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from scipy.spatial.transform import Rotation

from perception.depth_camera.depth import CameraIntrinsics
from perception.ground import FloatArray, FrozenValue, IntArray
from perception.mapping.config import PoseGraphConfig
from perception.mapping.keyframes.keyframe import Keyframe, PlaneSight
from perception.mapping.pose_graph.graph import (
    Estimate,
    Graph,
    Problem,
    Settled,
    Sighting,
)
from perception.mapping.pose_graph.links import PoseConstraint
from perception.mapping.pose_graph.observability import (
    observed_directions,
    prior_sigmas,
)
from perception.mapping.pose_graph.poses import Poses, angle_deg
from perception.mapping.pose_graph.registration import find_constraints, overlap
from perception.paper_steps.wall import upright_rotation
from perception.settings import validate

_Part = TypeVar("_Part")

_PLANE_ANGLE_DEG = 5.0
_PLANE_DISTANCE = 0.03
"""A plane is a known one if it is no farther off than this."""


@dataclass(frozen=True, eq=False)
class KeyframeGraph(FrozenValue):
    """Keyframes, where they are thought to be, and what ties them.

    Attributes:
        intrinsics: Of the camera.
        config: Sigmas and thresholds; never changed.
        keyframes: In order of time.
        poses: X_WC of each.
        links: Between them, by the newer keyframe.
        sightings: Of planes, by keyframe.
        planes: (m, 4): unit normal in W and offset, n . p = d.
        sighted: (m,) sightings of each.
        mount: (6,) step from the arm's camera frame to the true one, so far.
        base: (n) steps of the base in W at every keyframe, about its origin, so far.
    """

    intrinsics: CameraIntrinsics
    config: PoseGraphConfig
    keyframes: tuple[Keyframe, ...]
    poses: tuple[RigidTransform, ...]
    links: tuple[PoseConstraint, ...]
    sightings: tuple[Sighting, ...]
    planes: FloatArray
    sighted: IntArray
    mount: FloatArray
    base: Poses

    @classmethod
    def empty(cls, intrinsics: CameraIntrinsics, config: PoseGraphConfig) -> Self:
        """Makes a graph of nothing.

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
            links=(),
            sightings=(),
            planes=np.zeros((0, 4)),
            sighted=np.zeros(0, np.int64),
            mount=np.zeros(6),
            base=Poses.identity(0),
        )

    @property
    def has_arm(self) -> bool:
        """Whether the arm gave a pose of any keyframe."""
        return any(keyframe.X_arm is not None for keyframe in self.keyframes)

    def predicted(self, X_arm: RigidTransform) -> RigidTransform:
        """Returns X_WC of a picture that the arm places at `X_arm`."""
        if self.keyframes and (X_before := self.keyframes[-1].X_arm) is not None:
            return self.poses[-1] @ X_before.inverse() @ X_arm
        return X_arm

    def is_new(self, X_KC: RigidTransform) -> bool:
        """Tells whether a picture shows enough that the last keyframe did not.

        Args:
            X_KC: Where it was taken, seen from that keyframe.
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
        links: list[PoseConstraint] | None = None,
    ) -> Self:
        """Returns the graph with a keyframe more.

        Args:
            keyframe: The new one.
            X_WC: Where it is thought to be.
            links: To older ones, if they are known already; else they are looked for.
        """
        index = len(self.keyframes)
        base = self.base[-1:] if index else Poses.identity(1)
        grown = self.replace(
            keyframes=(*self.keyframes, keyframe),
            poses=(*self.poses, X_WC),
            base=self.base.followed_by(base),
        )
        if links is None:
            links = find_constraints(
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
            links=(*self.links, *links),
            sightings=tuple(sightings),
            planes=np.array(planes).reshape(-1, 4),
            sighted=sighted,
        )

    def optimized(self) -> tuple[Self, Estimate]:
        """Returns the graph with all that it holds at its most likely, and more."""
        problem = self._problem(range(len(self.keyframes)))
        estimate = Graph(problem, self.config).optimize()
        return self._moved(problem, estimate), estimate

    def settled(self, members: Sequence[int]) -> Self:
        """Returns the graph with some keyframes at their most likely, by fewer rounds.

        All others are held where they are, and with them the mount and the planes that
        they saw, too. What this costs depends on the number of members alone.

        Args:
            members: Numbers of the keyframes to be moved, ascending.
        """
        problem = self._problem(members)
        return self._moved(problem, Graph(problem, self.config).optimize(quick=True))

    def _problem(self, members: Sequence[int]) -> Problem:
        """Returns the members with the older keyframes that links tie them to."""
        links = [
            link
            for k in members
            for link in _of_number(self.links, k, lambda link: link.j)
        ]
        sightings = [
            sighting
            for k in members
            for sighting in _of_number(self.sightings, k, lambda sighting: sighting.k)
        ]
        ends = [*members, *(link.i for link in links)]
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
            X_arm=Poses.of([k.X_arm or RigidTransform() for k in keyframes]),
            has_arm=np.array([k.X_arm is not None for k in keyframes]),
            links=links,
            sightings=sightings,
            planes=self.planes,
            numbers=numbers,
            settled=settled,
        )

    def _moved(self, problem: Problem, estimate: Estimate) -> Self:
        """Returns the graph with a problem's keyframes where they are now."""
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
        """Returns the last answer: the arm corrected where that is observed."""
        graph, estimate = self.optimized()
        observed = np.array(
            [observed_directions(part, self.config) for part in estimate.observed]
        )
        steps = np.zeros((len(self.keyframes), 6))
        known = [k for k, frame in enumerate(self.keyframes) if frame.X_arm is not None]
        poses = list(graph.poses)
        if known:
            by_arm = [self.keyframes[k].X_arm for k in known]
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
    """A graph's last answer.

    Attributes:
        graph: With its keyframes where they are now thought to be.
        estimate: What that rests on, and the slow states.
        observed: (n, 6, 6) projections of the keyframes; see `observed_directions`.
        corrections: (n, 6) steps from the arm's poses to the keyframes'; 0 without.
    """

    graph: KeyframeGraph
    estimate: Estimate
    observed: FloatArray
    corrections: FloatArray

    @property
    def mount(self) -> RigidTransform:
        """The mount's error: the true camera frame seen from the arm's, X_CCm."""
        turn, shift = self.estimate.mount[:3], self.estimate.mount[3:]
        R = Rotation.from_rotvec(turn.copy()).as_matrix()
        return RigidTransform(RotationMatrix.ProjectToRotationMatrix(R), shift)


def _of_number(
    parts: Sequence[_Part], k: int, number: Callable[[_Part], int]
) -> Sequence[_Part]:
    """Returns those of some parts, sorted by number, that have a number."""
    start = bisect.bisect_left(parts, k, key=number)
    return parts[start : bisect.bisect_right(parts, k, start, key=number)]


def _associate(
    sight: PlaneSight, X_WC: RigidTransform, planes: list[FloatArray]
) -> int:
    """Returns the number of the landmark that a plane is; a new one is appended."""
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
