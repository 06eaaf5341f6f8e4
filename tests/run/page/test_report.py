"""The report of a whole run made from geometry, and of runs that broke off."""

import json
import re

import pytest

from painter.errors import InputError
from painter.run.folder import folder as files
from painter.run.page.catalog import FIGURES, figure_info
from painter.run.page.report import finish_run, write_report

DESIGN_NAMES = {
    "motion_time_s",
    "phase_time_s",
    "mask_iou",
    "mask_edge_error_median_m",
    "mask_edge_error_p95_m",
    "coverage",
    "coverage_half",
    "thickness_cv",
    "thickness_cv_interior",
    "overspray",
    "keepout_paint",
    "mass_balance_error",
    "tip_error_rms_m",
    "tip_error_max_m",
    "gun_angle_error_max_deg",
    "speed_within_2pct",
    "collisions",
    "truth_source",
}
DESIGN_TIMING = {"compute_time_s", "cycle_time_s", "wall_clock_s", "realtime_factor"}


def finish(folder, wall_clock=90.0):
    return finish_run(folder, time=113.0, result="DONE", wall_clock=wall_clock)


def page_of(folder):
    return (folder.path / files.PAGE).read_text()


def test_finished_run_is_complete_with_all_figures_of_the_design(full_folder):
    figures = finish(full_folder)
    assert full_folder.is_complete
    assert json.loads((full_folder.path / files.REPORT).read_text()) == figures
    assert figures.keys() >= DESIGN_NAMES
    assert figures["timing"].keys() >= DESIGN_TIMING


def test_figures_are_those_built_into_the_run(full_folder):
    figures = finish(full_folder)
    assert (figures["scene"], figures["seed"]) == ("cubes", 1)
    assert figures["result"] == "DONE"
    assert figures["motion_time_s"] == 113.0
    assert figures["timing"]["compute_time_s"] == pytest.approx(4.0)
    assert figures["timing"]["cycle_time_s"] == pytest.approx(117.0)
    # The truth is the mask itself: tile 2 x 2 m less window and box.
    assert figures["mask_iou"] == 1.0
    assert figures["mask_area_m2"] == pytest.approx(4.0 - 0.6 * 0.8 - 0.2 * 0.2)
    assert figures["tip_error_rms_m"] == pytest.approx(0.001)
    assert figures["speed_within_2pct"] == 1.0
    assert figures["mass_balance_error"] == pytest.approx(0.0, abs=1e-9)
    assert figures["stroke_length_m"] == pytest.approx(16 * 2.0 - 5 * 0.8 - 2 * 0.2)
    # (1 - u²)² at a pitch of a: 1 to 1.067, less what is smeared at ends of strokes.
    assert figures["thickness_cv_interior"] < 0.06
    assert figures["collisions"] == 0


def test_only_timing_depends_on_the_clock(full_folder):
    slow = finish(full_folder, wall_clock=90.0)
    fast = finish(full_folder, wall_clock=45.0)
    assert slow.pop("timing") != fast.pop("timing")
    assert json.dumps(slow) == json.dumps(fast)


def test_page_stands_alone(full_folder):
    finish(full_folder)
    page = page_of(full_folder)
    # Map, regions, mask, strokes, film, film as planned, histogram, timeline, tracking.
    assert page.count("data:image/png;base64,") == 9
    assert not re.search(r'(?:src|href)="(?!data:)', page)
    assert "<script" not in page
    for info in FIGURES:
        assert info.name in page
    assert "not complete" not in page


def test_page_links_to_the_replay_that_is_there(full_folder):
    (full_folder.path / files.SCENE).write_text("")
    finish(full_folder)
    assert 'href="scene.html"' in page_of(full_folder)


def test_collisions_are_counted_from_the_log(full_folder):
    full_folder.log(50.0, "collision", bodies=["forearm", "wall"], distance=0.01)
    figures = finish(full_folder)
    assert figures["collisions"] == 1
    assert figure_info("collisions").passes(figures) is False


def test_faulty_run_stays_incomplete_and_names_its_cause(
    started_folder, segmentation, truth
):
    folder = started_folder
    folder.log(20.0, "phase", phase="PLAN")
    folder.save_segmentation(segmentation)
    folder.save_truth(truth)
    folder.log(21.0, "phase", phase="FAULT")
    cause = "spray_path_planner: ReachError: stroke 3 <left>"
    figures = finish_run(
        folder,
        time=21.5,
        result="FAULT",
        wall_clock=9.0,
        cause=cause,
        code="PNT-TEST-001",
    )
    assert (figures["cause"], figures["code"]) == (cause, "PNT-TEST-001")
    assert folder.events()[-1]["code"] == "PNT-TEST-001"
    assert figures["mask_iou"] == 1.0
    assert "coverage" not in figures
    assert not folder.is_complete
    assert (folder.path / files.INCOMPLETE).read_text() == (
        f"FAULT: {cause} [PNT-TEST-001]\n"
    )
    page = page_of(folder)
    assert "not complete: FAULT in PLAN" in page
    assert "ReachError: stroke 3 &lt;left&gt; [PNT-TEST-001]<br>" in page
    # The mask is right, but no target is met by a run that failed.
    assert "✓" not in page


def test_killed_run_is_reported_as_interrupted(started_folder, surface_map):
    started_folder.save_map(surface_map)
    figures = write_report(started_folder)
    assert figures["result"] == "INTERRUPTED"
    assert not started_folder.is_complete
    assert page_of(started_folder).count("data:image/png;base64,") == 2


def test_run_without_truth_has_no_figures_of_truth(full_folder):
    (full_folder.path / files.TRUTH).unlink()
    (full_folder.path / files.FILM).unlink()
    figures = finish(full_folder)
    assert "mask_iou" not in figures
    assert "coverage" not in figures
    assert figures["tip_error_rms_m"] == pytest.approx(0.001)


def test_unreadable_file_leaves_the_old_report(full_folder):
    finish(full_folder)
    before = page_of(full_folder)
    (full_folder.path / files.FILM).write_bytes(b"PK")
    with pytest.raises(InputError, match=r"film\.npz"):
        write_report(full_folder)
    assert page_of(full_folder) == before


def test_targets_are_read_in_the_unit_of_the_page():
    info = figure_info("tip_error_rms_m")
    assert info.target() == "≤ 2 mm"
    assert info.text({"tip_error_rms_m": 0.00123}) == "1.23 mm"
    assert info.passes({"tip_error_rms_m": 0.002}) is True
    assert info.passes({"tip_error_rms_m": 0.0021}) is False
    assert info.passes({}) is None
    assert info.text({}) == "–"
    cycle = figure_info("cycle_time_s")
    assert cycle.text({"timing": {"cycle_time_s": 101.26}}) == "101.3 s"
