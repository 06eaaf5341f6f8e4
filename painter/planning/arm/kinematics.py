"""Closed-form kinematics of the five-joint arm, vectorised over poses.

The arm has a yaw at the base, pitches at shoulder, elbow and wrist, and a yaw at the
wrist, with pitch and yaw of the wrist in one point (the wrist centre, origin of L).
Pitches add up, so that R_WL = Rz(q1) Ry(q2 + q3 + q4) Rz(q5), and both the gun G and
the camera C look along L x. A target is a point and the direction of that axis: with
five joints the roll about it cannot be chosen.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform

from perception.ground import BoolArray, FloatArray, FrozenValue

NQ = 5  # Joints of the arm.
# Axes of L in T where the tool is square to the wall: L x points into it, L z up.
SQUARE_R_TL = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]])
SQUARE_R_TL.flags.writeable = False
# Largest error of X_LG and X_LC against the form that the closed-form inverse needs.
_MOUNT_TOLERANCE = 1e-9

JOINT_NAMES = ("base yaw", "shoulder pitch", "elbow pitch", "wrist pitch", "wrist yaw")

# Joint torques (n, 5), N m, for positions, velocities and accelerations, each (n, 5),
# rad and s.
TorqueModel = Callable[[FloatArray, FloatArray, FloatArray], FloatArray]
# Nozzle (n, 3) in W, m, at joint angles (n, 5), rad.
NozzleModel = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True, eq=False)
class ArmLimits(FrozenValue):
    """Joint limits, base yaw first.

    Attributes:
        q_min: (5,) rad, lowest position.
        q_max: (5,) rad, highest position.
        v_max: (5,) rad/s.
        a_max: (5,) rad/s².
        effort_max: (5,) N m at the joint.
        torques: Joint torques of a motion; None = not checked.
        nozzle_speed: Highest speed of the nozzle in W, m/s.
        nozzle: Position of the nozzle; None = its speed is not checked.
    """

    q_min: FloatArray
    q_max: FloatArray
    v_max: FloatArray
    a_max: FloatArray
    effort_max: FloatArray
    torques: TorqueModel | None = None
    nozzle_speed: float = np.inf
    nozzle: NozzleModel | None = None

    def contains(self, q: FloatArray) -> BoolArray:
        """Returns which rows of `q` (n, 5), rad, are finite and within the limits."""
        with np.errstate(invalid="ignore"):
            inside: BoolArray = np.all((q >= self.q_min) & (q <= self.q_max), axis=-1)
        return inside


@dataclass(frozen=True, eq=False)
class ArmKinematics(FrozenValue):
    """Forward and inverse kinematics in W, whose origin is under the base axis.

    Attributes:
        shoulder_height: Height of the shoulder axis over the floor, m.
        upper_arm: Shoulder axis to elbow axis, m.
        forearm: Elbow axis to wrist centre, m.
        X_LG: Gun nozzle in L; its z axis is L x and its origin in the plane L y = 0.
        X_LC: Depth camera in L; the same holds for it.

    Raises:
        ValueError: A length is not > 0, or a mount is not of the form above.
    """

    shoulder_height: float
    upper_arm: float
    forearm: float
    X_LG: RigidTransform
    X_LC: RigidTransform

    def __post_init__(self) -> None:
        """Checks the lengths and the two mounts."""
        super().__post_init__()
        for name in ("shoulder_height", "upper_arm", "forearm"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} must be > 0 m, got {getattr(self, name)!r}.")
        for name in ("X_LG", "X_LC"):
            X_LF = getattr(self, name)
            axis_error = np.abs(X_LF.rotation().col(2) - [1.0, 0.0, 0.0]).max()
            lateral = abs(X_LF.translation()[1])
            if axis_error > _MOUNT_TOLERANCE or lateral > _MOUNT_TOLERANCE:
                raise ValueError(
                    f"{name} must have its z axis along L x and its origin at L y = 0, "
                    f"got an axis off by {axis_error:.2g} and L y = {lateral:.2g} m."
                )

    @property
    def reach(self) -> float:
        """Distance of the nozzle from the shoulder axis, arm stretched out, m."""
        return float(self.upper_arm + self.forearm + self.X_LG.translation()[0])

    def forward(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Poses of the last link.

        Args:
            q: (n, 5) rad.

        Returns:
            R_WL: (n, 3, 3), and p_WL: (n, 3) m, the wrist centre.
        """
        q = np.asarray(q, dtype=float)
        _, _, p_WL = self._joint_points(q)
        yaw, pitch, wrist_yaw = q[:, 0], q[:, 1:4].sum(axis=1), q[:, 4]
        c1, s1 = np.cos(yaw), np.sin(yaw)
        cp, sp = np.cos(pitch), np.sin(pitch)
        c5, s5 = np.cos(wrist_yaw), np.sin(wrist_yaw)
        R_WL = np.empty((len(q), 3, 3))
        R_WL[:, 0, 0] = c1 * cp * c5 - s1 * s5
        R_WL[:, 0, 1] = -c1 * cp * s5 - s1 * c5
        R_WL[:, 0, 2] = c1 * sp
        R_WL[:, 1, 0] = s1 * cp * c5 + c1 * s5
        R_WL[:, 1, 1] = -s1 * cp * s5 + c1 * c5
        R_WL[:, 1, 2] = s1 * sp
        R_WL[:, 2, 0] = -sp * c5
        R_WL[:, 2, 1] = sp * s5
        R_WL[:, 2, 2] = cp
        return R_WL, p_WL

    def gun_poses(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Returns R_WG (n, 3, 3) and p_WG (n, 3), m, for `q` (n, 5), rad."""
        return self._poses(q, self.X_LG)

    def nozzle(self, q: FloatArray) -> FloatArray:
        """Returns p_WG (n, 3), m, for `q` (n, 5), rad."""
        return self._points(q, self.X_LG)

    def spray_axis(self, q: FloatArray) -> FloatArray:
        """Returns the nozzle's z axis in W (n, 3), unit, for `q` (n, 5), rad."""
        cosine, sine = np.cos(q), np.sin(q)
        pitch = q[:, 1:4].sum(axis=1)
        ahead = np.cos(pitch) * cosine[:, 4]
        return np.stack(
            [
                cosine[:, 0] * ahead - sine[:, 0] * sine[:, 4],
                sine[:, 0] * ahead + cosine[:, 0] * sine[:, 4],
                -np.sin(pitch) * cosine[:, 4],
            ],
            axis=-1,
        )

    def camera_poses(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Returns R_WC (n, 3, 3) and p_WC (n, 3), m, for `q` (n, 5), rad."""
        return self._poses(q, self.X_LC)

    def solve(
        self, p_WG: FloatArray, axis_W: FloatArray, *, elbow: int = 1, shoulder: int = 1
    ) -> FloatArray:
        """Joint positions that bring the nozzle to a point with a given spray axis.

        Args:
            p_WG: (n, 3) m, nozzle in W.
            axis_W: (n, 3) or (3,), unit, spray axis (G z) in W.
            elbow: +1 for q3 >= 0 (the elbow above the line from shoulder to wrist, for
                an arm that faces its work), -1 for q3 <= 0.
            shoulder: +1 turns the base towards the wrist, -1 away from it (the arm
                reaches over backwards).

        Returns:
            (n, 5) rad, in (-pi, pi], wrist yaw within +-pi/2; rows of NaN where the
            point is out of reach. Joint limits are not checked.
        """
        return self._solve(p_WG, axis_W, self.X_LG, elbow, shoulder)

    def solve_camera(
        self, p_WC: FloatArray, axis_W: FloatArray, *, elbow: int = 1, shoulder: int = 1
    ) -> FloatArray:
        """The same as `solve` for the depth camera, by its origin and viewing axis."""
        return self._solve(p_WC, axis_W, self.X_LC, elbow, shoulder)

    def travel(self, q: FloatArray) -> FloatArray:
        """Returns the longest way of elbow, wrist, nozzle and camera from row to row.

        No point of a straight link moves farther than the farther moving one of its
        ends, since it is the same weighted mean of both before and after.

        Args:
            q: (n, 5) rad.

        Returns:
            (n - 1,) m, straight from one place to the next.
        """
        _, p_WE, p_WL = self._joint_points(q)
        p_WG, p_WC = self._points(q, self.X_LG), self._points(q, self.X_LC)
        moved = np.diff(np.stack([p_WE, p_WL, p_WG, p_WC]), axis=1)
        return np.asarray(np.sqrt((moved**2).sum(axis=2)).max(axis=0))

    def _joint_points(self, q: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Shoulder, elbow and wrist centre in W, each (n, 3)."""
        ahead = np.stack([np.cos(q[:, 0]), np.sin(q[:, 0]), np.zeros(len(q))], axis=-1)
        up = np.array([0.0, 0.0, 1.0])

        def along(pitch: FloatArray) -> FloatArray:
            direction: FloatArray = (
                np.cos(pitch)[:, None] * ahead - np.sin(pitch)[:, None] * up
            )
            return direction

        p_WS = np.broadcast_to(self.shoulder_height * up, ahead.shape)
        p_WE = p_WS + self.upper_arm * along(q[:, 1])
        p_WL = p_WE + self.forearm * along(q[:, 1] + q[:, 2])
        return p_WS, p_WE, p_WL

    def _points(self, q: FloatArray, X_LF: RigidTransform) -> FloatArray:
        """Returns the origin p_WF (n, 3) of a mount, m, for `q` (n, 5), rad."""
        ahead, _, above = X_LF.translation()
        bend = np.cumsum(q[:, 1:4], axis=1)
        cosine, sine = np.cos(bend), np.sin(bend)
        c1, s1 = np.cos(q[:, 0]), np.sin(q[:, 0])
        out = ahead * np.cos(q[:, 4])
        a, b = self.upper_arm, self.forearm
        # In the arm's plane, ahead of the base axis and up, and square to it.
        x = a * cosine[:, 0] + b * cosine[:, 1] + out * cosine[:, 2]
        x += above * sine[:, 2]
        z = self.shoulder_height + above * cosine[:, 2] - out * sine[:, 2]
        z -= a * sine[:, 0] + b * sine[:, 1]
        y = ahead * np.sin(q[:, 4])
        return np.stack([c1 * x - s1 * y, s1 * x + c1 * y, z], axis=-1)

    def _poses(
        self, q: FloatArray, X_LF: RigidTransform
    ) -> tuple[FloatArray, FloatArray]:
        R_WL, p_WL = self.forward(q)
        return R_WL @ X_LF.rotation().matrix(), p_WL + R_WL @ X_LF.translation()

    def _solve(
        self,
        p_WF: FloatArray,
        axis_W: FloatArray,
        X_LF: RigidTransform,
        elbow: int,
        shoulder: int,
    ) -> FloatArray:
        for name, sign in (("elbow", elbow), ("shoulder", shoulder)):
            if sign not in (-1, 1):
                raise ValueError(f"{name} must be +1 or -1, got {sign!r}.")
        p_WF = np.atleast_2d(np.asarray(p_WF, dtype=float))
        axis_W = np.asarray(axis_W, dtype=float)
        across_x, across_y, up = axis_W.T
        ahead, _, above = X_LF.translation()

        # L z lies in the vertical plane of the arm, so going back along L x is enough
        # to find that plane, and with it the base yaw.
        x_WA, y_WA, z_WA = (p_WF - ahead * axis_W).T
        yaw = np.arctan2(shoulder * y_WA, shoulder * x_WA)
        c1, s1 = np.cos(yaw), np.sin(yaw)
        axis_x = c1 * across_x + s1 * across_y
        axis_y = c1 * across_y - s1 * across_x
        pitch = np.arctan2(-up, axis_x)
        wrist_yaw = np.arctan2(axis_y, np.hypot(axis_x, up))

        # Wrist centre in the arm's plane: x ahead of the shoulder, z above it.
        x = c1 * x_WA + s1 * y_WA - above * np.sin(pitch)
        z = z_WA - self.shoulder_height - above * np.cos(pitch)
        distance_squared = x**2 + z**2
        a, b = self.upper_arm, self.forearm
        cos_elbow = (distance_squared - a**2 - b**2) / (2.0 * a * b)
        with np.errstate(invalid="ignore"):
            q3 = elbow * np.arccos(np.where(np.abs(cos_elbow) <= 1, cos_elbow, np.nan))
        # Law of sines and cosines in one: the forearm seen from the upper arm's axis.
        q2 = np.arctan2(-z, x) - np.arctan2(b * np.sin(q3), a + b * np.cos(q3))
        q = np.empty((len(yaw), 5))
        q[:, 0], q[:, 1], q[:, 2] = yaw, q2, q3
        q[:, 3], q[:, 4] = pitch - q2 - q3, wrist_yaw
        # All that is not finite shows in the elbow.
        unreached = np.isnan(q3)
        if unreached.any():
            q[unreached] = np.nan
        below = np.pi - q
        around = (below < 0.0) | (below >= 2.0 * np.pi)
        # Few angles need it, and the remainder of all would take long.
        if around.any():
            below[around] = np.mod(below[around], 2.0 * np.pi)
        wrapped: FloatArray = np.pi - below
        return wrapped
