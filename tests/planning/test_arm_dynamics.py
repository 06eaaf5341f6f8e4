"""Torques in closed form against virtual work on single masses, and a pendulum."""

import numpy as np
import pytest

from painter.planning.arm_dynamics import ArmDynamics

GRAVITY = 9.81
AXES = np.array([[0, 0, 1], [0, 1, 0], [0, 1, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
# Of nothing in particular: neither the yaws' axes nor the pitches' are in one line.
P_WJS = np.array(
    [
        [0.05, -0.02, 0.0],
        [0.1, 0.03, 1.2],
        [0.8, 0.0, 1.25],
        [1.5, -0.04, 1.2],
        [1.54, 0.02, 1.3],
    ]
)
NO_FRICTION = {"damping": np.zeros(5), "rotor": np.zeros(5)}


def turned(angle, axis, point, p_WQ):
    """A point after a turn about an axis, by Rodrigues' formula."""
    out = p_WQ - point
    return (
        point
        + np.cos(angle) * out
        + np.sin(angle) * np.cross(axis, out)
        + (1.0 - np.cos(angle)) * axis * (axis @ out)
    )


def place(q, link, p_WQ):
    """Where a link's point is that is at `p_WQ` while all joints are at 0."""
    for joint in range(link, -1, -1):
        p_WQ = turned(q[joint], AXES[joint], P_WJS[joint], p_WQ)
    return p_WQ


def with_one(p_WQ):
    return np.append(p_WQ, 1.0)


def dynamics_of(masses, **fields):
    """Of single masses (link, kg, place in W while all joints are at 0)."""
    inertias = np.zeros((5, 4, 4))
    for link, mass, p_WQ in masses:
        inertias[link] += mass * np.outer(with_one(p_WQ), with_one(p_WQ))
    return ArmDynamics.of_links(
        P_WJS, list(inertias), gravity=GRAVITY, **(NO_FRICTION | fields)
    )


@pytest.mark.parametrize("link", range(5))
def test_torques_do_the_work_that_moves_each_mass(link):
    rng = np.random.default_rng(link)
    masses = [(link, mass, rng.normal(size=3)) for mass in (2.0, 0.7)]
    q, v, a = rng.uniform(-2.0, 2.0, (3, 5))
    h = 1e-4  # s and rad; central differences are then good to about 1e-7.
    expected = np.zeros(5)
    for _, mass, p_WQ in masses:
        before, at, after = (
            place(q + t * v + t**2 / 2.0 * a, link, p_WQ) for t in (-h, 0.0, h)
        )
        force = mass * ((after - 2.0 * at + before) / h**2 + [0.0, 0.0, GRAVITY])
        for joint, step in enumerate(h * np.eye(5)):
            moved = place(q + step, link, p_WQ) - place(q - step, link, p_WQ)
            expected[joint] += force @ moved / (2.0 * h)
    torques = dynamics_of(masses).torques(q[None], v[None], a[None])[0]
    np.testing.assert_allclose(torques, expected, atol=1e-5)


def test_a_level_arm_at_rest_carries_weight_times_lever():
    lever = 0.6
    dut = dynamics_of([(1, 3.0, P_WJS[1] + [lever, 0.0, 0.0])])
    torques = dut.torques(*np.zeros((3, 1, 5)))
    # Gravity turns the mass downwards, a positive pitch; the drive holds against it.
    expected = [[0.0, -3.0 * GRAVITY * lever, 0.0, 0.0, 0.0]]
    np.testing.assert_allclose(torques, expected, atol=1e-12)


def test_rotors_and_friction_act_at_their_own_joint():
    damping, rotor = np.arange(1.0, 6.0), np.arange(6.0, 11.0)
    dut = dynamics_of([], damping=damping, rotor=rotor)
    q, v, a = np.random.default_rng(0).normal(size=(3, 4, 5))
    np.testing.assert_allclose(dut.torques(q, v, a), damping * v + rotor * a)


def test_a_body_turns_as_its_pendulum_does():
    """A rod from the elbow: the physical pendulum's m L²/3 about its end."""
    length, mass = 0.8, 1.5
    along = np.array([1.0, 0.0, 0.0])
    inertia = np.zeros((4, 4))
    # ∫ p p' of a uniform rod: that of its middle, and m L²/12 along it.
    inertia += mass * np.outer(*2 * [with_one(P_WJS[2] + length / 2.0 * along)])
    inertia[0, 0] += mass * length**2 / 12.0
    inertias = [np.zeros((4, 4)) for _ in range(5)]
    inertias[2] = inertia
    dut = ArmDynamics.of_links(P_WJS, inertias, gravity=GRAVITY, **NO_FRICTION)
    pitch, change = 0.4, 2.0
    q, a = np.zeros((2, 1, 5))
    q[0, 2], a[0, 2] = pitch, change
    torque = dut.torques(q, np.zeros((1, 5)), a)[0, 2]
    weight = mass * GRAVITY * length / 2.0 * np.cos(pitch)
    assert torque == pytest.approx(mass * length**2 / 3.0 * change - weight, abs=1e-12)
