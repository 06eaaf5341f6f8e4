"""Figures of a mapping session, as JSON values."""

import resource
from collections import Counter
from typing import Any

import numpy as np

from perception.ground import FloatArray
from perception.mapping.pose_graph.keyframe_graph import Solution
from perception.mapping.sessions.mapper import Mapper, MappingResult

_NAMES = ("about_x", "about_y", "about_normal", "x", "y", "normal")
_SLAB = 0.02
"""Points this close to the main plane are its surface, m."""


def session_report(mapper: Mapper, result: MappingResult) -> dict[str, Any]:
    """Makes the report.

    Directions are those of the main plane seen from the cameras: x right, y up, and
    the normal. A direction counts as observed in a keyframe if constraints and planes
    determine most of a step along it; only there the arm's pose was corrected.

    Args:
        mapper: After `finish`.
        result: What that returned.

    Returns:
        Names and values; those that depend on the machine are under `timing`.
    """
    graph, estimate = result.solution.graph, result.solution.estimate
    fused = result.fused
    kinds = Counter(str(constraint.kind) for constraint in graph.constraints)
    R_VW = fused.X_WV.rotation().matrix().T
    shares, steps = _by_direction(result.solution, R_VW)
    has_arm = graph.has_arm
    z = (fused.X_WV.inverse() @ fused.p_WQs)[2] if fused.p_WQs.size else np.zeros(0)
    z = z[np.abs(z) < _SLAB]
    seconds = np.array(mapper.seconds or [0.0])
    report: dict[str, Any] = {
        "frames": {str(name): count for name, count in mapper.outcomes.items()},
        "keyframes": len(graph.keyframes),
        "links": dict(kinds),
        "links_dropped": int(np.count_nonzero(estimate.constraint_weights == 0.0)),
        "planes": [
            {"normal": plane[:3].round(6).tolist(), "offset_m": round(plane[3], 6)}
            for plane in estimate.planes
        ],
        "points": int(fused.p_WQs.shape[1]),
        "points_carved": fused.carved,
        "main_plane_thickness_m": _spread(z),
        "observed_share": shares if has_arm else None,
        "correction_rms": steps if has_arm else None,
    }
    if has_arm:
        observed = np.diag(estimate.mount_observed)
        base = np.linalg.norm(estimate.base.p, axis=1)
        report["mount_error"] = {
            "rotation_deg": np.degrees(estimate.mount[:3]).round(4).tolist(),
            "translation_m": estimate.mount[3:].round(6).tolist(),
            "observed_share": observed.round(3).tolist(),
        }
        report["base_shift_m"] = float(base.max())
    report["timing"] = {
        "cpu_per_keyframe_s": float(seconds.mean()),
        "cpu_per_keyframe_p95_s": float(np.percentile(seconds, 95)),
        "finish_cpu_s": mapper.fuse_seconds,
        "peak_memory_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0,
    }
    return report


def _by_direction(
    solution: Solution, R_VW: FloatArray
) -> tuple[dict[str, float], dict[str, float]]:
    """Returns by direction in V: share of keyframes observed, and rms correction."""
    observed, steps = [], []
    for X_WC, projection, step in zip(
        solution.graph.poses, solution.observed, solution.corrections, strict=True
    ):
        R_VC = R_VW @ X_WC.rotation().matrix()
        turn, shift = projection[:3, :3], projection[3:, 3:]
        parts = [np.diag(R_VC @ block @ R_VC.T) for block in (turn, shift)]
        observed.append(np.concatenate(parts) > 0.5)
        steps.append(np.concatenate([R_VC @ step[:3], R_VC @ step[3:]]))
    share = np.mean(observed, axis=0)
    rms = np.sqrt(np.mean(np.square(steps), axis=0))
    units = ["_deg"] * 3 + ["_m"] * 3
    rms[:3] = np.degrees(rms[:3])
    return (
        dict(zip(_NAMES, share.round(4).tolist(), strict=True)),
        {
            name + unit: float(value)
            for name, unit, value in zip(_NAMES, units, rms, strict=True)
        },
    )


def _spread(z: FloatArray) -> float | None:
    """Returns the 5 to 95 % range."""
    return float(np.diff(np.percentile(z, [5, 95]))[0]) if z.size else None
