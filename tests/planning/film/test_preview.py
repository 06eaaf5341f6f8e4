"""The film as planned: its map is that of the strokes, wherever it is sampled."""

import numpy as np
import pytest

from painter.planning.config import TipConfig
from painter.planning.film.preview import preview_film
from painter.planning.spray_path import Stroke

TIP = TipConfig()
NOMINAL = 1.2e-4


def test_film_is_found_again_in_tile_coordinates(make_wall):
    wall = make_wall()
    strokes = [Stroke(np.array([0.5, 0.2]), np.array([0.5, 1.8]), 0.6, "body", 0)]
    dut = preview_film(strokes, wall, tip=TIP, nominal=NOMINAL)
    # Middle of a long stroke: Q TE / (v a B(1/2, 3)), a = 12.5 cm, B(1/2, 3) = 16/15.
    peak = TIP.flow * TIP.transfer_efficiency / (0.6 * 0.125 * 16.0 / 15.0)
    found = dut.film_at(np.array([0.5, 0.7]), np.array([1.0, 1.0]))
    assert found == pytest.approx([peak, 0.0], rel=0.01, abs=1e-9)
    volume = dut.film.sum() * dut.cell**2
    assert volume == pytest.approx(TIP.flow * TIP.transfer_efficiency * 1.6 / 0.6)
    assert dut.figures.keepout_paint == 0.0 and dut.figures.overspray == pytest.approx(
        0.0, abs=1e-9
    )


def test_paint_on_the_keepout_is_counted(make_wall):
    wall = make_wall((slice(50, 150), slice(100, 200), 0.0))
    strokes = [Stroke(np.array([1.0, 0.0]), np.array([1.0, 2.0]), 0.6, "body", 0)]
    dut = preview_film(strokes, wall, tip=TIP, nominal=NOMINAL)
    # Half of the fan lands on the patch, over half of the stroke, and at both ends
    # 3/16 of half the fan's thickness, on average over its ellipse, leaves the tile.
    assert dut.figures.overspray == pytest.approx(0.25, abs=0.005)
    assert 0.08 < dut.figures.keepout_paint < 0.125


def test_nothing_sprayed_is_nothing_covered(make_wall):
    dut = preview_film((), make_wall(), tip=TIP, nominal=NOMINAL)
    assert dut.figures._asdict() == {
        "coverage": 0.0,
        "thickness_cv": 0.0,
        "overspray": 0.0,
        "keepout_paint": 0.0,
    }
