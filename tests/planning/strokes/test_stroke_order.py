"""Orders of strokes: never worse, the best where all can be tried, nothing lost."""

import itertools

import numpy as np
import pytest

from painter.planning.spray_path import Stroke
from painter.planning.strokes.stroke_order import (
    order_strokes,
    reversed_stroke,
    transition_time,
)

HOME = np.array([1.0, 1.0, 0.5])


def stroke(x, y0, y1, column=0, **fields):
    return Stroke(
        start_T=np.array([x, y0]),
        end_T=np.array([x, y1]),
        speed=0.6,
        kind="body",
        column=column,
        **fields,
    )


def scattered(seed, count):
    rng = np.random.default_rng(seed)
    return [
        stroke(x, y, y + length, column)
        for column, (x, y, length) in enumerate(
            rng.uniform([0.1, 0.1, 0.1], [1.9, 1.2, 0.7], (count, 3))
        )
    ]


def line_by_line(strokes):
    """Strokes by column, up and down in turn; all of `strokes` go up."""
    by_column = sorted(strokes, key=lambda s: s.column)
    return [reversed_stroke(s) if k % 2 else s for k, s in enumerate(by_column)]


def spans(strokes):
    """Strokes without their direction and order."""
    return sorted(
        (float(s.start_T[0]), *sorted([float(s.start_T[1]), float(s.end_T[1])]))
        for s in strokes
    )


@pytest.mark.parametrize("seed", range(4))
def test_few_strokes_come_close_to_the_best_of_all_orders(seed):
    strokes = scattered(seed, 5)
    best = min(
        transition_time(
            [s if up else reversed_stroke(s) for s, up in zip(each, ups, strict=True)],
            HOME,
            HOME,
        )
        for each in itertools.permutations(strokes)
        for ups in itertools.product((True, False), repeat=5)
    )
    dut = order_strokes(strokes, HOME, HOME)
    assert spans(dut) == spans(strokes)
    assert transition_time(dut, HOME, HOME) <= 1.1 * best


def test_order_is_never_worse_than_the_given_one():
    strokes = line_by_line(scattered(9, 30))
    dut = order_strokes(strokes, HOME, HOME)
    assert spans(dut) == spans(strokes)
    assert transition_time(dut, HOME, HOME) <= transition_time(strokes, HOME, HOME)


def test_reversing_everything_takes_as_long():
    strokes = scattered(3, 6)
    back = [reversed_stroke(s) for s in reversed(strokes)]
    assert transition_time(back, HOME, HOME) == pytest.approx(
        transition_time(strokes, HOME, HOME)
    )


def test_u_turn_takes_the_time_of_a_full_reversal():
    up, down = stroke(0.5, 0.2, 1.2), stroke(0.6, 1.2, 0.2)
    rests = np.array([0.5, 0.2, 0.3]), np.array([0.6, 0.2, 0.3])
    # From rest to 0.6 m/s at the same place: back and forth at 2.5 m/s², twice; and
    # from 0.6 m/s up to 0.6 m/s down. Time = (2 peak + v) / a, peak = v / sqrt(2).
    ends = 2.0 * (2.0 / np.sqrt(2.0) + 1.0) * 0.6 / 2.5
    assert transition_time([up, down], *rests) == pytest.approx(ends + 2.0 * 0.6 / 2.5)


def test_strokes_that_go_on_stay_together():
    parts = [stroke(0.5, 0.2, 0.9), stroke(0.5, 0.9, 1.1, flow=0.5)]
    dut = order_strokes([parts[0], stroke(1.2, 0.3, 1.0, 1), parts[1]], HOME, HOME)
    columns = [s.column for s in dut]
    assert columns in ([0, 0, 1], [1, 0, 0])


def test_lines_go_up_and_down_in_turn():
    rests = np.array([0.2, 0.0, 0.3]), np.array([0.4, 0.0, 0.3])
    lines = [stroke(0.2, 0.0, 1.0, 0), stroke(0.4, 0.0, 1.0, 1)]
    dut = order_strokes(lines, *rests)
    assert [float(np.sign((s.end_T - s.start_T)[1])) for s in dut] == [1.0, -1.0]


def test_no_strokes_no_order():
    assert order_strokes([], HOME, HOME) == ()
