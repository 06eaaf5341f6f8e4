"""A dense check of a finished motion, independent of how it was planned."""

import numpy as np
from pydrake.math import RigidTransform

from painter.errors import MotionLimitError
from painter.planning.arm.kinematics import JOINT_NAMES, ArmKinematics, ArmLimits
from painter.planning.clearance.obstacles import ClearSpace
from painter.planning.motion.surface_frame import SurfaceFrame
from painter.planning.spray_path import Motion, PaintProgram
from perception.ground import FloatArray, IntArray

_STEP = 0.002  # s, of the resampled motion.
_SPEED_TOLERANCE = 0.02  # Share of the stroke's speed.
_STANDOFF_TOLERANCE = 0.002  # m
_PLACE_TOLERANCE = 0.002  # m, nozzle off the stroke's line and ends.
_ANGLE_TOLERANCE_DEG = 0.5  # Spray axis from the wall's normal.
_POSITION_TOLERANCE = 1e-3  # rad; a measured start may lie slightly outside.
# Share of the planned limits: the spline through the samples overshoots the plan a
# little between them.
_RATE_TOLERANCE = 1.05
_CLEARANCE_TOLERANCE = 0.001  # m
_TORQUE_STEP = 0.02  # s, between the samples checked for torque.
_CLEARANCE_STEP = 0.03  # m of arm travel between clearance checks.


def verify_motion(
    motion: Motion,
    *,
    kinematics: ArmKinematics,
    limits: ArmLimits,
    limit_share: float,
    space: ClearSpace,
    what: str,
) -> None:
    """Checks the joints' and the nozzle's limits and clearance all along a motion.

    Args:
        motion: As it will be executed.
        kinematics: Of the arm.
        limits: Of the joints and the nozzle.
        limit_share: Share of their velocities, accelerations and torques that plans
            may use.
        space: What the arm keeps clear of.
        what: Name of the motion, for messages.

    Raises:
        MotionLimitError: A joint leaves its position, velocity, acceleration or torque
            limit, or the nozzle exceeds its speed; names joint, time, value and bound.
        CollisionError: The arm comes nearer than its clearance; names bodies and time.
    """
    share = limit_share * _RATE_TOLERANCE
    time, q, v, a = _extremes(motion)
    middle = (limits.q_min + limits.q_max) / 2.0
    half_range = (limits.q_max - limits.q_min) / 2.0 + _POSITION_TOLERANCE
    for name, unit, values, bounds in (
        ("position from mid-range", "rad", q - middle, half_range),
        ("velocity", "rad/s", v, share * limits.v_max),
        ("acceleration", "rad/s²", a, share * limits.a_max),
    ):
        _require_within(f"{what}: {name}", unit, time, values, bounds)
    if limits.torques is not None:
        _, few = np.unique(np.floor(time / _TORQUE_STEP), return_index=True)
        torques = limits.torques(q[few], v[few], a[few])
        bounds = share * limits.effort_max
        _require_within(f"{what}: torque", "N m", time[few], torques, bounds)
    if limits.nozzle is not None:
        # Between neighbouring samples; the tolerance covers what lies in between.
        gaps = np.linalg.norm(np.diff(limits.nozzle(motion.q), axis=0), axis=1)
        speed = gaps / np.diff(motion.time)
        bound = share * limits.nozzle_speed
        _require_within(f"{what}: nozzle speed", "m/s", motion.time, speed, bound)
    # Plans check other samples than these.
    sampled = _spread(motion.q, kinematics)
    space.require(
        motion.q[sampled], motion.time[sampled], what=what, slack=_CLEARANCE_TOLERANCE
    )


