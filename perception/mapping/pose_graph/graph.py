"""The pose graph: keyframes, plane landmarks, the mount's error and the base's shift.

Minimises over all at once, by Gauss-Newton on a sparse system with graduated robust
weights. Open3D's pose graph holds relative poses only: the arm's absolute poses
would become constraints to a fixed node, and it has no planes and slow states. GTSAM is
no dependency. So the sum of squares is our own and SciPy solves it.

Source: Yang et al., "Graduated non-convexity for robust spatial perception", 2020;
Black and Rangarajan, "On the unification of line processes", 1996 (Geman-McClure).
"""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from perception.ground import BoolArray, FloatArray, IntArray
from perception.mapping.config import PoseGraphConfig
from perception.mapping.keyframes.keyframe import PlaneSight
from perception.mapping.pose_graph.constraints import PoseConstraint
from perception.mapping.pose_graph.normal_equations import NormalEquations
from perception.mapping.pose_graph.observability import information_of
from perception.mapping.pose_graph.poses import Poses, skew

_SCHEDULE = (1e5, 1e4, 1e3, 100.0, 30.0, 30.0, 30.0)
"""Squared sigmas at which the weight of a constraint is a quarter, round by round."""
_QUICK = (1e3, 100.0, 30.0)
"""The same between keyframes, when the last estimate is near."""
_LOOSE = 500.0
"""Above this scale the base's steps have ten times the standard deviation."""
_WALK = 4.0
"""The same for steps of the base, which are rare and large (Cauchy's weights)."""
_HALVED = 0.25
"""Factor of the variance when the standard deviation is halved."""


@dataclass(frozen=True, eq=False)
class Sighting:
    """Keyframe `k` saw landmark `plane` as `sight`."""

    k: int
    plane: int
    sight: PlaneSight


@dataclass(frozen=True, eq=False)
class Settled:
    """What is held fixed while only some keyframes are solved for.

    Attributes:
        keyframes: (n,) bool, keyframes held fixed, with the base's steps at them.
        planes: (m,) bool, planes held fixed.
        mount: (6,) step from the nominal camera frame N to C, held fixed.
        base: (n) steps of the base in W, about its origin: fixed or first guess.
    """

    keyframes: BoolArray
    planes: BoolArray
    mount: FloatArray
    base: Poses


@dataclass(eq=False)
class Problem:
    """Measurements and first guesses of the keyframes.

    Attributes:
        X_WC: (n) first guesses.
        X_WN: (n) poses of the nominal camera by the arm; arbitrary without one.
        has_arm: (n,) bool, the arm gave a pose.
        constraints: Between keyframes.
        sightings: Planes seen by keyframes.
        planes: (m, 4): unit normal in W and offset, n . p = d.
        numbers: (n,) ascending, keyframe numbers in constraints and sightings.
        settled: What is held fixed; None = only the base's step at the first keyframe.
    """

    X_WC: Poses
    X_WN: Poses
    has_arm: BoolArray
    constraints: list[PoseConstraint]
    sightings: list[Sighting]
    planes: FloatArray
    numbers: IntArray
    settled: Settled | None = None


@dataclass(eq=False)
class Estimate:
    """The graph after optimisation.

    Attributes:
        X_WC: Poses of the keyframes.
        planes: (m, 4), as in `Problem`.
        mount: (6,) step from the nominal camera frame N to C.
        mount_covariance: (6, 6) of it, rad and m squared.
        mount_observed: (6, 6) projection onto its observed directions, in units of its
            prior; along the others it is held at zero.
        base: (n) steps of the base in W at every keyframe, about `middle`.
        middle: (3,) m, in W, middle of the scan.
        constraint_weights: (constraints,) 0 = dropped, 1 = full weight.
        sight_weights: (sightings,) the same.
        observed: (n, 6, 6) information on each keyframe from constraints and planes.
    """

    X_WC: Poses
    planes: FloatArray
    mount: FloatArray
    mount_covariance: FloatArray
    mount_observed: FloatArray
    base: Poses
    middle: FloatArray
    constraint_weights: FloatArray
    sight_weights: FloatArray
    observed: FloatArray = field(repr=False)


