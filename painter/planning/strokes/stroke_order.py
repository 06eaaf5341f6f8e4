"""Order and direction of strokes: least time of transitions, both ends fixed.

A transition is taken as the quickest motion of a point whose acceleration along each
axis is bounded. That leaves joints and obstacles out, but it ranks orders as the
finished motion does: turning about and going back are what costs time.
"""

from collections.abc import Sequence

import numpy as np

from painter.planning.spray_path import Stroke
from perception.ground import FloatArray

# m/s², along each axis; with the arm of the models a U-turn at 0.6 m/s between lines
# 0.13 m apart then takes the 0.5 s that it takes in finished motions.
_ACCELERATION = 2.5
_LONGEST_RUN = 3  # Strokes that are moved together within the order.
_GAIN = 1e-6  # s; less is rounding.


def order_strokes(
    strokes: Sequence[Stroke], p_TG_start: FloatArray, p_TG_end: FloatArray
) -> tuple[Stroke, ...]:
    """Orders and turns strokes so that the gun loses little time between them.

    Starts from the given order and takes any better one that results from reversing a
    run of strokes, or from moving a short run elsewhere, until there is none.

    Args:
        strokes: In any order.
        p_TG_start: (3,) m, nozzle in T at rest before the strokes.
        p_TG_end: (3,) m, nozzle in T at rest after them.

    Returns:
        The same strokes, some of them in the other direction.
    """
    if not strokes:
        return ()
    cost = _transition_times(strokes, p_TG_start, p_TG_end)
    count = len(strokes)
    # Stroke k forwards is 2 k, backwards 2 k + 1; the two rest poses come last.
    order = [2 * count, *range(0, 2 * count, 2), 2 * count + 1]
    rows = cost.tolist()  # Single numbers are quicker to take from lists.
    better = True
    while better:
        better = _reverse_runs(order, rows) or _move_runs(order, cost)
    return tuple(
        reversed_stroke(strokes[k // 2]) if k % 2 else strokes[k // 2]
        for k in order[1:-1]
    )


def transition_time(
    strokes: Sequence[Stroke], p_TG_start: FloatArray, p_TG_end: FloatArray
) -> float:
    """Returns the estimated time of all transitions in the order given, s."""
    cost = _transition_times(strokes, p_TG_start, p_TG_end)
    count = len(strokes)
    order = np.array([2 * count, *range(0, 2 * count, 2), 2 * count + 1])
    return float(cost[order[:-1], order[1:]].sum())


def reversed_stroke(stroke: Stroke) -> Stroke:
    """Returns the stroke in the other direction."""
    return stroke.replace(start_T=stroke.end_T, end_T=stroke.start_T)


def _transition_times(
    strokes: Sequence[Stroke], p_TG_start: FloatArray, p_TG_end: FloatArray
) -> FloatArray:
    """Returns the time (2 n + 2, 2 n + 2), s, from each oriented stroke to each."""
    starts, ends, speeds = [], [], []
    for stroke in strokes:
        a, b = (np.append(p, stroke.standoff) for p in (stroke.start_T, stroke.end_T))
        v = (b - a) * (stroke.speed / stroke.length)
        starts += [a, b]
        ends += [b, a]
        speeds += [v, -v]
    rests = [np.asarray(p_TG_start, float), np.asarray(p_TG_end, float)]
    x0, x1 = np.array([*ends, *rests]), np.array([*starts, *rests])
    v = np.array([*speeds, np.zeros(3), np.zeros(3)])
    return np.asarray(
        _least_time(x1[None] - x0[:, None], v[:, None], v[None]).max(axis=-1)
    )


def _least_time(gap: FloatArray, v0: FloatArray, v1: FloatArray) -> FloatArray:
    """Returns the least time, s, to cover a gap between two speeds along one axis.

    Full acceleration one way, then the other: the speed between them follows from the
    gap, and must not lie between the two end speeds' own range on the wrong side.
    """
    a = _ACCELERATION
    mean = (v0**2 + v1**2) / 2.0
    times = []
    for sign in (1.0, -1.0):
        square = mean + sign * a * gap
        peak = sign * np.sqrt(np.clip(square, 0.0, None))
        time = sign * (2.0 * peak - v0 - v1) / a
        fits = (sign * (peak - v0) >= -1e-9) & (sign * (peak - v1) >= -1e-9)
        times.append(np.where(fits & (square >= 0.0), time, np.inf))
    least = np.minimum(*times)
    # At one steady speed no acceleration is needed at all.
    steady = (np.abs(v0 - v1) < 1e-9) & (np.abs(v0) > 1e-9) & (gap * v0 >= 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        cruise = np.where(steady, gap / v0, np.inf)
    return np.asarray(np.where(np.isfinite(least), least, cruise))


def _reverse_runs(order: list[int], cost: list[list[float]]) -> bool:
    """Reverses runs of strokes where that saves time; True if any was."""
    found = False
    for i in range(1, len(order) - 1):
        from_before = cost[order[i - 1]]
        for j in range(i, len(order) - 1):
            first, last, after = order[i], order[j], order[j + 1]
            old = from_before[first] + cost[last][after]
            new = from_before[last ^ 1] + cost[first ^ 1][after]
            if new < old - _GAIN:
                order[i : j + 1] = [k ^ 1 for k in reversed(order[i : j + 1])]
                found = True
    return found


def _move_runs(order: list[int], cost: FloatArray) -> bool:
    """Moves one short run, either way round, to where it costs less."""
    size = len(order)
    for length in range(1, _LONGEST_RUN + 1):
        for i in range(1, size - length):
            run, rest = order[i : i + length], order[:i] + order[i + length :]
            cut = cost[order[i - 1], run[0]] + cost[run[-1], order[i + length]]
            saved = cut - cost[order[i - 1], order[i + length]]
            heads, tails = np.array(rest[:-1]), np.array(rest[1:])
            joined = cost[heads, tails]
            for way in (run, [k ^ 1 for k in reversed(run)]):
                added = cost[heads, way[0]] + cost[way[-1], tails] - joined
                place = int(np.argmin(added))
                if added[place] < saved - _GAIN:
                    order[:] = rest[: place + 1] + way + rest[place + 1 :]
                    return True
    return False
