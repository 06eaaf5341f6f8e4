"""What a run has left undone, and the film that it is gone on with on."""

import numpy as np
import pytest

from painter.errors import InputError
from painter.planning.film.film_model import margin_cells
from painter.run.figures.film_on_tile import film_around
from painter.run.figures.predicted_film import run_preview
from painter.run.figures.unfinished import rest_of_run


def test_rest_of_a_stopped_run_begins_where_the_gun_closed(full_folder, program):
    full_folder.log(60.0, "stopped", cause="operator", next_stroke=5.25)
    dut = rest_of_run(full_folder)
    assert len(dut.strokes) == len(program.strokes) - 4
    broken = program.strokes[4]
    begin = 0.75 * broken.start_T + 0.25 * broken.end_T
    np.testing.assert_allclose(dut.strokes[0].start_T, begin, atol=1e-9)
    np.testing.assert_allclose(dut.strokes[0].end_T, broken.end_T, atol=1e-9)
    assert dut.segmentation.wall_mask.shape == (200, 200)


@pytest.mark.parametrize(
    ("stop", "text"),
    [
        (None, "was not stopped"),
        ({}, "stopped before it painted"),
        ({"next_stroke": 1000.0}, "had made all of its strokes"),
    ],
)
def test_a_run_of_which_nothing_is_left_is_refused(full_folder, stop, text):
    if stop is not None:
        full_folder.log(60.0, "stopped", cause="operator", **stop)
    with pytest.raises(InputError, match=text):
        rest_of_run(full_folder)


def test_a_run_without_film_names_the_file(started_folder, segmentation):
    with pytest.raises(InputError, match=r"film\.npz: no such file"):
        film_around(started_folder, segmentation)


def test_film_is_seen_where_it_lies(full_folder, film, segmentation):
    # S is T here; the film's grid begins 0.1 m before the tile's.
    thickness = np.zeros(film.thickness.shape)
    thickness[10 + 30, 10 + 50] = 1.0
    dut = film_around(full_folder, segmentation, thickness)
    border = margin_cells(0.01)
    assert np.argwhere(dut > 0.5).tolist() == [[border + 30, border + 50]]


def test_what_the_operator_left_out_does_not_count_as_bare(full_folder, program):
    scenario = full_folder.scenario()
    kept = [s for s in program.strokes if s.start_T[0] < 1.0]
    half = program.replace(strokes=tuple(kept))
    bare = run_preview(full_folder, half, scenario).figures.coverage
    scenario["raster"]["zones"] = [{"kind": "include", "corners": [[0, 0], [1, 2]]}]
    asked = run_preview(full_folder, half, scenario).figures.coverage
    assert bare < 0.6
    assert asked > 0.9


def test_preview_of_a_run_gone_on_with_counts_what_was_there(
    full_folder, program, film
):
    scenario = full_folder.scenario()
    alone = run_preview(full_folder, program, scenario)
    full_folder.save_film(film.replace(before=np.full(film.thickness.shape, 1e-5)))
    after = run_preview(full_folder, program, scenario)
    np.testing.assert_allclose(after.film, alone.film + 1e-5, atol=1e-9)
