"""Makes corrupted and odd recordings and segments them, each by its seed.

    python tests/fuzz/bad_files.py FIRST LAST FOLDER

Run by `test_bad_input.py` in a process with bounded memory. Prints a JSON object a
recording: seed, what was made, outcome (an error's name, or "segmented"), seconds; and
at last the peak of memory. Any other exception than Painter's own ends it.
"""

import io
import json
import re
import resource
import signal
import sys
import time
from pathlib import Path

import numpy as np
from PIL import Image

from painter.errors import PainterError
from painter.run.page.recorded_wall import segmentation_figures
from perception.config import SegmentationConfig
from perception.errors import PerceptionError
from perception.io.recordings import read_recording
from perception.recorded.segment_recorded import segment_recorded

TIMEOUT = 30  # s
COUNTS = (
    b"0",
    b"-1",
    b"1",
    b"7",
    b"99999999",
    b"4294967296",
    b"9" * 25,
    b"1e9",
    b"nan",
)
NUMBERS = (np.nan, np.inf, -np.inf, 1e30, -1e30, 1e300, 5e-324, 0.0, 1e6, -1e9)
CAMERA = {"width": 32, "height": 24, "fx": 20.0, "fy": 20.0, "cx": 16.0, "cy": 12.0}
WRONG = (
    0,
    -1,
    1e-300,
    1e300,
    float("nan"),
    float("inf"),
    10**400,
    "20",
    None,
    [1],
    True,
)


def wall(rng):
    """A wall with a box before it, 4 cm apart, as (3, N) m."""
    x, y = np.meshgrid(np.arange(-1.0, 1.0, 0.04), np.arange(-0.8, 0.8, 0.04))
    z = np.where((np.abs(x) < 0.2) & (np.abs(y) < 0.2), 0.9, 1.0)
    return np.stack([x.ravel(), y.ravel(), z.ravel() + rng.normal(0, 0.002, z.size)])


def ply(points, form, rng):
    head = f"ply\nformat {form} 1.0\nelement vertex {points.shape[1]}\n"
    head += "property float x\nproperty float y\nproperty float z\nend_header\n"
    if form == "ascii":
        return head.encode() + text(points)
    order = "<" if form == "binary_little_endian" else ">"
    return head.encode() + points.T.astype(order + "f4").tobytes()


def pcd(points, form, rng):
    count = points.shape[1]
    head = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
    head += f"WIDTH {count}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\n"
    head += f"POINTS {count}\nDATA {form}\n"
    if form == "ascii":
        return head.encode() + text(points)
    if form == "binary":
        return head.encode() + points.T.astype("<f4").tobytes()
    raw = points.astype("<f4").tobytes()
    # LZF of literals alone: a control byte n, then n + 1 bytes.
    packed = b"".join(
        bytes([len(raw[i : i + 32]) - 1]) + raw[i : i + 32]
        for i in range(0, len(raw), 32)
    )
    sizes = np.array([len(packed), len(raw)], "<u4").tobytes()
    return head.encode() + sizes + packed


def text(points):
    stream = io.BytesIO()
    np.savetxt(stream, points.T, fmt="%.5f")
    return stream.getvalue()


def array(values, save=np.save):
    stream = io.BytesIO()
    save(stream, values)
    return stream.getvalue()


FILES = {
    "a.ply": lambda points, rng: ply(points, "ascii", rng),
    "b.ply": lambda points, rng: ply(points, "binary_little_endian", rng),
    "c.ply": lambda points, rng: ply(points, "binary_big_endian", rng),
    "d.pcd": lambda points, rng: pcd(points, "ascii", rng),
    "e.pcd": lambda points, rng: pcd(points, "binary", rng),
    "f.pcd": lambda points, rng: pcd(points, "binary_compressed", rng),
    "g.xyz": lambda points, rng: text(points),
    "h.npy": lambda points, rng: array(points.T),
    "i.npz": lambda points, rng: array(points.T, np.savez_compressed),
}


def flip(data, rng):
    """Changes some bytes, in the header as often as anywhere."""
    out = bytearray(data)
    for _ in range(int(rng.integers(1, 20))):
        end = len(out) if rng.random() < 0.5 else min(len(out), 250)
        out[rng.integers(end)] = rng.integers(256)
    return bytes(out)


def cut(data, rng):
    return data[: int(rng.integers(len(data)))]


def repeat(data, rng):
    start, end = sorted(rng.integers(len(data), size=2))
    return data[:end] + data[start:]


def recount(data, rng):
    """Exchanges a number of the header."""
    numbers = list(re.finditer(rb"\d+", data[:250]))
    if not numbers:
        return flip(data, rng)
    place = numbers[rng.integers(len(numbers))]
    word = COUNTS[rng.integers(len(COUNTS))]
    return data[: place.start()] + word + data[place.end() :]


DAMAGES = (flip, cut, repeat, recount)


