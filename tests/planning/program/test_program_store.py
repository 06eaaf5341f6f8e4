"""Programs come back from disk as they were; bad files are named."""

import json

import numpy as np
import pytest
from pydrake.math import RigidTransform

from painter.errors import InputError
from painter.planning.program.store import load_program, program_summary, save_program
from painter.planning.spray_path import Motion, PaintProgram, SkippedStroke, Stroke


def stroke(x, y0, y1):
    return Stroke(np.array([x, y0]), np.array([x, y1]), 0.5, "body", 3)


@pytest.fixture
def program():
    time = np.linspace(0.0, 4.0, 9)
    q = np.outer(np.sin(time), np.ones(5))
    return PaintProgram(
        strokes=(
            stroke(0.1, 0.0, 1.0),
            stroke(0.3, 1.0, 0.5).replace(standoff=0.1, flow=0.25, coat=2),
        ),
        motion=Motion(time, q, np.cos(q), np.array([[0.4, 1.6], [2.5, 3.5]])),
        X_WT=RigidTransform([1.0, 2.0, 3.0]),
        standoff=0.3,
        nominal_thickness=1.2e-4,
        paint_volume=4.5e-5,
        skipped=(SkippedStroke(stroke(0.3, 0.5, 0.25), "no room"),),
    )


def test_round_trip(program, tmp_path):
    save_program(tmp_path, program)
    back = load_program(tmp_path)
    for a, b in zip(program.strokes, back.strokes, strict=True):
        np.testing.assert_array_equal([a.start_T, a.end_T], [b.start_T, b.end_T])
        assert (a.speed, a.kind, a.column) == (b.speed, b.kind, b.column)
        assert (a.standoff, a.flow, a.coat) == (b.standoff, b.flow, b.coat)
    for name in ("time", "q", "v", "spray_on"):
        np.testing.assert_array_equal(
            getattr(program.motion, name), getattr(back.motion, name)
        )
    assert back.X_WT.IsExactlyEqualTo(program.X_WT)
    assert back.skipped[0].reason == "no room"
    assert back.paint_volume == program.paint_volume
    assert {path.name for path in tmp_path.iterdir()} == {
        "program.json",
        "trajectory.npz",
    }


def test_files_hold_what_the_design_says(program, tmp_path):
    save_program(tmp_path, program)
    with np.load(tmp_path / "trajectory.npz") as file:
        assert file["q"].shape == (9, 5)
        # Samples every 0.5 s; open over [0.4, 1.6) and [2.5, 3.5).
        assert file["trigger"].tolist() == [0, 1, 1, 1, 0, 1, 1, 0, 0]
    first = json.loads((tmp_path / "program.json").read_text())["strokes"][0]
    assert first["start"] == [0.1, 0.0]
    assert first["trigger_on"] == 0.4


def test_summary_adds_up(program):
    summary = program_summary(program)
    assert summary["stroke_length"] == pytest.approx(1.5)
    assert summary["skipped_length"] == pytest.approx(0.25)
    assert summary["paint_litres"] == pytest.approx(0.045)
    assert summary["duration"] == 4.0


def test_missing_damaged_and_foreign_files_are_named(program, tmp_path):
    with pytest.raises(InputError, match=r"program\.json: No such file"):
        load_program(tmp_path)
    save_program(tmp_path, program)
    content = (tmp_path / "trajectory.npz").read_bytes()
    (tmp_path / "trajectory.npz").write_bytes(content[:100])
    with pytest.raises(InputError, match=r"trajectory\.npz: not a readable"):
        load_program(tmp_path)
    (tmp_path / "program.json").write_text("{}")
    with pytest.raises(InputError, match=r"program\.json: field 'strokes' is missing"):
        load_program(tmp_path)
    (tmp_path / "program.json").write_text("{")
    with pytest.raises(InputError, match=r"program\.json: is not a paint program"):
        load_program(tmp_path)
