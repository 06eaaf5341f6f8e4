"""Strokes on hand-made masks: their ends, their order and what they cover."""

import numpy as np
import pytest

from painter.planning.config import RasterConfig, TipConfig
from painter.planning.film.deposition import best_pitch, mean_film, predicted_film
from painter.planning.strokes.raster import plan_strokes
from painter.planning.strokes.spray_settings import SpraySettings
from painter.planning.strokes.stroke_lines import place_lines, wall_share
from painter.planning.tile import cell_centres

CELL = 0.01
TIP = TipConfig()
LEAD = 0.01
A = 0.125


def raster(**changes):
    return RasterConfig(**({"lead": LEAD, "cut_in": False} | changes))


def wall(*keepouts, width=2.0, height=2.0):
    """A wall with rectangles (x, y, width, height), m, of keep-out."""
    mask = np.ones((round(height / CELL), round(width / CELL)), dtype=bool)
    for x, y, w, h in keepouts:
        rows = slice(round(y / CELL), round((y + h) / CELL))
        mask[rows, round(x / CELL) : round((x + w) / CELL)] = False
    return mask


def plan(mask, **changes):
    return plan_strokes(mask, CELL, SpraySettings(TIP, raster(**changes)))


def columns(strokes):
    return sorted({stroke.column for stroke in strokes})


def spans(strokes, column):
    """Lower and upper end of a column's strokes, bottom to top."""
    own = [s for s in strokes if s.column == column]
    return sorted(tuple(sorted((s.start_T[1], s.end_T[1]))) for s in own)


def pair(mask, strokes, setting):
    """Coverage and overspray by the closed form, off the tile included."""
    margin = 0.2
    border = round(margin / CELL)
    mask = np.pad(mask, border)
    x, y = cell_centres(mask.shape, CELL, margin=margin)
    film = predicted_film(strokes, x, y, tip=TIP)
    width = (mask.shape[1] - 2 * border) * CELL
    pitch = SpraySettings(TIP, setting).nominal_pitch(width)
    nominal = mean_film(TIP, speed=setting.speed, pitch=pitch)
    return np.mean(film[mask] >= 0.8 * nominal), 1.0 - film[mask].sum() / film.sum()


def test_pitch_fills_the_width_with_no_strip_left_over():
    pitch = SpraySettings(TIP, raster()).nominal_pitch(2.0)
    assert pitch == pytest.approx(2.0 / 14)  # 2 / 0.1431 = 13.98 lines.
    assert SpraySettings(TIP, raster(overlap_pitch=0.1)).nominal_pitch(2.0) == 0.1


def test_share_is_one_on_wall_and_half_at_its_edge():
    mask = wall((1.0, 0.0, 1.0, 2.0))
    lines = np.array([0.5, 1.0, 1.5])
    share = wall_share(mask, CELL, lines, tip=TIP, standoff=0.3)
    # Midpoints on 1 cm of a smooth profile 25 cm wide.
    np.testing.assert_allclose(share[0], [1.0, 0.5, 0.0], atol=1e-4)


def test_blank_wall_has_evenly_spaced_full_strokes():
    strokes = plan(wall())
    assert len(strokes) == 14
    x = np.array([s.start_T[0] for s in strokes])
    gaps = np.diff(x)
    # Places are 1/64 of a pitch apart: 2 mm.
    assert np.ptp(gaps) <= 2 * 0.00224
    assert gaps.max() <= 1.02 * best_pitch(TIP, raster().standoff) + 1e-9
    assert x[0] == pytest.approx(2.0 - x[-1], abs=0.005)
    for stroke in strokes:
        ends = sorted((stroke.start_T[1], stroke.end_T[1]))
        assert ends == pytest.approx([-LEAD, 2.0 + LEAD])
        assert stroke.start_T[0] == stroke.end_T[0]
        assert stroke.kind == "body" and stroke.speed == 0.6


def test_strokes_go_up_and_down_in_turn_from_the_left():
    strokes = plan(wall((0.6, 0.7, 0.8, 0.5)))
    order = [s.column for s in strokes]
    assert order == sorted(order)
    upwards = {s.column: s.end_T[1] > s.start_T[1] for s in strokes}
    assert all(
        upwards[column] == (i % 2 == 0) for i, column in enumerate(columns(strokes))
    )
    for column in columns(strokes):
        ys = [
            y for s in strokes if s.column == column for y in (s.start_T[1], s.end_T[1])
        ]
        assert ys == sorted(ys, reverse=not upwards[column])


