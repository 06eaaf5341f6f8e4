import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw

from perception.mapping.config import MapperConfig
from perception.mapping.keyframes.keyframe import PlaneSight
from perception.mapping.pose_graph.constraints import ConstraintKind, PoseConstraint
from perception.mapping.pose_graph.graph import Graph, Problem, Settled, Sighting
from perception.mapping.pose_graph.observability import observed_directions
from perception.mapping.pose_graph.poses import Poses

CONFIG = MapperConfig()
COUNT = 20
INFORMATION = np.diag([0.0002**-2.0] * 3 + [0.0002**-2.0] * 3)


def true_poses():
    """Along a wall, the camera swaying by a few degrees."""
    rng = np.random.default_rng(5)
    turns = 0.05 * rng.standard_normal((COUNT, 3))
    return [
        RigidTransform(RollPitchYaw(*turn), [0.1 * k, 0.3 * (k % 2), 0.0])
        for k, turn in enumerate(turns)
    ]


def exact_constraints(poses, steps=(1, 2, 3)):
    return [
        PoseConstraint(
            i,
            i + d,
            ConstraintKind.APPEARANCE,
            poses[i].inverse() @ poses[i + d],
            INFORMATION,
            100,
        )
        for d in steps
        for i in range(COUNT - d)
    ]


def problem_of(start, arm, constraints, sightings=(), planes=()):
    known = arm is not None
    return Problem(
        X_WC=Poses.of(start),
        X_WN=Poses.of(arm if known else start),
        has_arm=np.full(COUNT, known),
        constraints=list(constraints),
        sightings=list(sightings),
        planes=np.array(planes, dtype=float).reshape(-1, 4),
        numbers=np.arange(COUNT),
    )


def distances(found, truth):
    return np.linalg.norm(found.p - np.array([X.translation() for X in truth]), axis=1)


def sight_of(X_WC, normal_W, offset):
    """The plane as a perfect camera would see it, straight ahead."""
    normal = X_WC.rotation().inverse() @ normal_W
    away = offset - normal_W @ X_WC.translation()
    axes = np.linalg.svd(normal[None])[2][1:].T
    return PlaneSight(away * normal, normal, axes, 0.0003, np.full(2, 3e-4), 1.0)


def test_exact_links_lead_from_a_bad_start_to_the_truth():
    truth = true_poses()
    rng = np.random.default_rng(1)
    bad = Poses.of(truth).moved(0.01 * rng.standard_normal((COUNT, 6)))
    start = [truth[0], *bad.list()[1:]]
    estimate = Graph(
        problem_of(start, None, exact_constraints(truth)), CONFIG
    ).optimize()
    assert distances(estimate.X_WC, truth).max() < 1e-6