def odd_points(rng):
    """Points that are no wall, or hardly."""
    points = wall(rng)
    kind = int(rng.integers(10))
    if kind == 0:
        return points[:, : int(rng.integers(0, 5))]
    if kind == 1:
        return np.repeat(points[:, :1], 500, axis=1)
    if kind == 2:
        return np.outer([1.0, 2.0, 3.0], np.linspace(0, 1, 500))
    if kind == 3:
        return points * rng.choice([1e-30, 1e-9, 1e4, 1e15, 1e30])
    if kind == 4:
        return points + rng.choice([1e4, 1e7, 1e12, 1e25])
    if kind == 5:
        return np.round(points)
    if kind == 6:
        return np.concatenate([points, 1e30 * rng.normal(size=(3, 40))], axis=1)
    if kind == 7:
        return np.concatenate([points, points, points], axis=1)
    for _ in range(int(rng.integers(1, 2000))):
        points[rng.integers(3), rng.integers(points.shape[1])] = rng.choice(NUMBERS)
    return points


def odd_array(rng):
    """An array of the wrong type or shape."""
    kind = int(rng.integers(9))
    points = wall(rng)
    values = (
        points.astype(complex),
        points > 0,
        points.astype(np.float16),
        np.full((300, 3), np.iinfo(np.int64).max),
        points.reshape(3, 2, -1),
        points.ravel(),
        np.zeros((0, 3)),
        np.array([["a", "b", "c"]] * 200),
        np.zeros(200, dtype=[("x", "f4"), ("y", "f4"), ("z", "f4")]),
    )
    return array(values[kind])


def depth_image(rng, folder):
    """A depth image and a camera, one of them wrong."""
    depth = np.full((24, 32), 900, dtype=np.uint16)
    depth[8:12, 10:20] = rng.integers(0, 65536)
    stream = io.BytesIO()
    Image.fromarray(depth).save(stream, format="PNG")
    data, camera = stream.getvalue(), dict(CAMERA)
    if rng.random() < 0.5:
        data = DAMAGES[rng.integers(3)](data, rng)
    else:
        name = str(
            rng.choice([*CAMERA, "depth_scale_m_per_unit", "distortion_k1k2p1p2k3"])
        )
        camera[name] = WRONG[rng.integers(len(WRONG))]
    (folder / "depth.png").write_bytes(data)
    words = json.dumps(camera).encode()
    if rng.random() < 0.2:
        words = flip(words, rng)
    (folder / "intrinsics.json").write_bytes(words)
    return folder / "depth.png"


def make(seed, folder):
    """Makes the recording of a seed; returns its path and what it is."""
    rng = np.random.default_rng(seed)
    share = rng.random()
    if share < 0.12:
        return depth_image(rng, folder), "depth image"
    if share < 0.2:
        (folder / "odd.npy").write_bytes(odd_array(rng))
        return folder / "odd.npy", "odd array"
    name = str(rng.choice(list(FILES)))
    with np.errstate(all="ignore"):
        if share < 0.45:
            data, what = FILES[name](odd_points(rng), rng), "odd points"
        else:
            damage = DAMAGES[rng.integers(len(DAMAGES))]
            data = damage(FILES[name](wall(rng), rng), rng)
            what = damage.__name__
    (folder / name).write_bytes(data)
    return folder / name, what


def attempt(path, *, fine):
    """Reads and segments, by fine steps or not; returns the outcome."""
    try:
        cloud = read_recording(path)
        found = segment_recorded(
            cloud.p_WQs,
            config=SegmentationConfig(),
            seed=1,
            p_WC=cloud.p_WC,
            fit_cell=True,
            fit_inlier_distance=True,
            fine=fine,
        )
        json.dumps(segmentation_figures(found), allow_nan=False)
        result = found.stages.segmentation
        # A mask is of what was seen, or of tiny gaps in it, on a sound tile frame.
        assert result.X_WT.IsNearlyEqualTo(result.X_WT, 1e-9)
        assert np.isfinite(result.X_WT.GetAsMatrix4()).all()
        assert result.wall_mask.any() and result.wall_mask.shape == result.labels.shape
    except (PainterError, PerceptionError) as error:
        assert error.exit_code in (1, 2) and len(str(error)) > 10
        return type(error).__name__
    return "segmented"


def main(first, last, folder):
    signal.signal(signal.SIGALRM, signal.SIG_DFL)  # A hang ends the process.
    for seed in range(first, last):
        own = Path(folder) / str(seed)
        own.mkdir()
        path, what = make(seed, own)
        print(json.dumps({"seed": seed, "file": path.name, "what": what}), flush=True)
        start = time.perf_counter()
        signal.alarm(TIMEOUT)
        outcome = attempt(path, fine=seed % 2 == 1)
        signal.alarm(0)
        seconds = time.perf_counter() - start
        print(json.dumps({"seed": seed, "outcome": outcome, "s": round(seconds, 2)}))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    print(json.dumps({"peak_bytes": peak}), flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), sys.argv[3])
