"""Maps frames one by one: keyframes, constraints, pose graph, surface."""

import enum
import time
from collections import Counter
from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform

from perception.depth_camera.depth import CameraIntrinsics
from perception.errors import PerceptionError
from perception.io.frames import Frame
from perception.mapping.config import MapperConfig
from perception.mapping.fusion.fusion import FusedMap, fuse
from perception.mapping.keyframes.keyframe import Keyframe, find_features, make_keyframe
from perception.mapping.keyframes.view import Features
from perception.mapping.keyframes.working_set import WorkingSet
from perception.mapping.pose_graph.constraints import (
    ConstraintKind,
    PoseConstraint,
    constraint_by_appearance,
)
from perception.mapping.pose_graph.keyframe_graph import KeyframeGraph, Solution

_PATIENCE = 10
"""Lost frames after which a map without poses is given up."""
_SCALE_BASELINE = 0.05
"""Shortest constraint from which the camera's scale is checked, m."""
_SCALE_COUNT = 10
"""Fewest such constraints."""
_SCALE = 0.03
"""Largest deviation of the camera's motion from the arm's, a share of it."""


class NoMapError(PerceptionError):
    """No valid map can be made; the message gives the reason."""


class Outcome(enum.StrEnum):
    """How a frame was used."""

    KEYFRAME = "keyframe"
    TRACKED = "tracked"
    WRONG_SIZE = "wrong_size"
    NO_DEPTH = "no_depth"
    OUT_OF_ORDER = "out_of_order"
    LOST = "lost"


@dataclass(frozen=True, eq=False)
class MappingResult:
    """The map with its poses.

    Attributes:
        poses: Time, s, and X_WC of every frame that has a pose.
        solution: The optimised pose graph.
        fused: The surface.
    """

    poses: list[tuple[float, RigidTransform]]
    solution: Solution
    fused: FusedMap


