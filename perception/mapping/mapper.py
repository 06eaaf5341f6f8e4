"""Takes frames one by one, keeps keyframes, links them, and makes the map."""

import enum
import time
from collections import Counter
from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from perception.depth import CameraIntrinsics
from perception.errors import PerceptionError
from perception.mapping.config import MapperConfig
from perception.mapping.frames import Frame
from perception.mapping.fusion import FusedMap, fuse
from perception.mapping.graph import (
    Estimate,
    Graph,
    Problem,
    Sighting,
    observed_directions,
    prior_sigmas,
)
from perception.mapping.keyframe import (
    Features,
    Keyframe,
    PlaneSight,
    find_features,
    make_keyframe,
)
from perception.mapping.links import (
    Link,
    LinkKind,
    link_by_appearance,
    link_by_geometry,
)
from perception.mapping.poses import Poses
from perception.values import FloatArray
from perception.wall import upright_rotation

_PLANE_ANGLE_DEG = 5.0
_PLANE_DISTANCE = 0.03
"""A plane is a known one if it is no farther off than this."""
_RECENT = 2
"""Keyframes back that a new one is always registered to."""
_CANDIDATES = 12
"""Older keyframes, the nearest ones, whose overlap is looked at."""
_PATIENCE = 10
"""Frames that may be lost before a map without poses is given up."""
_GATE = 0.03
"""A link farther from the arm's relative pose than this, m, is no link."""
_GATE_DEG = 2.0


class NoMapError(PerceptionError):
    """There is no map that could be right; the message says why."""


class Outcome(enum.StrEnum):
    """What became of a frame."""

    KEYFRAME = "keyframe"
    TRACKED = "tracked"
    WRONG_SIZE = "wrong_size"
    NO_DEPTH = "no_depth"
    OUT_OF_ORDER = "out_of_order"
    LOST = "lost"


@dataclass(frozen=True, eq=False)
class MappingResult:
    """The map and how it came about.

    Attributes:
        poses: Time, s, and X_WC of every frame that could be placed.
        keyframe_poses: X_WC of the keyframes.
        fused: The surface.
        estimate: The graph's last answer; None without keyframes.
        observed: (n, 6, 6) projections of the keyframes; see `observed_directions`.
        corrections: (n, 6) steps from the arm's poses to the keyframes' poses.
    """

    poses: list[tuple[float, RigidTransform]]
    keyframe_poses: list[RigidTransform]
    fused: FusedMap
    estimate: Estimate
    observed: FloatArray
    corrections: FloatArray