def test_wrong_links_are_dropped_one_by_one():
    truth = true_poses()
    constraints = exact_constraints(truth)
    rng = np.random.default_rng(2)
    wrong = rng.choice(len(constraints), len(constraints) // 10, replace=False)
    for index in wrong:
        step = RigidTransform(RollPitchYaw(0.0, 0.03, 0.02), [0.03, -0.02, 0.01])
        constraints[index] = constraints[index].replace(
            X_ij=constraints[index].X_ij @ step
        )
    estimate = Graph(problem_of(truth, None, constraints), CONFIG).optimize()
    assert set(np.flatnonzero(estimate.constraint_weights == 0.0)) == set(wrong)
    assert distances(estimate.X_WC, truth).max() < 1e-4


def test_a_shift_of_the_base_is_found_by_links():
    truth = true_poses()
    X_shift = RigidTransform([0.003, -0.002, 0.004])
    arm = list(truth)
    arm[COUNT // 2 :] = [X_shift.inverse() @ X for X in arm[COUNT // 2 :]]
    estimate = Graph(problem_of(arm, arm, exact_constraints(truth)), CONFIG).optimize()
    moved = estimate.base.p[-1] - estimate.base.p[0]
    np.testing.assert_allclose(moved, X_shift.translation(), atol=1e-3)
    away = [X.inverse() @ Y for X, Y in zip(estimate.X_WC.list(), truth, strict=True)]
    # Of 5.4 mm; the constraints' own 0.2 mm share what is left at the step.
    assert np.ptp([X.translation() for X in away], axis=0).max() < 1e-3


def test_the_mounts_rotation_is_found_and_its_translation_held():
    truth = true_poses()
    X_mount = RigidTransform(RollPitchYaw(0.002, -0.003, 0.004), [0.0, 0.0, 0.0])
    arm = [X @ X_mount.inverse() for X in truth]
    estimate = Graph(problem_of(arm, arm, exact_constraints(truth)), CONFIG).optimize()
    turn = Poses.identity(1).steps_to(Poses.of([X_mount]))[0, :3]
    # The path's 2 m and the arm's 1 mm give 0.03 deg across it, less about it.
    np.testing.assert_allclose(estimate.mount[1:3], turn[1:], atol=1e-3)
    # The camera hardly turns: nothing tells where on the arm it sits.
    np.testing.assert_allclose(estimate.mount[3:], 0.0, atol=5e-4)


def test_a_plane_corrects_distance_and_tilt_alone():
    truth = true_poses()
    normal, offset = np.array([0.0, 0.0, -1.0]), -0.7
    rng = np.random.default_rng(3)
    arm = Poses.of(truth).moved(0.0005 * rng.standard_normal((COUNT, 6))).list()
    sightings = [
        Sighting(k, 0, sight_of(X, normal, offset)) for k, X in enumerate(truth)
    ]
    problem = problem_of(arm, arm, [], sightings, [[*normal, offset]])
    estimate = Graph(problem, CONFIG).optimize()
    for k, X_WC in enumerate(estimate.X_WC.list()):
        seen = X_WC.rotation().inverse() @ estimate.planes[0, :3]
        true = truth[k].rotation().inverse() @ normal
        assert np.degrees(np.arccos(min(1.0, seen @ true))) < 0.02
        away = estimate.planes[0, 3] - estimate.planes[0, :3] @ X_WC.translation()
        assert away == pytest.approx(-0.7 - normal @ truth[k].translation(), abs=2e-4)
    projection = observed_directions(estimate.observed[0], CONFIG)
    R_WC = estimate.X_WC.list()[0].rotation().matrix()
    in_world = R_WC @ projection[3:, 3:] @ R_WC.T
    np.testing.assert_allclose(in_world, np.diag([0, 0, 1]), atol=0.02)
    in_world = R_WC @ projection[:3, :3] @ R_WC.T
    np.testing.assert_allclose(in_world, np.diag([1, 1, 0]), atol=0.02)


def test_what_is_settled_is_held_and_the_rest_moves_to_the_truth():
    truth = true_poses()
    normal, offset = np.array([0.0, 0.0, -1.0]), -0.7
    X_shift = Poses.of([RigidTransform(RollPitchYaw(0.0, 0.0, 0.01), [0.003, 0, 0])])
    X_mount = RigidTransform(RollPitchYaw(0.002, -0.003, 0.0), [0.0, 0.0, 0.0])
    shifts = Poses.identity(COUNT).with_rows(
        np.arange(3, COUNT), X_shift[np.zeros(COUNT - 3, np.int64)]
    )
    mounts = Poses.of([X_mount] * COUNT)
    arm = (shifts.inverse() @ Poses.of(truth) @ mounts.inverse()).list()
    # The first third is settled, with the step of the base at the fourth keyframe; of
    # the others nothing is known but arm and plane.
    held = np.arange(COUNT) < COUNT // 3
    rng = np.random.default_rng(4)
    moved = Poses.of(truth).moved(0.002 * rng.standard_normal((COUNT, 6))).list()
    start = [X if fixed else Y for X, Y, fixed in zip(truth, moved, held, strict=True)]
    sightings = [
        Sighting(k, 0, sight_of(X, normal, offset)) for k, X in enumerate(truth)
    ]
    problem = problem_of(start, arm, [], sightings, [[*normal, offset]])
    mount = Poses.identity(1).steps_to(mounts[:1])[0]
    problem.settled = Settled(held, np.array([True]), mount, shifts)
    estimate = Graph(problem, CONFIG).optimize(quick=True)
    np.testing.assert_array_equal(estimate.X_WC.p[held], problem.X_WC.p[held])
    np.testing.assert_array_equal(estimate.planes, problem.planes)
    np.testing.assert_allclose(estimate.mount, mount, atol=1e-12)
    # Mount and base are known up to there: that puts right all that the arm says.
    assert distances(estimate.X_WC, truth).max() < 1e-6
