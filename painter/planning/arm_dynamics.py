"""Torques of the five-joint arm in closed form, for many states at once.

Beside the base yaw every point of the arm moves as sums of cosines and sines of a few
sums of joint angles: of the three pitches, and of the last of them plus and minus the
wrist yaw. So of all mass three constant matrices are left, which stay the same in every
state, and the torques of many states are a few products of matrices.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from perception.values import FloatArray, FrozenValue

# The angles whose cosines and sines occur, as sums of joint angles.
_SUMS = np.array(
    [
        [0.0, 1.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 1.0, 0.0, 0.0],
        [0.0, 1.0, 1.0, 1.0, 0.0],
        [0.0, 1.0, 1.0, 1.0, 1.0],
        [0.0, 1.0, 1.0, 1.0, -1.0],
        [0.0, 0.0, 0.0, 0.0, 1.0],
    ]
)
# Waves: 1, then these cosines, then these sines.
_COSINES = slice(1, 1 + len(_SUMS))
_SINES = slice(1 + len(_SUMS), 1 + 2 * len(_SUMS))
_WAVES = 1 + 2 * len(_SUMS)


@dataclass(frozen=True, eq=False)
class ArmDynamics(FrozenValue):
    """Inverse dynamics of an arm with the axes that `ArmKinematics` describes.

    With r = x, y and z of the mass, each a sum of waves, in a frame that turns with the
    base yaw, and ∫ over all mass:

    Attributes:
        across: (13, 13) kg m², ∫ x x' + y y'.
        skew: (13, 13) kg m², ∫ x y' - y x'.
        upright: (13, 13) kg m², ∫ z z'.
        weight: (13,) N m, gravity times ∫ z.
        damping: (5,) N m s/rad, viscous friction.
        rotor: (5,) kg m², inertia of the rotors at the joints.
    """

    across: FloatArray
    skew: FloatArray
    upright: FloatArray
    weight: FloatArray
    damping: FloatArray
    rotor: FloatArray

    @classmethod
    def of_links(
        cls,
        p_WJs: FloatArray,
        inertias: Sequence[FloatArray],
        *,
        gravity: float,
        damping: FloatArray,
        rotor: FloatArray,
    ) -> "ArmDynamics":
        """Makes them of links as they are in W while all joints are at 0.

        Then the axes of both yaws are along z and those of the pitches along y.

        Args:
            p_WJs: (5, 3) m, a point on the axis of each joint.
            inertias: (4, 4) of the link after each joint: ∫ p p' over its mass, where p
                is a point in W with a 1 appended, kg and m.
            gravity: m/s², along -z.
            damping: (5,) N m s/rad.
            rotor: (5,) kg m².
        """
        second = np.zeros((3, _WAVES, 3, _WAVES))
        first = np.zeros((3, _WAVES))
        for place, inertia in zip(_places(p_WJs), inertias, strict=True):
            second += np.einsum("acf,cd,bdg->afbg", place, inertia, place)
            first += np.einsum("acf,c->af", place, inertia[:, 3])
        (xx, xy, _), (yx, yy, _), (_, _, zz) = second.transpose(0, 2, 1, 3)
        return cls(
            across=xx + yy,
            skew=xy - yx,
            upright=zz,
            weight=gravity * first[2],
            damping=damping,
            rotor=rotor,
        )

    def torques(self, q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
        """Returns what a motion takes of the joints; see `TorqueModel`.

        By virtual work: of a joint it is ∫ (∂r/∂q)·(acceleration - gravity), and seen
        from the turning frame the acceleration has the terms of Euler, Coriolis and the
        centrifugal one. Source: Paul, Robot Manipulators, 1981, chapter 6, from where
        also the form of the inertias is.

        Args:
            q: (n, 5) rad.
            v: (n, 5) rad/s.
            a: (n, 5) rad/s².

        Returns:
            (n, 5) N m.
        """
        angle, rate, change = (_SUMS @ x.T for x in (q, v, a))
        cosine, sine = np.cos(angle), np.sin(angle)
        one = np.ones((1, len(q)))
        none = np.zeros_like(one)
        waves = np.concatenate([one, cosine, sine])
        rates = np.concatenate([none, -sine * rate, cosine * rate])
        square = rate**2
        changes = np.concatenate(
            [none, -sine * change - cosine * square, cosine * change - sine * square]
        )
        swept = changes - v[:, 0] ** 2 * waves
        turned = 2.0 * v[:, 0] * rates + a[:, 0] * waves
        force = self.across @ swept - self.skew @ turned + self.upright @ changes
        force += self.weight[:, None]
        torques = (cosine * force[_SINES] - sine * force[_COSINES]).T @ _SUMS
        about = self.skew @ swept + self.across @ turned
        torques[:, 0] = (waves * about).sum(axis=0)
        return np.asarray(torques + self.damping * v + self.rotor * a)


def _places(p_WJs: FloatArray) -> list[FloatArray]:
    """Returns where each link takes a point, in waves.

    Args:
        p_WJs: (5, 3) m, a point on the axis of each joint.

    Returns:
        (3, 4, 13) each, for a point in W with a 1 appended while all joints are at 0;
        the result is in W turned with the base yaw.
    """
    base = np.zeros((3, 3, _WAVES))
    base[..., 0] = np.eye(3)
    turn, shift = base, np.zeros((3, _WAVES))
    shift[:2, 0] = -p_WJs[0, :2]  # The turning frame's origin is on the yaw's axis.
    places = [np.concatenate([turn, shift[:, None]], axis=1)]
    turns = [_pitched(0), _pitched(1), _pitched(2), _twisted()]
    for p_WJ, following in zip(p_WJs[1:], turns, strict=True):
        # The joint itself is where the link before takes it.
        shift = shift + np.einsum("acf,c->af", turn - following, p_WJ)
        turn = following
        places.append(np.concatenate([turn, shift[:, None]], axis=1))
    return places


def _pitched(number: int) -> FloatArray:
    """Returns the turn about y by one of the `_SUMS`, (3, 3, 13)."""
    cosine, sine = np.eye(_WAVES)[_COSINES][number], np.eye(_WAVES)[_SINES][number]
    turn = np.zeros((3, 3, _WAVES))
    turn[1, 1, 0] = 1.0
    turn[0, 0] = turn[2, 2] = cosine
    turn[0, 2], turn[2, 0] = sine, -sine
    return turn


def _twisted() -> FloatArray:
    """Returns the turn by all three pitches after that by the wrist yaw, (3, 3, 13)."""
    cosines, sines = np.eye(_WAVES)[_COSINES], np.eye(_WAVES)[_SINES]
    _, _, pitch, plus, minus, yaw = range(len(_SUMS))
    return np.array(
        [
            # cos cos, -cos sin, sin
            [
                (cosines[plus] + cosines[minus]) / 2.0,
                (sines[minus] - sines[plus]) / 2.0,
                sines[pitch],
            ],
            [sines[yaw], cosines[yaw], np.zeros(_WAVES)],
            # -sin cos, sin sin, cos
            [
                -(sines[plus] + sines[minus]) / 2.0,
                (cosines[minus] - cosines[plus]) / 2.0,
                cosines[pitch],
            ],
        ]
    )
