"""No file, however damaged or odd, gives anything but an answer or a clear error."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from perception.config import SegmentationConfig
from perception.errors import PerceptionError
from perception.io.clouds import CLOUD_SUFFIXES, read_cloud
from perception.recorded.segment_recorded import segment_recorded

WORKER = Path(__file__).with_name("bad_files.py")
MOST_MEMORY = 4 * 2**30
# With Python, Drake and their threads' stacks, address space is not memory in use.
BOUNDED = (
    "import resource, runpy, sys; "
    f"resource.setrlimit(resource.RLIMIT_DATA, ({MOST_MEMORY},) * 2); "
    "sys.argv = sys.argv[1:]; runpy.run_path(sys.argv[0], run_name='__main__')"
)


def outcomes(first, last, folder):
    """Runs the recordings of these seeds; returns their outcomes by seed."""
    words = [sys.executable, "-W", "error::RuntimeWarning", "-c", BOUNDED]
    words += [str(WORKER), str(first), str(last), str(folder)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=280)
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    assert done.returncode == 0, (lines[-1:], done.stderr[-2000:])
    assert lines[-1]["peak_bytes"] < MOST_MEMORY
    return {line["seed"]: line["outcome"] for line in lines if "outcome" in line}


def check(found, first, last):
    assert sorted(found) == list(range(first, last))
    # The damage is neither always fatal nor always harmless.
    kinds = set(found.values())
    assert {"segmented", "CloudReadError"} <= kinds


def test_bad_recordings_are_answered_or_refused(tmp_path):
    check(outcomes(0, 40, tmp_path), 0, 40)


@pytest.mark.slow
@pytest.mark.parametrize("first", range(40, 500, 115))
def test_many_bad_recordings_are_answered_or_refused(tmp_path, first):
    check(outcomes(first, first + 115, tmp_path), first, first + 115)


floats = st.floats(width=32) | st.sampled_from([1e30, -1e30, np.nan, np.inf, 0.0])


@settings(max_examples=40, deadline=None)
@given(
    extra=arrays.arrays(
        np.float64, st.tuples(st.just(3), st.integers(0, 150)), elements=floats
    ),
    copies=st.integers(0, 60),
)
def test_any_points_are_answered_or_refused(extra, copies):
    rng = np.random.default_rng(0)
    plane = np.concatenate(
        [rng.uniform(-1, 1, (2, 20 * copies)), np.ones((1, 20 * copies))]
    )
    points = np.concatenate([plane, extra], axis=1)
    try:
        found = segment_recorded(
            points,
            config=SegmentationConfig(cell=0.05),
            seed=1,
            fit_inlier_distance=True,
        )
    except PerceptionError:
        return
    result = found.stages.segmentation
    assert result.wall_mask.any()
    assert np.isfinite(result.X_WT.GetAsMatrix4()).all()


@settings(max_examples=150, deadline=None)
@given(suffix=st.sampled_from(CLOUD_SUFFIXES), data=st.binary(max_size=400))
def test_any_bytes_are_refused_or_points(tmp_path_factory, suffix, data):
    heads = {".ply": b"ply\n", ".npy": b"\x93NUMPY\x01\x00", ".npz": b"PK\x03\x04"}
    path = tmp_path_factory.mktemp("any") / f"any{suffix}"
    path.write_bytes(heads.get(suffix, b"") + data)
    try:
        cloud = read_cloud(path)
    except PerceptionError as error:
        assert str(path) in str(error)
    else:
        assert cloud.p_WQs.shape[0] == 3 and np.isfinite(cloud.p_WQs).any()