class Mapper:
    """Maps a sequence; `add` the frames, then `finish`.

    Between `add` calls, `MapperConfig.working_set` (w) bounds time and memory:

    - at most w keyframes have corners, depths and pixels in memory, those made or
      registered last; the others are in a file and are read back when needed;
    - every `optimize_every` keyframes these w are solved for, with at most w times
      `max_links` constraints; all else is held fixed (see `KeyframeGraph.settled`).

    Poses, planes, constraints and sampled points stay in memory, about 12 kB per
    keyframe, and one pose per frame; finding the nearest keyframes takes 1 us for each.
    Only `finish` solves for all keyframes and fuses them one after the other.

    Attributes:
        config: Settings; not to be changed.
        graph: Keyframes so far, with constraints and planes.
        outcomes: Number of frames by outcome.
        seconds: CPU time of every keyframe, s.
        fuse_seconds: CPU time of the last optimisation and of the fusion, s.
        placed: Time, s, last keyframe k and X_KC of every frame that has a pose.
    """

    def __init__(self, intrinsics: CameraIntrinsics, config: MapperConfig) -> None:
        """Starts an empty map.

        Args:
            intrinsics: Of the camera.
            config: Settings.

        Raises:
            ValueError: A setting is out of bounds.
        """
        self.config = config
        self.graph = KeyframeGraph.empty(intrinsics, config)
        self.outcomes: Counter[Outcome] = Counter()
        self.seconds: list[float] = []
        self.placed: list[tuple[float, int, RigidTransform]] = []
        self.fuse_seconds = 0.0
        self._intrinsics = intrinsics
        self._working_set = WorkingSet(config.working_set)
        self._last_time = -np.inf
        self._best_inliers = 0

    def add(self, frame: Frame) -> Outcome:
        """Adds the next frame.

        Raises:
            NoMapError: Frames without poses cannot be tracked.
        """
        start = time.process_time()
        outcome = self._add(frame)
        self.outcomes[outcome] += 1
        if outcome is Outcome.KEYFRAME:
            self.seconds.append(time.process_time() - start)
        lost = self.outcomes[Outcome.LOST]
        if lost >= _PATIENCE and lost > len(self.placed):
            raise self._no_map()
        return outcome

    def finish(self) -> MappingResult:
        """Optimises all keyframes and fuses the map.

        Raises:
            NoMapError: There is no keyframe, or most frames were lost.
        """
        if not self.graph.keyframes or self.outcomes[Outcome.LOST] > len(self.placed):
            raise self._no_map()
        self._check_scale()
        start = time.process_time()
        solution = self.graph.solved()
        self.graph = graph = solution.graph
        fused = fuse(
            graph.keyframes,
            graph.poses,
            graph.main_frame(),
            self._intrinsics,
            self.config,
        )
        self.fuse_seconds = time.process_time() - start
        poses = [(t, graph.poses[k] @ X_KC) for t, k, X_KC in self.placed]
        return MappingResult(poses=poses, solution=solution, fused=fused)

    def _add(self, frame: Frame) -> Outcome:
        size = (self._intrinsics.height, self._intrinsics.width)
        if frame.depth_mm.shape != size or frame.color.shape != (*size, 3):
            return Outcome.WRONG_SIZE
        if not frame.time > self._last_time:
            return Outcome.OUT_OF_ORDER
        if np.count_nonzero(frame.depth_mm) < 0.02 * frame.depth_mm.size:
            return Outcome.NO_DEPTH
        self._last_time = frame.time
        features = None
        tracked = None
        if frame.X_WC is None:
            features = find_features(frame, self._intrinsics, self.config)
            tracked = self._track(features)
        X_WC = self._predict(frame, tracked)
        if X_WC is None:
            return Outcome.LOST
        if poses := self.graph.poses:
            X_KC = poses[-1].inverse() @ X_WC
            if not self.graph.is_new(X_KC):
                self.placed.append((frame.time, len(poses) - 1, X_KC))
                return Outcome.TRACKED
        if features is None:
            features = find_features(frame, self._intrinsics, self.config)
        number = sum(self.outcomes.values())
        self.add_keyframe(
            make_keyframe(frame, number, features, self._intrinsics, self.config),
            X_WC,
        )
        return Outcome.KEYFRAME

    def restore(
        self,
        frame: Frame,
        number: int,
        X_WC: RigidTransform,
        constraints: list[PoseConstraint],
    ) -> None:
        """Adds a keyframe from a store with its stored constraints."""
        features = find_features(frame, self._intrinsics, self.config)
        keyframe = make_keyframe(frame, number, features, self._intrinsics, self.config)
        self.add_keyframe(keyframe, X_WC, constraints)

    def add_keyframe(
        self,
        keyframe: Keyframe,
        X_WC: RigidTransform,
        constraints: list[PoseConstraint] | None = None,
    ) -> None:
        """Adds a keyframe.

        Args:
            keyframe: The new one.
            X_WC: First guess of its pose.
            constraints: To older ones; None = registers it to them.
        """
        index = len(self.graph.keyframes)
        self.placed.append((keyframe.time, index, RigidTransform()))
        self._last_time = max(self._last_time, keyframe.time)
        keyframe = self._working_set.take(index, keyframe)
        self.graph = self.graph.extended(keyframe, X_WC, constraints)
        if index and index % self.config.optimize_every == 0:
            self.graph = self.graph.settled(self._working_set.members)

    def _track(self, features: Features) -> PoseConstraint | None:
        """Registers a frame to one of the last keyframes by appearance."""
        self._best_inliers = 0
        keyframes = self.graph.keyframes
        for index in reversed(range(max(0, len(keyframes) - 3), len(keyframes))):
            constraint, inliers = constraint_by_appearance(
                keyframes[index].features,
                features,
                self._intrinsics,
                self.config,
                (index, len(keyframes)),
            )
            self._best_inliers = max(self._best_inliers, inliers)
            if constraint is not None:
                return constraint
        return None

    def _predict(
        self, frame: Frame, tracked: PoseConstraint | None
    ) -> RigidTransform | None:
        """Returns the first guess of X_WC, or None if there is none."""
        if tracked is not None:
            return self.graph.poses[tracked.i] @ tracked.X_ij
        if frame.X_WC is None:
            return None if self.graph.keyframes else RigidTransform()
        return self.graph.predicted(frame.X_WC)

    def _check_scale(self) -> None:
        """Raises if camera and arm move differently; a bare wall does not show it."""
        ratios = []
        for constraint in self.graph.constraints:
            a, b = (self.graph.keyframes[k].X_WN for k in (constraint.i, constraint.j))
            if (
                constraint.kind is not ConstraintKind.APPEARANCE
                or a is None
                or b is None
            ):
                continue
            by_arm = np.linalg.norm((a.inverse() @ b).translation())
            if by_arm > _SCALE_BASELINE:
                ratios.append(np.linalg.norm(constraint.X_ij.translation()) / by_arm)
        if len(ratios) < _SCALE_COUNT:
            return
        ratio = float(np.median(ratios))
        if abs(ratio - 1.0) > _SCALE:
            raise NoMapError(
                f"the pictures move {ratio:.3f} times as far as the arm; the limit is "
                f"1 +- {_SCALE}: correct the camera's focal length or depth unit.",
                code="PNT-MAP-001",
            )

    def _no_map(self) -> NoMapError:
        lost, total = self.outcomes[Outcome.LOST], sum(self.outcomes.values())
        if lost:
            return NoMapError(
                f"{lost} of {total} frames have no pose and could not be tracked: "
                f"{self._best_inliers} corners agree, {self.config.min_inliers} are "
                "needed. The wall has too little texture; give the arm's poses.",
                code="PNT-MAP-002",
            )
        counts = ", ".join(f"{name}: {n}" for name, n in self.outcomes.items())
        return NoMapError(
            f"no frame is usable ({counts or 'the sequence is empty'}).",
            code="PNT-MAP-003",
        )
