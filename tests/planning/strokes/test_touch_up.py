"""A touch-up sprays what is thin and nothing else."""

import numpy as np
import pytest

from painter.errors import ReachError
from painter.planning.config import MotionConfig, RasterConfig, TipConfig
from painter.planning.film.deposition import best_pitch, mean_film, predicted_film
from painter.planning.film.film_model import Site
from painter.planning.program.program import strokes_from
from painter.planning.spray_path import Stroke
from painter.planning.strokes.spray_settings import SpraySettings
from painter.planning.strokes.touch_up import touch_up_strokes
from painter.planning.tile import cell_centres
from painter.planning.zones import marked_cells

TIP, RASTER = TipConfig(), RasterConfig()
SPRAY = SpraySettings(TIP, RASTER)
SHAPE, CELL = (200, 200), 0.01
WALL = np.ones(SHAPE, dtype=bool)
PITCH = best_pitch(TIP, RASTER.standoff)
NOMINAL = mean_film(TIP, speed=RASTER.speed, pitch=PITCH)
PATCH = (slice(90, 110), slice(90, 110))  # 20 x 20 cm.


def even_film():
    """A raster that reaches beyond the tile on all sides."""
    lines = np.arange(-1, 17) * PITCH
    strokes = [
        Stroke(np.array([x, -0.2]), np.array([x, 2.2]), 0.6, "body", 0) for x in lines
    ]
    return predicted_film(strokes, *cell_centres(SHAPE, CELL), tip=TIP)


def touch_up(film, paintable=WALL, height=None):
    """Strokes, and the film on the tile once they are sprayed, by the closed form."""
    site = Site.of_tile(paintable, CELL, height)
    around = np.pad(film, site.border, mode="edge")
    strokes = touch_up_strokes(around, site, SPRAY, nominal=NOMINAL)
    return strokes, film + predicted_film(
        sorted(strokes, key=lambda s: s.start_T[0]),
        *cell_centres(SHAPE, CELL),
        tip=TIP,
    )


def test_even_film_needs_no_touch_up():
    assert touch_up(even_film())[0] == ()


@pytest.mark.parametrize("corner", [(90, 90), (13, 57), (150, 101)])
def test_cleared_patch_is_mended_without_doubling_film_elsewhere(corner):
    film = even_film()
    row, column = corner
    patch = (slice(row, row + 20), slice(column, column + 20))
    film[patch] = 0.0
    strokes, touched_up = touch_up(film)
    assert strokes
    assert np.mean(touched_up[patch] >= 0.8 * NOMINAL) >= 0.95
    assert np.mean(touched_up >= 1.5 * NOMINAL) <= 0.01
    # Strokes stay within the fan's reach of the patch.
    away = np.ones(SHAPE, dtype=bool)
    away[row - 6 : row + 26, column - 8 : column + 28] = False
    np.testing.assert_array_equal(touched_up[away], film[away])


def test_film_half_gone_is_filled_by_half():
    film = even_film()
    film[PATCH] *= 0.5
    _, touched_up = touch_up(film)
    assert touched_up[PATCH].mean() == pytest.approx(NOMINAL, rel=0.1)


def test_large_gap_is_filled_with_the_wide_fan():
    film = even_film()
    film[:, :120] = 0.0
    strokes, touched_up = touch_up(film)
    wide = [stroke for stroke in strokes if stroke.standoff == RASTER.standoff]
    # Near strokes fill only what is left between those of the wide fan.
    assert sum(s.length for s in wide) > 0.6 * sum(s.length for s in strokes)
    assert np.mean(touched_up[:, 12:110] >= 0.8 * NOMINAL) > 0.97


def test_keepouts_and_soft_edges_are_no_reason_to_spray():
    film = even_film()
    paintable = WALL.copy()
    paintable[60:120, 60:120] = False
    film[60:120, 60:120] = 0.0  # A window.
    film[50:150, 58:60] *= 0.6  # Beside it, a strip of 2 cm.
    assert touch_up(film, paintable)[0] == ()