class Graph:
    """Optimises one `Problem`."""

    def __init__(self, problem: Problem, config: PoseGraphConfig) -> None:
        """Puts the problem into arrays.

        Args:
            problem: Keyframes, constraints and sightings; not changed.
            config: Sigmas and thresholds.
        """
        self._problem, self._config = problem, config
        self._n, self._m = len(problem.X_WC), len(problem.planes)
        constraints, sights = problem.constraints, problem.sightings
        numbers = problem.numbers
        self._i = np.searchsorted(numbers, [constraint.i for constraint in constraints])
        self._j = np.searchsorted(numbers, [constraint.j for constraint in constraints])
        self._Z = Poses.of([constraint.X_ij for constraint in constraints])
        self._omega = np.array(
            [constraint.information for constraint in constraints]
        ).reshape(-1, 6, 6)
        self._k = np.searchsorted(numbers, [s.k for s in sights])
        self._l = np.array([s.plane for s in sights], dtype=np.int64)
        self._center = np.array([s.sight.center for s in sights]).reshape(-1, 3)
        self._axes = np.array([s.sight.axes for s in sights]).reshape(-1, 3, 2)
        sigma = [[s.sight.sigma, *s.sight.tilt_sigma] for s in sights]
        self._plane_omega = np.array(sigma).reshape(-1, 3) ** -2.0
        self._middle = problem.X_WC.p.mean(axis=0) if self._n else np.zeros(3)
        self._mount_prior = information_of(config.mount_sigma, config.mount_sigma_deg)
        self._mount, self._base = Poses.identity(1), Poses.identity(self._n)
        held = np.zeros(self._n, dtype=np.bool_)
        self._free = np.ones(12 * self._n + 6 + 3 * self._m, dtype=np.bool_)
        if settled := problem.settled:
            held = settled.keyframes
            self._mount = self._mount.moved(settled.mount[None])
            self._base = settled.base.about(self._middle)
            free = ~np.concatenate([held, held, [True]])
            self._free = np.concatenate(
                [np.repeat(free, 6), np.repeat(~settled.planes, 3)]
            )
        self._arm = np.flatnonzero(problem.has_arm & ~held)
        # The first keyframe is the base's reference, and without an arm that of all.
        self._free[6 * self._n : 6 * self._n + 6] = False
        if not len(self._arm):
            self._free[:6] = False

    def optimize(self, quick: bool = False) -> Estimate:
        """Finds the most likely poses, with the mount's error where it is observed.

        A second pass holds the mount at zero along directions whose standard deviation
        the frames did not halve: there the estimate would be noise within the prior.

        Args:
            quick: Fewer rounds and no second pass, while frames come in.

        Returns:
            The estimate; constraints with weights below 0.05 are dropped.
        """
        schedule = _QUICK if quick else _SCHEDULE
        estimate = self._optimize(self._mount_prior, schedule)
        if quick or not len(self._arm):
            return estimate
        prior = self._mount_prior
        sigma = np.diag(prior) ** -0.5
        values, axes = np.linalg.eigh(
            estimate.mount_covariance / np.outer(sigma, sigma)
        )
        kept = axes[:, values < _HALVED]
        held = (np.eye(6) - kept @ kept.T) / np.outer(sigma, sigma)
        estimate = self._optimize(prior + 1e6 * held, schedule)
        return dataclasses.replace(estimate, mount_observed=kept @ kept.T)

    def _optimize(self, mount_prior: FloatArray, schedule: Sequence[float]) -> Estimate:
        problem, n, m = self._problem, self._n, self._m
        X, planes = problem.X_WC, problem.planes.copy()
        mount, base = self._mount, self._base
        constraint_weights = np.ones(len(problem.constraints))
        sight_weights = np.ones(len(problem.sightings))
        for scale in schedule:
            system = NormalEquations(12 * n + 6 + 3 * m)
            constraint_weights = self._add_constraints(system, X, scale)
            sight_weights = self._add_planes(system, X, planes, scale)
            self._add_arm(system, X, mount, base, mount_prior, scale > _LOOSE)
            step, mount_covariance = system.solve(self._free, 12 * n)
            X = X.moved(step[: 6 * n].reshape(n, 6))
            base = base.moved(step[6 * n : 12 * n].reshape(n, 6))
            mount = mount.moved(step[12 * n : 12 * n + 6].reshape(1, 6))
            planes = _turn_planes(
                planes, step[12 * n + 6 :].reshape(m, 3), self._middle
            )
        return Estimate(
            X_WC=X,
            planes=planes,
            mount=Poses.identity(1).steps_to(mount)[0],
            mount_covariance=mount_covariance,
            mount_observed=np.zeros((6, 6)),
            base=base,
            middle=self._middle,
            constraint_weights=np.where(
                constraint_weights < 0.05, 0.0, constraint_weights
            ),
            sight_weights=np.where(sight_weights < 0.05, 0.0, sight_weights),
            observed=self._observed(X, planes, constraint_weights, sight_weights),
        )

    def _add_constraints(
        self, system: NormalEquations, X: Poses, scale: float
    ) -> FloatArray:
        if not len(self._i):
            return np.zeros(0)
        e, Ji, Jj = self._constraint_terms(X)
        chi2 = np.einsum("fi,fij,fj->f", e, self._omega, e)
        weights = (scale / (scale + chi2)) ** 2
        W = self._omega * weights[:, None, None]
        system.add([(6 * self._i, Ji), (6 * self._j, Jj)], e, W)
        return np.asarray(weights)

    def _constraint_terms(self, X: Poses) -> tuple[FloatArray, FloatArray, FloatArray]:
        relative = X[self._i].inverse() @ X[self._j]
        e = self._Z.steps_to(relative)
        Rz_T = np.swapaxes(self._Z.R, 1, 2)
        count = len(e)
        Ji, Jj = np.zeros((count, 6, 6)), np.zeros((count, 6, 6))
        Ji[:, :3, :3] = -np.swapaxes(relative.R, 1, 2)
        Ji[:, 3:, :3] = Rz_T @ skew(relative.p)
        Ji[:, 3:, 3:] = -Rz_T
        Jj[:, :3, :3] = np.eye(3)
        Jj[:, 3:, 3:] = Rz_T @ relative.R
        return e, Ji, Jj

    def _plane_terms(
        self, X: Poses, planes: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Residuals (f, 3): distance to the landmark and two tilts; and Jacobians."""
        R, p = X.R[self._k], X.p[self._k]
        n_W, d = planes[self._l, :3], planes[self._l, 3]
        n_C = np.einsum("fji,fj->fi", R, n_W)
        center_W = np.einsum("fij,fj->fi", R, self._center) + p
        axes_W = R @ self._axes
        count = len(d)
        e = np.empty((count, 3))
        e[:, 0] = np.sum(n_W * center_W, axis=1) - d
        e[:, 1:] = np.einsum("fi,fia->fa", n_W, axes_W)
        J_pose = np.zeros((count, 3, 6))
        J_pose[:, 0, :3] = -np.einsum("fi,fij->fj", n_C, skew(self._center))
        J_pose[:, 0, 3:] = n_C
        for a in range(2):
            turned = skew(self._axes[:, :, a])
            J_pose[:, 1 + a, :3] = -np.einsum("fi,fij->fj", n_C, turned)
        tangent = _tangents(planes)[self._l]
        J_plane = np.zeros((count, 3, 3))
        arm = center_W - self._middle
        J_plane[:, 0, :2] = np.einsum("fi,fia->fa", arm, tangent)
        J_plane[:, 0, 2] = -1.0
        J_plane[:, 1:, :2] = np.einsum("fib,fia->fba", axes_W, tangent)
        return e, J_pose, J_plane

    def _add_planes(
        self, system: NormalEquations, X: Poses, planes: FloatArray, scale: float
    ) -> FloatArray:
        if not len(self._k):
            return np.zeros(0)
        e, J_pose, J_plane = self._plane_terms(X, planes)
        chi2 = np.sum(e**2 * self._plane_omega, axis=1)
        weights = (scale / (scale + chi2)) ** 2
        W = np.zeros((len(e), 3, 3))
        W[:, range(3), range(3)] = self._plane_omega * weights[:, None]
        start = 12 * self._n + 6 + 3 * self._l
        system.add([(6 * self._k, J_pose), (start, J_plane)], e, W)
        return np.asarray(weights)

    def _add_arm(
        self,
        system: NormalEquations,
        X: Poses,
        mount: Poses,
        base: Poses,
        mount_prior: FloatArray,
        loose: bool,
    ) -> None:
        """Adds the priors of arm, mount and base."""
        config, n, k = self._config, self._n, self._arm
        if not len(k):
            return
        # The arm's pose, corrected by mount and base.
        inner = self._problem.X_WN[k] @ mount[np.zeros(len(k), np.int64)]
        about = Poses(inner.R, inner.p - self._middle)
        expected = base[k] @ about
        expected = Poses(expected.R, expected.p + self._middle)
        e = expected.steps_to(X[k])
        ones = np.tile(np.eye(6), (len(k), 1, 1))
        J_base = np.zeros((len(k), 6, 6))
        R_T = np.swapaxes(inner.R, 1, 2)
        J_base[:, :3, :3] = -R_T
        J_base[:, 3:, :3] = R_T @ skew(about.p)
        J_base[:, 3:, 3:] = -R_T
        W = np.tile(
            information_of(config.arm_sigma, config.arm_sigma_deg), (len(k), 1, 1)
        )
        middle = np.full(len(k), 12 * n)
        system.add([(6 * k, ones), (6 * n + 6 * k, J_base), (middle, -ones)], e, W)
        e = Poses.identity(1).steps_to(mount)
        system.add([(np.array([12 * n]), np.eye(6)[None])], e, mount_prior[None])
        if n > 1:
            self._add_walk(system, base, loose)

    def _add_walk(self, system: NormalEquations, base: Poses, loose: bool) -> None:
        n = self._n
        e = base[np.arange(n - 1)].steps_to(base[np.arange(1, n)])
        W = information_of(self._config.base_sigma, self._config.base_sigma_deg)
        chi2 = np.einsum("fi,ij,fj->f", e, W, e)
        # Loose at first, so that a step of the base is found where it happened.
        share = np.full(n - 1, 0.01) if loose else _WALK / (_WALK + chi2)
        weighted = W * share[:, None, None]
        ones = np.tile(np.eye(6), (n - 1, 1, 1))
        start = 6 * n + 6 * np.arange(n - 1)
        system.add([(start, -ones), (start + 6, ones)], e, weighted)

    def _observed(
        self, X: Poses, planes: FloatArray, constraints: FloatArray, sights: FloatArray
    ) -> FloatArray:
        """Sums the information on each keyframe from constraints and planes."""
        result = np.zeros((self._n, 6, 6))
        if len(self._i):
            _, Ji, Jj = self._constraint_terms(X)
            W = self._omega * constraints[:, None, None]
            np.add.at(result, self._i, np.swapaxes(Ji, 1, 2) @ W @ Ji)
            np.add.at(result, self._j, np.swapaxes(Jj, 1, 2) @ W @ Jj)
        if len(self._k):
            _, J, _ = self._plane_terms(X, planes)
            W = self._plane_omega * sights[:, None]
            np.add.at(result, self._k, np.swapaxes(J, 1, 2) @ (J * W[:, :, None]))
        return result


def _tangents(planes: FloatArray) -> FloatArray:
    """Returns (m, 3, 2) unit vectors perpendicular to the normals."""
    n = planes[:, :3]
    other = np.eye(3)[np.argmin(np.abs(n), axis=1)]
    first = np.cross(n, other)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(n, first)], axis=2)


def _turn_planes(
    planes: FloatArray, steps: FloatArray, middle: FloatArray
) -> FloatArray:
    """Turns planes about the projection of `middle` and shifts them along normals."""
    if not len(planes):
        return planes
    n = planes[:, :3] + np.einsum("mia,ma->mi", _tangents(planes), steps[:, :2])
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    height = planes[:, 3] - planes[:, :3] @ middle + steps[:, 2]
    return np.column_stack([n, height + n @ middle])
