"""A job that was stopped, and a film that was damaged, in whole paint cycles."""

import json
from pathlib import Path

import numpy as np
import pytest

from painter.cli.main import run
from painter.run.folder.arrays import load_film
from painter.run.folder.folder import FILM, REPORT

# Five cycles of a minute or two each, on a machine that may have other work.
pytestmark = [pytest.mark.slow, pytest.mark.timeout(1800)]

SCENE = "terrace"  # Its door and window leave no scene more edges to mend along.
# x0, y0, x1, y1 in T, m: 20 x 20 cm of wall between door and window.
PATCH = (1.125, 1.00, 1.325, 1.20)


def simulate(out: Path, *words: str, status: int = 0) -> dict:
    assert run(["simulate", *words, "--no-replay", "--out", str(out)]) == status
    return json.loads((out / REPORT).read_text())


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    out = tmp_path_factory.mktemp("runs") / "whole"
    return out, simulate(out, SCENE)


@pytest.mark.parametrize("result", ["ABORTED", "FAULT"])
def test_a_job_stopped_anywhere_and_resumed_covers_as_much(
    result, undisturbed, tmp_path
):
    _, whole = undisturbed
    rng = np.random.default_rng(5)
    if result == "ABORTED":
        at = rng.uniform(2.0, whole["stroke_count"])
        words = ["--stop-at-stroke", f"{at:.2f}"]
    else:
        phases = whole["phase_time_s"]
        before = sum(time for phase, time in phases.items() if phase != "RETRACT")
        at = before - rng.uniform(0.1, 0.9) * phases["PAINT"]
        words = ["--set", f"arm.faults=[{{time: {at:.2f}, joint: 2}}]"]
    stopped = simulate(tmp_path / "stopped", SCENE, *words, status=1)
    assert stopped["result"] == result
    assert stopped["coverage"] < whole["coverage"] - 0.01
    words = ["--resume", str(tmp_path / "stopped"), "--set", "arm.faults=[]"]
    rest = simulate(tmp_path / "rest", *words)
    assert rest["result"] == "DONE"
    assert rest["collisions"] == 0
    assert rest["coverage"] == pytest.approx(whole["coverage"], abs=0.01)
    assert rest["thickness_cv"] == pytest.approx(whole["thickness_cv"], abs=0.01)
    # What went before is neither lost nor sprayed again.
    assert rest["sprayed_m3"] == pytest.approx(whole["sprayed_m3"], rel=0.01)
    assert rest["mass_balance_error"] <= 0.001


def test_a_cleared_patch_is_mended_and_nothing_is_doubled(undisturbed, tmp_path):
    folder, whole = undisturbed
    mark = ",".join(map(str, PATCH))
    out = tmp_path / "mended"
    mended = simulate(out, "--touch-up", str(folder), "--clear", mark)
    assert mended["collisions"] == 0
    assert mended["coverage"] >= whole["coverage"] - 0.001
    before, after = load_film(folder / FILM), load_film(out / FILM)
    assert after.before is not None
    cleared = after.before < before.thickness - 1e-9
    # The tile stands a little askew before the scene; its area does not change.
    assert cleared.sum() * after.cell**2 == pytest.approx(0.04, rel=0.1)
    nominal = whole["nominal_thickness_m"]
    patch = cleared & after.truth_paintable
    # A column beside the window may be left to what keeps the window clean.
    assert np.mean(after.thickness[patch] >= 0.8 * nominal) >= 0.93
    # No more cells are doubled than an undisturbed film has.
    double = np.mean(after.thickness[after.truth_paintable] >= 1.5 * nominal)
    assert double <= 0.01
    assert mended["mass_balance_error"] <= 0.001
