"""Accuracy, memory and time of the mapper on rendered walls.

`python -m benchmarks.findings.map_sessions [ROW ...] [--rate HZ] [--scans N] [--seed
N]`; rows: textured, textured-no-arm, painted, window, blank, blank-no-arm,
wrong-constraints, memory; without names all but memory. Sequences: 848 x 480 through
the D435 model, 0.7 m from the wall, zig-zag of five rows over 2 x 2 m. CPU is of the
whole process, on all cores.
"""

import argparse
import resource
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix

from perception.depth_camera.depth import CameraIntrinsics
from perception.io.frames import Frame
from perception.mapping.config import MapperConfig
from perception.mapping.sessions.mapper import Mapper, MappingResult, NoMapError
from perception.mapping.sessions.report import session_report
from perception.synthetic.sequences import (
    SequenceConfig,
    WallKind,
    distance_to_surface,
    outlines,
    render_sequence,
)

ERRORS = {
    "mount_error": 0.003,
    "mount_error_deg": 0.3,
    "base_shift": 0.005,
    "base_shift_deg": 0.3,
}
ROWS = {
    "textured": (WallKind.TEXTURED, {}, True),
    "textured-no-arm": (WallKind.TEXTURED, {}, False),
    "painted": (WallKind.PAINTED, ERRORS, True),
    "window": (WallKind.WINDOW, ERRORS, True),
    "blank": (WallKind.BLANK, ERRORS, True),
    "blank-no-arm": (WallKind.BLANK, {}, False),
    "wrong-constraints": (WallKind.TEXTURED, {}, True),
    "memory": (WallKind.BLANK, {}, True),
}
CELL = 0.01
"""Of the thickness, m."""
DOUBLED = 0.008
"""A 2 cm cell is doubled, m: where truth has one surface, if two points lie so far
apart along its normal; where truth has more (a true step crosses the cell or lies
within STEP of it), if a point lies so far from each of them. Only the square that was
scanned counts; beside it a point is the mean of three pixels."""
SPAN = 2.0
"""Of that square, m."""
STEP = 0.01
"""What a mount's error of 3 mm and 0.3 deg moves along the wall, with 3 mm to spare."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "rows",
        nargs="*",
        type=known_row,
        default=list(ROWS)[:-1],
        metavar="ROW",
        help=f"one of {', '.join(ROWS)}; all but the last unless given",
    )
    parser.add_argument("--rate", type=float, default=5.0, help="frames a second, Hz")
    parser.add_argument("--scans", type=int, default=1, help="times over the wall")
    parser.add_argument("--seed", type=int, default=7, help="of noise and errors")
    words = parser.parse_args()
    for row in words.rows:
        run_row(row, words.rate, words.scans, words.seed)


def known_row(name: str) -> str:
    """Returns a row's name; argparse itself would refuse the default for no choice."""
    if name not in ROWS:
        raise argparse.ArgumentTypeError(f"{name!r} is not one of {', '.join(ROWS)}")
    return name


def run_row(row: str, rate: float, scans: int, seed: int) -> None:
    wall, errors, with_arm = ROWS[row]
    config = SequenceConfig(wall=wall, rate=rate, **errors)
    mapper = Mapper(CameraIntrinsics.from_stereo(config.stereo), MapperConfig())
    truth, arm = {}, {}
    before = peak_memory()
    cpu, online = 0.0, []
    try:
        for frame, X_WC in scanned(config, scans, seed, mapper):
            truth[frame.time], arm[frame.time] = X_WC, frame.X_WC
            start = time.process_time()
            mapper.add(frame if with_arm else frame.replace(X_WC=None))
            cpu += time.process_time() - start
            if mapper.placed and mapper.placed[-1][0] == frame.time:
                _, k, X_KC = mapper.placed[-1]
                online.append((frame.time, mapper.graph.poses[k] @ X_KC))
        if row == "wrong-constraints":
            clean = mapper.finish()
            spoil_constraints(mapper, seed)
        result = mapper.finish()
    except NoMapError as error:
        print(f"{row}: refused: {error}")
        return
    after = peak_memory()
    report = session_report(mapper, result)
    placed, total = len(result.poses), len(truth)
    print(f"{row}: {placed} of {total} frames, {len(mapper.graph.keyframes)} keyframes")
    if row == "wrong-constraints":
        print(f"  ATE without the wrong constraints {ate(clean.poses, truth):.2f} mm")
    print(
        f"  ATE {ate(result.poses, truth):.2f} mm, as known when each frame came "
        f"{ate(online, truth):.2f} mm; arm's "
        f"{ate(list(arm.items()), truth):.2f} mm; constraints {report['links']}, "
        f"dropped {report['links_dropped']}"
    )
    print_surface(result, wall, best_motion(result.poses, truth))
    if with_arm:
        print_observed(mapper, result, truth, arm, report)
    count = len(mapper.graph.keyframes)
    timing = report["timing"]
    print(
        f"  CPU a keyframe: {1e3 * timing['cpu_per_keyframe_s']:.0f} ms mean, "
        f"{1e3 * timing['cpu_per_keyframe_p95_s']:.0f} ms p95, and "
        f"{1e3 * timing['finish_cpu_s'] / count:.0f} ms for the last optimisation and "
        f"fusion; all frames {1e3 * cpu / total:.0f} ms a frame; peak memory "
        f"+{after - before:.0f} MB (renderer's included)"
    )