def test_strokes_stop_at_a_window_and_begin_again_above_it():
    strokes = plan(wall((0.5, 0.6, 1.0, 0.8)))
    middle = min(strokes, key=lambda s: abs(s.start_T[0] - 1.0)).column
    expected = [(-LEAD, 0.6 + LEAD), (1.4 - LEAD, 2.0 + LEAD)]
    np.testing.assert_allclose(spans(strokes, middle), expected, atol=1e-9)
    left = strokes[0].column
    np.testing.assert_allclose(spans(strokes, left), [(-LEAD, 2.0 + LEAD)], atol=1e-9)


def test_a_narrow_stick_does_not_stop_the_gun():
    """4 cm of a 25 cm fan: more than half of the flow lands on wall."""
    strokes = plan(wall((1.0, 0.5, 0.04, 1.0)))
    assert all(len(spans(strokes, c)) == 1 for c in columns(strokes))


def test_keepout_margin_holds_the_strokes_back():
    mask = wall((0.5, 0.6, 1.0, 0.8))
    near = plan(mask, lead=0.0)
    far = plan(mask, lead=0.0, keepout_margin=0.05)
    for strokes, low, high in ((near, 0.6, 1.4), (far, 0.55, 1.45)):
        middle = min(strokes, key=lambda s: abs(s.start_T[0] - 1.0)).column
        np.testing.assert_allclose(
            spans(strokes, middle), [(0.0, low), (high, 2.0)], atol=1e-9
        )


def test_a_gap_too_short_for_the_valve_is_sprayed_over():
    """A board of 4 cm: with leads of 1 cm the gun would close for 2 cm, 33 ms."""
    strokes = plan(wall((0.0, 1.0, 2.0, 0.04)))
    assert all(len(spans(strokes, c)) == 1 for c in columns(strokes))
    strokes = plan(wall((0.0, 1.0, 2.0, 0.06)))
    assert all(len(spans(strokes, c)) == 2 for c in columns(strokes))


def test_strokes_shorter_than_the_shortest_are_dropped():
    mask = wall((0.0, 0.02, 2.0, 0.98))
    strokes = plan(mask)
    assert all(len(spans(strokes, c)) == 1 for c in columns(strokes))
    assert min(s.start_T[1] for s in strokes) == pytest.approx(1.0 - LEAD)


def test_lines_move_to_the_edges_of_a_narrow_door_frame():
    """Wall of 0.3 m between a door and a window wants two lines, symmetric in it."""
    mask = wall((0.2, 0.0, 0.9, 2.0), (1.4, 0.0, 0.6, 2.0))
    lines = place_lines(mask, CELL, SpraySettings(TIP, raster()))
    own = lines[(lines > 1.1) & (lines < 1.4)]
    assert own.size == 2
    assert own.mean() == pytest.approx(1.25, abs=0.005)


def test_a_tile_narrower_than_the_fan_gets_one_line_in_its_middle():
    lines = place_lines(wall(width=0.13), CELL, SpraySettings(TIP, raster()))
    assert lines.tolist() == pytest.approx([0.065], abs=0.002)


def test_nothing_to_paint_means_no_strokes():
    assert plan(np.zeros((200, 200), dtype=bool)) == ()


@pytest.mark.parametrize(
    ("keepouts", "coverage", "overspray"),
    [
        # Better than what painting.md 3.6 reports of an even raster with the same fan:
        # 97.0 % at 3.0 % (blank), 89.9 % at 6.3 % (window and box).
        ((), 0.969, 0.030),
        (((0.5, 0.6, 1.0, 1.2), (1.6, 0.2, 0.2, 0.2)), 0.90, 0.063),
        # Bounds of the README's table, with a margin.
        (
            (
                (0.25, 0.25, 0.1, 0.1),
                (0.85, 0.35, 0.1, 0.1),
                (1.55, 0.30, 0.1, 0.1),
                (0.45, 0.95, 0.1, 0.1),
                (1.15, 1.05, 0.1, 0.1),
                (1.65, 1.45, 0.1, 0.1),
                (0.65, 1.65, 0.1, 0.1),
            ),
            0.92,
            0.05,
        ),
    ],
    ids=["blank", "openings", "cubes"],
)
def test_coverage_and_overspray(keepouts, coverage, overspray):
    mask = wall(*keepouts)
    covered, over = pair(mask, plan(mask), raster())
    assert covered >= coverage
    assert over <= overspray


@pytest.mark.parametrize("bad", [np.ones((3, 3)), np.ones(3, dtype=bool)])
def test_masks_must_be_two_dimensional_bool(bad):
    with pytest.raises(ValueError, match="mask must be 2-D bool"):
        plan(bad)
