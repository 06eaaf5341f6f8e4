"""Figures of how well the arm followed what it was commanded."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from painter.planning.spray_path import Stroke
from painter.run.folder.values import Executed
from perception.ground import BoolArray, FloatArray

# Poses closer in time than this say more about encoder steps than about speed.
SPEED_WINDOW = 0.02


def tip_errors(executed: Executed) -> FloatArray:
    """Distance of the nozzle from where it was commanded, (n,) m."""
    error = executed.X_WG[:, :3, 3] - executed.X_WG_desired[:, :3, 3]
    return np.linalg.norm(error, axis=1)


def gun_angle_errors(executed: Executed) -> FloatArray:
    """Angle of the rotation from the commanded to the executed gun frame, (n,) rad."""
    R_GdW = executed.X_WG_desired[:, :3, :3].transpose(0, 2, 1)
    return Rotation.from_matrix(R_GdW @ executed.X_WG[:, :3, :3]).magnitude()


def wall_points(executed: Executed, X_WT: FloatArray) -> FloatArray:
    """Where the spray axis meets the plane of the tile.

    Args:
        executed: Log of n instants.
        X_WT: (4, 4) tile frame in W.

    Returns:
        (n, 2) m, in T's x and y; NaN where the gun does not point at the wall.
    """
    X_TG = np.linalg.inv(X_WT) @ executed.X_WG
    p_TG, axis_T = X_TG[:, :3, 3], X_TG[:, :3, 2]
    towards = -axis_T[:, 2]
    reach = p_TG[:, 2] / np.where(towards > 1e-6, towards, np.nan)
    return p_TG[:, :2] + reach[:, None] * axis_T[:, :2]


def spraying(executed: Executed) -> BoolArray:
    """Instants at which the gun is open, (n,)."""
    return executed.trigger > 0.0


def speed_within(
    executed: Executed, strokes: Sequence[Stroke], X_WT: FloatArray, tolerance: float
) -> float | None:
    """Share of the sprayed length at which the gun moved at its stroke's speed.

    The speed is that of the point where the spray axis meets the wall, over windows of
    `SPEED_WINDOW` that lie wholly in a stroke; a window belongs to the stroke nearest
    to its middle.

    Args:
        executed: Log of the cycle.
        strokes: Strokes of the program.
        X_WT: (4, 4) tile frame in W.
        tolerance: Allowed deviation as a share of the stroke's speed.

    Returns:
        The share, or None if nothing was sprayed.
    """
    if executed.time.size < 2 or not strokes:
        return None
    period = float(np.median(np.diff(executed.time)))
    step = max(1, round(SPEED_WINDOW / period))
    closed = np.concatenate([[0], np.cumsum(~spraying(executed))])
    first = np.arange(executed.time.size - step)
    first = first[closed[first + step + 1] == closed[first]]
    p_TPs = wall_points(executed, X_WT)
    moved = p_TPs[first + step] - p_TPs[first]
    length = np.linalg.norm(moved, axis=1)
    speed = length / (executed.time[first + step] - executed.time[first])
    if length.sum() <= 0.0:
        return None
    nominal = _nominal_speed(p_TPs[first] + 0.5 * moved, strokes)
    good = np.abs(speed - nominal) <= tolerance * nominal
    return float(length[good].sum() / length.sum())


def tracking_figures(
    executed: Executed, strokes: Sequence[Stroke], X_WT: FloatArray
) -> dict[str, float | None]:
    """Returns the tracking figures of DESIGN section 6; None if nothing was sprayed."""
    on = spraying(executed)
    if not on.any():
        names = ("tip_error_rms_m", "tip_error_max_m", "gun_angle_error_max_deg")
        return dict.fromkeys((*names, "speed_within_2pct"))
    tip = tip_errors(executed)[on]
    return {
        "tip_error_rms_m": float(np.sqrt(np.mean(tip**2))),
        "tip_error_max_m": float(tip.max()),
        "gun_angle_error_max_deg": float(
            np.rad2deg(gun_angle_errors(executed)[on].max())
        ),
        "speed_within_2pct": speed_within(executed, strokes, X_WT, 0.02),
    }


def _nominal_speed(points_T: FloatArray, strokes: Sequence[Stroke]) -> FloatArray:
    starts = np.array([stroke.start_T for stroke in strokes])
    along = np.array([stroke.end_T for stroke in strokes]) - starts
    squared = np.maximum((along**2).sum(axis=1), 1e-12)
    offset = points_T[:, None, :] - starts
    share = np.clip((offset * along).sum(axis=2) / squared, 0.0, 1.0)
    distance = np.linalg.norm(offset - share[..., None] * along, axis=2)
    return np.array([stroke.speed for stroke in strokes])[distance.argmin(axis=1)]
