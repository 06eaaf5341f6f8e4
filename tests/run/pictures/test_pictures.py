"""Pictures: what is drawn where; how they look is checked by eye."""

import numpy as np
import pytest

from painter.planning.spray_path import SkippedStroke
from painter.run.folder.values import Film
from painter.run.pictures import charts, pictures, style


def test_depth_image_shows_the_nearest_point_of_a_cell():
    p_TQs = np.array([[0.05, 0.05, 0.95], [0.05, 0.05, 0.95], [0.01, 0.03, -0.02]])
    image = pictures.depth_image(p_TQs, (1.0, 1.0), 0.1)
    assert image.shape == (10, 10)
    assert image[0, 0] == 0.03
    assert image[9, 9] == -0.02
    assert np.isnan(image[5, 5])


def test_depth_image_closes_single_gaps_only():
    p_TQs = np.array([[0.05, 0.25], [0.05, 0.05], [0.0, 0.0]])
    image = pictures.depth_image(p_TQs, (1.0, 0.1), 0.1)
    np.testing.assert_array_equal(np.isfinite(image[0]), [1, 1, 1, 1] + 6 * [0])


def test_points_beside_the_tile_are_left_out():
    p_TQs = np.array([[-0.01, 0.5], [0.5, 1.01], [0.0, 0.0]])
    assert np.isnan(pictures.depth_image(p_TQs, (1.0, 1.0), 0.1)).all()


def test_mask_picture_names_the_areas_right_and_wrong(segmentation):
    truth = segmentation.wall_mask.copy()
    truth[:10, :10] = False
    truth[100, 70:80] = True
    figure = pictures.mask_picture(segmentation, truth)
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "keep-out taken for wall: 0.010 m²" in texts
    assert "wall missed: 0.001 m²" in texts


def test_label_picture_names_areas_and_what_was_not_seen(segmentation):
    labels = segmentation.labels.copy()
    labels[:10, :10] = 0
    figure = pictures.label_picture(segmentation.replace(labels=labels))
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert texts == ["1: 3.470 m²", "2: 0.480 m²", "3: 0.040 m²", "not seen: 0.010 m²"]


def test_stroke_picture_draws_every_stroke_and_way(program, segmentation):
    axes = pictures.stroke_picture(program, segmentation).axes[0]
    drawn = {tuple(map(tuple, line.get_xydata())) for line in axes.lines}
    for stroke in program.strokes:
        assert (tuple(stroke.start_T), tuple(stroke.end_T)) in drawn
    for before, after in zip(program.strokes, program.strokes[1:], strict=False):
        assert (tuple(before.end_T), tuple(after.start_T)) in drawn


def test_stroke_picture_names_what_was_left_out(program, segmentation):
    *kept, last = program.strokes
    skipped = SkippedStroke(last, "out of reach")
    dut = program.replace(strokes=tuple(kept), skipped=(skipped,))
    figure = pictures.stroke_picture(dut, segmentation)
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "left out: 1, 2.0 m" in texts


@pytest.mark.parametrize("value", [0.0, 2e-4])
def test_film_pictures_of_even_film_draw(film, value):
    even = np.full(film.thickness.shape, value)
    blank = np.ones(even.shape, bool)
    dut: Film = film.replace(
        thickness=even, truth_paintable=blank, truth_keepout=~blank
    )
    for figure in (
        pictures.film_picture(dut, 1e-4),
        charts.film_histogram(dut, 1e-4, 0.25),
    ):
        assert style.png(figure, dpi=40).startswith(b"\x89PNG")


def test_timeline_writes_moving_and_computing_of_a_phase():
    events = [
        {"time": 0.0, "phase": "LOOK"},
        {"time": 3.0, "event": "stage", "stage": "wall_finder", "compute_s": 0.4},
        {"time": 3.0, "phase": "DONE"},
    ]
    axes = charts.timeline(events).axes[0]
    texts = [text.get_text() for text in axes.texts]
    assert texts == ["3.0 s + computing 0.4 s", ""]
    assert [label.get_text() for label in axes.get_yticklabels()] == ["LOOK", "DONE"]