def test_spot_beside_a_box_is_mended_from_where_the_gun_clears_it():
    film, paintable, height = even_film(), WALL.copy(), np.zeros(SHAPE)
    box = (slice(90, 110), slice(110, 120))
    paintable[box], height[box] = False, 0.08
    film[PATCH] = 0.0
    strokes, _ = touch_up(film, paintable, height)
    beside = [stroke for stroke in strokes if stroke.start_T[0] > 1.04]
    assert beside
    # The gun's front keeps 5 cm over the box where its half width reaches it.
    assert min(stroke.standoff for stroke in beside) >= 0.13


def test_film_on_another_grid_is_refused():
    site = Site.of_tile(WALL, CELL)
    with pytest.raises(ValueError, match=r"got \(200, 200\)"):
        touch_up_strokes(even_film(), site, SPRAY, nominal=NOMINAL)


def test_mark_is_a_rectangle_or_a_polygon():
    box = marked_cells([[0.5, 0.4], [0.7, 0.6]], SHAPE, CELL)
    assert box.sum() == 400
    assert box[40:60, 50:70].all()
    triangle = marked_cells([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], SHAPE, CELL)
    assert triangle.sum() * CELL**2 == pytest.approx(0.5, abs=0.01)
    with pytest.raises(ValueError, match="2 or more corners"):
        marked_cells([[0.5, 0.4]], SHAPE, CELL)


def test_touch_up_is_a_program_that_the_arm_can_do(robot, make_wall):
    film = even_film()
    film[PATCH] = 0.0
    strokes, _ = touch_up(film)
    home = np.deg2rad(MotionConfig().home_deg)
    dut = robot.planner(tip=TIP, raster=RASTER).program(strokes, make_wall(), home)
    assert len(dut.strokes) == len(strokes)
    assert dut.skipped == ()
    assert sorted(dut.motion.flow) == sorted(stroke.flow for stroke in strokes)


def test_a_touch_up_sprays_what_is_in_reach_and_reports_the_rest(robot, make_wall):
    """A stroke 2.5 m up is out of reach, whatever else is in reach."""
    near, far = (
        Stroke(np.array([1.0, low]), np.array([1.0, low + 0.2]), 0.6, "touch_up", 0)
        for low in (1.0, 2.5)
    )
    home = np.deg2rad(MotionConfig().home_deg)
    planner = robot.planner(tip=TIP, raster=RASTER)
    dut = planner.program([near, far], make_wall(), home)
    assert len(dut.strokes) == 1
    assert sum(item.stroke.length for item in dut.skipped) == pytest.approx(far.length)
    with pytest.raises(ReachError, match="strokes: 100 % (of it )?is out of reach"):
        planner.program([far], make_wall(), home)
    # A job of these strokes stands in the wrong place: half of it cannot be done.
    job = [stroke.replace(kind="body") for stroke in (near, far)]
    with pytest.raises(ReachError, match="strokes: 50 % (of it )?is out of reach"):
        planner.program(job, make_wall(), home)


@pytest.mark.parametrize("stopped_at", [1.7, 6.25, 15.9])
def test_a_job_stopped_and_resumed_leaves_the_film_of_one_that_was_not(stopped_at):
    whole = [
        Stroke(np.array([x, 0.0]), np.array([x, 2.0]), 0.6, "body", number)
        for number, x in enumerate((np.arange(16) + 0.5) * PITCH)
    ]
    rest = strokes_from(whole, stopped_at)
    first = whole[: int(stopped_at) - 1]
    broken = whole[int(stopped_at) - 1]
    # What was sprayed of the broken stroke ends where the rest of it begins.
    begun = broken.replace(end_T=rest[0].start_T)
    x, y = cell_centres(SHAPE, CELL)
    expected = predicted_film(whole, x, y, tip=TIP)
    film = predicted_film([*first, begun], x, y, tip=TIP)
    film = film + predicted_film(rest, x, y, tip=TIP)
    np.testing.assert_allclose(film, expected, atol=1e-9 * NOMINAL)
    share = (stopped_at % 1.0) * broken.length
    assert begun.length == pytest.approx(share)