def scanned(
    config: SequenceConfig, scans: int, seed: int, mapper: Mapper
) -> Iterator[tuple[Frame, RigidTransform]]:
    """Yields the frames of several scans; prints the figures of each."""
    begun, last, done = 0.0, 0.0, 0
    for scan in range(scans):
        for frame, X_WC in render_sequence(config, seed + scan):
            last = begun + frame.time
            yield frame.replace(time=last), X_WC
        begun = last + 1.0
        if scans > 1:
            cpu = 1e3 * np.array(mapper.seconds[done:])
            done = len(mapper.seconds)
            print(
                f"  scan {scan + 1}: {cpu.size} keyframes, {cpu.mean():.0f} ms mean, "
                f"{np.percentile(cpu, 95):.0f} ms p95, {cpu.max():.0f} ms at most; "
                f"memory {memory():.0f} MB, peak {peak_memory():.0f} MB",
                flush=True,
            )


def memory() -> float:
    """Returns the process's memory now, MB."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 1e6


def peak_memory() -> float:
    """Returns the process's peak so far, MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def spoil_constraints(mapper: Mapper, seed: int) -> None:
    """Moves every tenth constraint by 2 to 5 cm and 2 deg."""
    rng = np.random.default_rng(seed)
    constraints = list(mapper.graph.constraints)
    for index in range(0, len(constraints), 10):
        shift = rng.choice([-1, 1], 3) * rng.uniform(0.02, 0.05, 3)
        X = RigidTransform(RollPitchYaw(0.035, 0.0, -0.035), shift)
        constraints[index] = constraints[index].replace(
            X_ij=constraints[index].X_ij @ X
        )
    mapper.graph = mapper.graph.replace(constraints=tuple(constraints))


def ate(
    poses: list[tuple[float, RigidTransform]], truth: dict[float, RigidTransform]
) -> float:
    """Root mean square distance, mm, after the best rigid motion."""
    X_TW = best_motion(poses, truth)
    away = [X_TW @ X.translation() - truth[t].translation() for t, X in poses]
    return float(1e3 * np.sqrt(np.mean(np.sum(np.square(away), axis=1))))


def best_motion(
    poses: list[tuple[float, RigidTransform]], truth: dict[float, RigidTransform]
) -> RigidTransform:
    """Returns X_TW that brings the poses' places closest to the true ones.

    Source: Horn, "Closed-form solution of absolute orientation", 1987.
    """
    p = np.array([X.translation() for _, X in poses])
    q = np.array([truth[t].translation() for t, _ in poses])
    U, _, Vt = np.linalg.svd((p - p.mean(axis=0)).T @ (q - q.mean(axis=0)))
    sign = np.diag([1.0, 1.0, np.sign(np.linalg.det(U @ Vt))])
    R = (U @ sign @ Vt).T
    return RigidTransform(RotationMatrix(R), q.mean(axis=0) - R @ p.mean(axis=0))


def on_step(p_TQs: np.ndarray, wall: WallKind) -> np.ndarray:
    """Tells which of (2, n) middles of 2 cm cells, m in T, lie on or by a true step."""
    reach = 0.01 * np.sqrt(2.0) + STEP
    step = np.zeros(p_TQs.shape[1], dtype=bool)
    for x0, y0, x1, y1 in outlines(wall):
        middle = np.array([[x0 + x1], [y0 + y1]]) / 2.0
        half = np.array([[x1 - x0], [y1 - y0]]) / 2.0
        away = np.abs(p_TQs - middle) - half
        outside = np.linalg.norm(np.maximum(away, 0.0), axis=0)
        step |= np.abs(outside + np.minimum(away.max(axis=0), 0.0)) < reach
    return step