def verify_strokes(
    program: PaintProgram,
    *,
    kinematics: ArmKinematics,
    valve_delay: float,
    surface: SurfaceFrame | None = None,
) -> None:
    """Checks gun speed, stand-off, angle and position while the paint flows.

    Stand-off and angle are against the wall's surface; the speed is that of the
    nozzle's foot there, along T.

    Args:
        program: As it will be executed; stroke i flows in `spray_on` row i.
        kinematics: Of the arm.
        valve_delay: From trigger to flow, opening and closing, s.
        surface: Of the wall; None = T's plane.

    Raises:
        MotionLimitError: Names stroke, time, quantity, value and bound.
    """
    motion = program.motion
    if len(motion.spray_on) != len(program.strokes):
        raise MotionLimitError(
            f"program: the gun opens {len(motion.spray_on)} times for "
            f"{len(program.strokes)} strokes.",
            code="PNT-MOTION-003",
        )
    opened = motion.spray_on + valve_delay
    times = [_dense(float(opens), float(closes)) for opens, closes in opened]
    if not times:
        return
    time = np.concatenate(times)
    lasts = np.cumsum([len(some) for some in times]) - 1
    number = np.repeat(np.arange(len(times)), [len(some) for some in times])
    q = motion.trajectory.vector_values(time).T
    p_TG, axis_T = _gun_in_tile(q, program.X_WT, kinematics)
    strokes = program.strokes
    starts = np.array([stroke.start_T for stroke in strokes])
    ends = np.array([stroke.end_T for stroke in strokes])
    along = (ends - starts) / np.array([[stroke.length] for stroke in strokes])
    speeds = np.array([stroke.speed for stroke in strokes])
    standoff = np.array([stroke.standoff for stroke in strokes])[number]
    gone = (time - opened[number, 0]) * speeds[number]
    ideal = starts[number] + gone[:, None] * along[number]
    if surface is None:
        cosine = -axis_T[:, 2]
    else:
        places = np.column_stack([ideal, standoff])
        ideal_TGs, normals = surface.points(places)
        cosine = -np.sum(axis_T * normals, axis=1)
        off = p_TG - ideal_TGs
        before = np.sum(off * normals, axis=1)
        p_TG = places + off - before[:, None] * normals
        p_TG[:, 2] = standoff + before
    off_axis_deg = np.rad2deg(np.arccos(np.clip(cosine, -1.0, 1.0)))
    # The last sample of a stroke has no next one; it counts with the one before.
    nexts = np.arange(1, len(time) + 1)
    nexts[lasts] = lasts
    gaps = p_TG[nexts, :2] - p_TG[nexts - 1, :2]
    speed = np.linalg.norm(gaps, axis=1) / (time[nexts] - time[nexts - 1])
    lengths = speeds * np.diff(opened, axis=1)[:, 0]
    reached = np.abs(starts + along * lengths[:, None] - ends).max(axis=1)
    checks: list[tuple[str, str, FloatArray, FloatArray | float]] = [
        (
            "speed error",
            "m/s",
            speed - speeds[number],
            _SPEED_TOLERANCE * speeds[number],
        ),
        ("stand-off error", "m", p_TG[:, 2] - standoff, _STANDOFF_TOLERANCE),
        ("gun angle", "deg", off_axis_deg, _ANGLE_TOLERANCE_DEG),
        ("position across x", "m", p_TG[:, 0] - ideal[:, 0], _PLACE_TOLERANCE),
        ("position along y", "m", p_TG[:, 1] - ideal[:, 1], _PLACE_TOLERANCE),
        ("end", "m", reached[number], _PLACE_TOLERANCE),
    ]
    within = [np.abs(values) <= bounds for _, _, values, bounds in checks]
    for wrong in np.unique(number[~np.all(within, axis=0)]):
        rows = number == wrong
        for name, unit, values, bounds in checks:
            some = np.broadcast_to(bounds, values.shape)[rows]
            what = f"stroke {wrong + 1}: {name}"
            _require_within(what, unit, time[rows], values[rows], some)


def _extremes(
    motion: Motion,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Returns times (n,) and positions, rates and accelerations (n, 5) there.

    Between two samples the acceleration of a cubic is linear: it is greatest at either
    end, and the rate is greatest there or where the acceleration crosses zero. Each
    joint crosses zero at its own time; these rows hold that joint's rate, and the time
    of the sample before.
    """
    h = np.diff(motion.time)[:, None]
    slope_q = np.diff(motion.q, axis=0) / h
    v0, v1 = motion.v[:-1], motion.v[1:]
    a0 = (6.0 * slope_q - 4.0 * v0 - 2.0 * v1) / h
    a1 = (-6.0 * slope_q + 2.0 * v0 + 4.0 * v1) / h
    slope = a1 - a0
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = np.where(a0 * a1 < 0.0, -a0 / slope, 0.0)
    peak = v0 + h * crossing * (a0 + 0.5 * slope * crossing)
    start, end = motion.time[:-1], motion.time[1:]
    return (
        np.concatenate([start, end, start]),
        np.concatenate([motion.q[:-1], motion.q[1:], motion.q[:-1]]),
        np.concatenate([v0, v1, peak]),
        np.concatenate([a0, a1, a0]),
    )


def _gun_in_tile(
    q: FloatArray, X_WT: RigidTransform, kinematics: ArmKinematics
) -> tuple[FloatArray, FloatArray]:
    """Returns the nozzle (n, 3), m, and the spray axis (n, 3), both in T."""
    X_TW = X_WT.inverse()
    p_TGs = (X_TW @ kinematics.nozzle(q).T).T
    axes_T = (X_TW.rotation().matrix() @ kinematics.spray_axis(q).T).T
    return p_TGs, axes_T


def _spread(q: FloatArray, kinematics: ArmKinematics) -> IntArray:
    """Returns the rows of q (n, 5) to check, both ends among them."""
    travel = np.cumsum(kinematics.travel(q))
    _, first = np.unique(np.floor(travel / _CLEARANCE_STEP), return_index=True)
    return np.unique(np.concatenate([[0], first + 1, [len(q) - 1]]))


def _dense(start: float, end: float) -> FloatArray:
    return np.linspace(start, end, max(3, int(np.ceil((end - start) / _STEP)) + 1))


def _require_within(
    what: str,
    unit: str,
    time: FloatArray,
    values: FloatArray,
    bounds: FloatArray | float,
) -> None:
    """Raises for the value that exceeds its bound most; values (n,) or (n, 5)."""
    size = np.abs(values)
    bounds = np.broadcast_to(bounds, size.shape)
    excess = np.where(np.isfinite(size), size / bounds, np.inf)
    worst = np.unravel_index(int(np.argmax(excess)), size.shape)
    if excess[worst] <= 1.0:
        return
    joint = f" of {JOINT_NAMES[worst[1]]}" if size.shape[1:] == (5,) else ""
    raise MotionLimitError(
        f"{what}{joint} is {size[worst]:.4g} {unit} at {time[worst[0]]:.3f} s, "
        f"the limit is {bounds[worst]:.4g} {unit}.",
        code="PNT-MOTION-004",
    )
