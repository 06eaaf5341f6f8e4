"""Whole paint cycles by scene, against the bounds of the README.

`cubes` runs with `make test`, the others with `make test-all`.
"""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from painter.cli.main import run
from painter.run.folder.folder import FILES, INCOMPLETE

# The seed 1 of DESIGN's "random" with the five named scenes.
SCENES = ["cubes", "obstacles", "terrace", "room", "blank", "random"]
OPTIONAL = {"look.png"}
pytestmark = pytest.mark.timeout(1800)


@pytest.fixture(scope="session")
def runs(tmp_path_factory) -> dict[str, Path]:
    """Run folders by scene; filled by `simulate`."""
    return {}


def simulate(scene: str, runs: dict[str, Path], tmp_path_factory) -> dict:
    """Simulates a scene once a session and returns its figures."""
    if scene not in runs:
        out = tmp_path_factory.mktemp("runs") / scene
        assert run(["simulate", scene, "--seed", "1", "--out", str(out)]) == 0
        runs[scene] = out
    return json.loads((runs[scene] / "report.json").read_text())


@pytest.mark.parametrize(
    "scene",
    [pytest.param(s, marks=[] if s == "cubes" else pytest.mark.slow) for s in SCENES],
)
def test_scene_is_painted_within_its_figures(scene, runs, tmp_path_factory):
    figures = simulate(scene, runs, tmp_path_factory)
    assert figures["result"] == "DONE"
    assert figures["mask_iou"] >= 0.95
    assert figures["collisions"] == 0
    assert figures["coverage"] >= (0.95 if scene == "blank" else 0.85)
    assert figures["overspray"] <= 0.10
    assert figures["mass_balance_error"] <= 0.001
    assert figures["timing"]["cycle_time_s"] <= 150.0
    assert figures["tip_error_rms_m"] <= 0.002
    assert figures["gun_angle_error_max_deg"] <= 1.0


def test_run_folder_is_whole(runs, tmp_path_factory):
    simulate("cubes", runs, tmp_path_factory)
    present = {path.name for path in runs["cubes"].iterdir()}
    assert set(FILES) - OPTIONAL <= present
    assert INCOMPLETE not in present


@pytest.mark.slow
def test_same_seed_gives_the_same_report(runs, tmp_path_factory):
    """In a process of its own, so that nothing of the first run is left over."""
    first = simulate("cubes", runs, tmp_path_factory)
    out = tmp_path_factory.mktemp("runs") / "again"
    painter = Path(sys.executable).with_name("painter")
    words = ["simulate", "cubes", "--seed", "1", "--no-replay", "--out", str(out)]
    subprocess.run([painter, *words], check=True)
    second = json.loads((out / "report.json").read_text())
    for figures in (first, second):
        del figures["timing"]
    assert first == second


def test_wall_out_of_reach_fails_with_its_cause(tmp_path, capsys):
    """The wall is found where it should be, but no arm reaches its far corners."""
    out = tmp_path / "far"
    words = ["--set", "tile.distance=1.5", "--no-replay"]
    assert run(["simulate", "blank", "--out", str(out), *words]) == 1
    message = capsys.readouterr().err
    assert "reach" in message
    # The same code everywhere.
    figures = json.loads((out / "report.json").read_text())
    events = [json.loads(line) for line in (out / "events.jsonl").open()]
    (stop,) = (event for event in events if event.get("event") == "stopped")
    assert figures["code"] == stop["code"]
    assert figures["cause"] == stop["cause"]
    for text in (message, (out / INCOMPLETE).read_text()):
        assert f"[{figures['code']}]" in text