def print_surface(result: MappingResult, wall: WallKind, X_TW: RigidTransform) -> None:
    """Prints thickness, doubled cells and bending of the wall's plane.

    Args:
        result: With the map.
        wall: Which one it is.
        X_TW: Pose of the map; errors of the mount that nothing shows are no doubling.
    """
    fused = result.fused
    p_VQs = fused.X_WV.inverse() @ fused.p_WQs
    p_VQs = p_VQs[:, np.abs(p_VQs[2]) < 0.02]
    x, y, z = p_VQs
    _, index = np.unique(np.floor(p_VQs[:2] / CELL), axis=1, return_inverse=True)
    means = np.bincount(index.ravel(), z) / np.bincount(index.ravel())
    thick = np.diff(np.percentile(means, [5, 95]))[0]
    cells, index = np.unique(np.floor(p_VQs[:2] / 0.02), axis=1, return_inverse=True)
    index = index.ravel()
    high, low = np.full(index.max() + 1, -np.inf), np.full(index.max() + 1, np.inf)
    np.maximum.at(high, index, z)
    np.minimum.at(low, index, z)
    middle_V = np.vstack([0.02 * (cells + 0.5), np.zeros(cells.shape[1])])
    middle_T = (X_TW @ fused.X_WV @ middle_V)[:2]
    scanned = np.all((middle_T > 0.0) & (middle_T < SPAN), axis=0)
    one = scanned & ~on_step(middle_T, wall)
    doubled = high - low > DOUBLED
    by_step, away = strays(X_TW @ fused.p_WQs, wall)
    # A quadric through the wall shows how far it bends over 2 m.
    terms = np.stack([x * x, x * y, y * y, x, y, np.ones_like(x)], axis=1)
    quadric = np.linalg.lstsq(terms, z, rcond=None)[0]
    bend = terms[:, :3] @ quadric[:3]
    within = (np.abs(x) < 1.0) & (np.abs(y) < 1.0)
    flat = f"{np.count_nonzero(doubled[one])} of {np.count_nonzero(one)}"
    bent = 1e3 * np.ptp(bend[within])
    print(
        f"  wall at 1 cm cells: 5-95 % {1e3 * thick:.2f} mm; doubled 2 cm cells "
        f"{flat}, by steps {by_step}; no point farther than {1e3 * away:.1f} mm from a "
        f"true surface; bending over 2 m {bent:.2f} mm; carved {fused.carved}"
    )


def strays(p_TQs: np.ndarray, wall: WallKind) -> tuple[str, float]:
    """Returns the doubled cells by true steps, and the largest distance of a point."""
    cells, index = np.unique(np.floor(p_TQs[:2] / 0.02), axis=1, return_inverse=True)
    away = np.zeros(cells.shape[1])
    np.maximum.at(away, index.ravel(), distance_to_surface(p_TQs, wall))
    step = on_step(0.02 * (cells + 0.5), wall)
    doubled = np.count_nonzero(away[step] > DOUBLED)
    return f"{doubled} of {np.count_nonzero(step)}", float(away.max())


def print_observed(mapper, result, truth, arm, report) -> None:
    """Prints the camera's errors to the wall before and after, and the corrections."""
    by_arm = [arm[keyframe.time] for keyframe in mapper.graph.keyframes]
    # The best plane of the map that the arm's poses would make.
    middles = np.array(
        [
            X @ k.planes[0].center
            for X, k in zip(by_arm, mapper.graph.keyframes, strict=True)
        ]
    )
    normal = np.linalg.svd(middles - middles.mean(axis=0))[2][2]
    normal *= np.sign(normal[2])
    before = plane_errors(
        mapper, by_arm, [*normal, normal @ middles.mean(axis=0)], truth
    )
    seen = np.bincount([s.plane for s in mapper.graph.sightings])
    plane = result.solution.estimate.planes[int(np.argmax(seen))]
    after = plane_errors(mapper, result.solution.graph.poses, plane, truth)
    for name, unit, old, new in zip(
        ("tilt to the wall", "distance to it"),
        ("deg", "mm"),
        before,
        after,
        strict=True,
    ):
        print(f"  {name}: {old:.3f} -> {new:.3f} {unit}, {1 - new / old:+.0%} better")
    print(f"  observed in keyframes: {report['observed_share']}")
    print(f"  corrected (rms): {report['correction_rms']}")


def plane_errors(mapper, poses, plane, truth) -> tuple[float, float]:
    errors = []
    for keyframe, X_WC in zip(mapper.graph.keyframes, poses, strict=True):
        X_true = truth[keyframe.time]
        seen = X_WC.rotation().inverse() @ np.array(plane[:3])
        true = X_true.rotation().inverse() @ np.array([0.0, 0.0, 1.0])
        tilt = np.degrees(np.arctan2(np.linalg.norm(np.cross(seen, true)), seen @ true))
        away = np.array(plane[:3]) @ X_WC.translation() - plane[3]
        errors.append([tilt, 1e3 * (away - X_true.translation()[2])])
    tilt, away = np.sqrt(np.mean(np.square(errors), axis=0))
    return float(tilt), float(away)


if __name__ == "__main__":
    main()