class Mapper:
    """Maps a sequence; `add` the frames, then `finish`.

    Attributes:
        keyframes: So far.
        links: Between them.
        sightings: Of planes, by keyframe.
        outcomes: How many frames came to what.
        seconds: CPU time of every keyframe, s.
        fuse_seconds: CPU time of the last optimisation and of the fusion, s.
        placed: Time, s, last keyframe k and X_KC of every frame that has a pose.
    """

    def __init__(self, intrinsics: CameraIntrinsics, config: MapperConfig) -> None:
        """Starts with nothing.

        Args:
            intrinsics: Of the camera.
            config: Settings.

        Raises:
            ValueError: A setting is out of bounds.
        """
        config.validate()
        self.keyframes: list[Keyframe] = []
        self.links: list[Link] = []
        self.outcomes: Counter[Outcome] = Counter()
        self.seconds: list[float] = []
        self._intrinsics, self._config = intrinsics, config
        self._poses: list[RigidTransform] = []
        self.sightings: list[Sighting] = []
        self._planes: list[FloatArray] = []
        self.placed: list[tuple[float, int, RigidTransform]] = []
        self.fuse_seconds = 0.0
        self._last_time = -np.inf
        self._best_inliers = 0

    def add(self, frame: Frame) -> Outcome:
        """Takes the next frame.

        Raises:
            NoMapError: Frames without poses cannot be followed.
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
        """Optimises a last time and fuses the map.

        Raises:
            NoMapError: There is no keyframe, or most frames were lost.
        """
        if not self.keyframes or self.outcomes[Outcome.LOST] > len(self.placed):
            raise self._no_map()
        start = time.process_time()
        estimate = self.optimize()
        directions = [
            observed_directions(part, self._config) for part in estimate.observed
        ]
        corrections = self._corrections(estimate, np.array(directions))
        X_WV = self.main_frame()
        fused = fuse(self.keyframes, self._poses, X_WV, self._intrinsics, self._config)
        self.fuse_seconds = time.process_time() - start
        return MappingResult(
            poses=[(t, self._poses[k] @ X) for t, k, X in self.placed],
            keyframe_poses=list(self._poses),
            fused=fused,
            estimate=estimate,
            observed=np.array(directions),
            corrections=corrections,
        )

    def optimize(self, quick: bool = False) -> Estimate:
        """Solves the pose graph and moves keyframes and planes to its answer."""
        unknown = RigidTransform()
        problem = Problem(
            X_WC=Poses.of(self._poses),
            X_arm=Poses.of([k.X_arm or unknown for k in self.keyframes]),
            has_arm=np.array([k.X_arm is not None for k in self.keyframes]),
            links=self.links,
            sightings=self.sightings,
            planes=np.array(self._planes).reshape(-1, 4),
        )
        estimate = Graph(problem, self._config).optimize(quick)
        self._poses = estimate.X_WC.list()
        self._planes = list(estimate.planes)
        return estimate

    @property
    def poses(self) -> list[RigidTransform]:
        """X_WC of the keyframes, as they are thought to be now."""
        return list(self._poses)

    def main_frame(self) -> RigidTransform:
        """Returns X_WV: z is the most seen plane's normal, y the first camera's up."""
        up_W = -self._poses[0].rotation().matrix()[:, 1]
        if not self._planes:
            R = upright_rotation(-self._poses[0].rotation().matrix()[:, 2], up_W)
            return RigidTransform(R, self._poses[0].translation())
        seen = np.zeros(len(self._planes))
        for sighting in self.sightings:
            seen[sighting.plane] += sighting.sight.share
        *normal, offset = self._planes[int(np.argmax(seen))]
        normal_W = np.array(normal)
        if abs(normal_W @ up_W) > 0.98:
            up_W = np.roll(up_W, 1)
        R = upright_rotation(normal_W, up_W)
        middle = np.mean([X.translation() for X in self._poses], axis=0)
        return RigidTransform(R, middle - (normal_W @ middle - offset) * normal_W)

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
            features = find_features(frame, self._intrinsics, self._config)
            tracked = self._track(features)
        X_WC = self._predict(frame, tracked)
        if X_WC is None:
            return Outcome.LOST
        if self.keyframes:
            X_KC = self._poses[-1].inverse() @ X_WC
            if not self._is_new(X_KC):
                self.placed.append((frame.time, len(self.keyframes) - 1, X_KC))
                return Outcome.TRACKED
        if features is None:
            features = find_features(frame, self._intrinsics, self._config)
        number = sum(self.outcomes.values())
        self.add_keyframe(
            make_keyframe(frame, number, features, self._intrinsics, self._config),
            X_WC,
        )
        return Outcome.KEYFRAME

    def restore(
        self, frame: Frame, number: int, X_WC: RigidTransform, links: list[Link]
    ) -> None:
        """Takes a keyframe back from a store, with the links that were found then."""
        features = find_features(frame, self._intrinsics, self._config)
        keyframe = make_keyframe(
            frame, number, features, self._intrinsics, self._config
        )
        self.add_keyframe(keyframe, X_WC, links)

    def add_keyframe(
        self, keyframe: Keyframe, X_WC: RigidTransform, links: list[Link] | None = None
    ) -> None:
        """Takes a keyframe.

        Args:
            keyframe: The new one.
            X_WC: Where it is thought to be.
            links: To older ones, if they are known already; else they are looked for.
        """
        index = len(self.keyframes)
        self.keyframes.append(keyframe)
        self._poses.append(X_WC)
        self.placed.append((keyframe.time, index, RigidTransform()))
        self._last_time = max(self._last_time, keyframe.time)
        self.links += self._find_links(index) if links is None else links
        for sight in keyframe.planes:
            self.sightings.append(Sighting(index, self._associate(sight, X_WC), sight))
        if index and index % self._config.optimize_every == 0:
            self.optimize(quick=True)

    def _track(self, features: Features) -> Link | None:
        """Finds a frame by appearance among the last keyframes."""
        self._best_inliers = 0
        for index in reversed(
            range(max(0, len(self.keyframes) - 3), len(self.keyframes))
        ):
            link, inliers = link_by_appearance(
                self.keyframes[index].features,
                features,
                self._intrinsics,
                self._config,
                (index, len(self.keyframes)),
            )
            self._best_inliers = max(self._best_inliers, inliers)
            if link is not None:
                return link
        return None

    def _predict(self, frame: Frame, tracked: Link | None) -> RigidTransform | None:
        """Returns where the frame was taken, or None if nothing tells."""
        if tracked is not None:
            return self._poses[tracked.i] @ tracked.X_ij
        if frame.X_WC is None:
            return None if self.keyframes else RigidTransform()
        if self.keyframes and (X_arm := self.keyframes[-1].X_arm) is not None:
            return self._poses[-1] @ X_arm.inverse() @ frame.X_WC
        return frame.X_WC

    def _is_new(self, X_KC: RigidTransform) -> bool:
        """Tells whether a frame shows enough that its last keyframe did not."""
        config = self._config
        if np.linalg.norm(X_KC.translation()) > config.keyframe_distance:
            return True
        if _angle_deg(X_KC.rotation()) > config.keyframe_angle_deg:
            return True
        overlap = self._overlap(self.keyframes[-1], X_KC.inverse())
        return overlap < 1.0 - config.keyframe_coverage

    def _overlap(self, keyframe: Keyframe, X_CK: RigidTransform) -> float:
        """Returns the share of a keyframe's points that another pose sees."""
        points = keyframe.grid.points[keyframe.grid.valid][::16].T
        if not points.size:
            return 0.0
        camera = self._intrinsics
        x, y, z = X_CK @ points
        z = np.maximum(z, 1e-3)
        u, v = camera.fx * x / z + camera.cx, camera.fy * y / z + camera.cy
        inside = (u >= 0) & (u < camera.width) & (v >= 0) & (v < camera.height)
        return float(inside.mean())

    def _find_links(self, index: int) -> list[Link]:
        """Registers a keyframe to the last ones and to older ones that it overlaps."""
        recent = list(range(max(0, index - _RECENT), index))
        places = Poses.of(self._poses)
        away = np.linalg.norm(
            places.p[: max(0, index - _RECENT)] - places.p[index], axis=1
        )
        older = [
            (self._overlap(self.keyframes[k], self._relative(index, k)), k)
            for k in np.argsort(away)[:_CANDIDATES].tolist()
        ]
        older = sorted((pair for pair in older if pair[0] > 0.3), reverse=True)
        # The nearest in the picture, but no two neighbours of each other.
        chosen: list[int] = []
        for _, k in older:
            if all(abs(k - other) > 1 for other in chosen):
                chosen.append(k)
        chosen = chosen[: self._config.max_links - len(recent)]
        links = []
        for k in [*recent, *chosen]:
            links += self._register(k, index)
        return links

    def _relative(self, i: int, j: int) -> RigidTransform:
        return self._poses[i].inverse() @ self._poses[j]

    def _register(self, i: int, j: int) -> list[Link]:
        """Links two keyframes by appearance, or else by geometry."""
        a, b, guess = self.keyframes[i], self.keyframes[j], self._relative(i, j)
        link, _ = link_by_appearance(
            a.features, b.features, self._intrinsics, self._config, (i, j)
        )
        if link is None:
            link = link_by_geometry(
                a.grid, b.grid, guess, self._intrinsics, self._config, (i, j)
            )
        if link is None:
            return []
        off = guess.inverse() @ link.X_ij
        arm = a.X_arm is not None and b.X_arm is not None
        if (arm or link.kind is LinkKind.GEOMETRY) and (
            np.linalg.norm(off.translation()) > _GATE
            or _angle_deg(off.rotation()) > _GATE_DEG
        ):
            return []
        return [link]

    def _associate(self, sight: PlaneSight, X_WC: RigidTransform) -> int:
        """Returns the number of the landmark that a plane is; a new one if none."""
        normal = X_WC.rotation() @ sight.normal
        center = X_WC @ sight.center
        best, number = np.inf, len(self._planes)
        for k, (*n, d) in enumerate(self._planes):
            away = abs(float(np.dot(n, center)) - d)
            cos = float(np.dot(n, normal))
            if cos > np.cos(np.deg2rad(_PLANE_ANGLE_DEG)) and away < min(
                best, _PLANE_DISTANCE
            ):
                best, number = away, k
        if number == len(self._planes):
            self._planes.append(np.array([*normal, normal @ center]))
        return number

    def _corrections(self, estimate: Estimate, directions: FloatArray) -> FloatArray:
        """Keeps of each keyframe's correction what is observed; moves the keyframes.

        Returns:
            (n, 6) steps from the arm's poses; 0 for keyframes without.
        """
        known = np.array([k.X_arm is not None for k in self.keyframes])
        steps = np.zeros((len(known), 6))
        if not known.any():
            return steps
        index = np.flatnonzero(known)
        arm = Poses.of([k.X_arm for k in self.keyframes if k.X_arm is not None])
        sigma = prior_sigmas(self._config)
        scaled = arm.steps_to(estimate.X_WC[index]) / sigma
        steps[index] = np.einsum("nij,nj->ni", directions[index], scaled) * sigma
        for k, X_WC in zip(index, arm.moved(steps[index]).list(), strict=True):
            self._poses[k] = X_WC
        return steps

    def _no_map(self) -> NoMapError:
        lost, total = self.outcomes[Outcome.LOST], sum(self.outcomes.values())
        if lost:
            return NoMapError(
                f"{lost} of {total} frames have no pose and could not be followed: "
                f"{self._best_inliers} corners agree, {self._config.min_inliers} are "
                "needed. The wall shows too little texture; give the arm's poses."
            )
        counts = ", ".join(f"{name}: {n}" for name, n in self.outcomes.items())
        return NoMapError(f"no frame can be used ({counts or 'there is none'}).")


def _angle_deg(R: RotationMatrix) -> float:
    cos = (np.trace(R.matrix()) - 1.0) / 2.0
    return float(np.degrees(np.arccos(np.clip(cos, -1.0, 1.0))))
