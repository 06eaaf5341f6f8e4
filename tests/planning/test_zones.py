"""Zones, and tips by number."""

import numpy as np
import pytest

from painter.config import load_scenario
from painter.errors import InputError
from painter.planning.config import RasterConfig, TipConfig, ZoneConfig
from painter.planning.film.tips import airless_tip
from painter.planning.strokes.raster import plan_strokes
from painter.planning.strokes.spray_settings import SpraySettings
from painter.planning.zones import in_zones
from perception.settings import validate

MASK = np.ones((200, 200), dtype=bool)


def test_a_rectangle_is_left_out_by_its_opposite_corners():
    zone = ZoneConfig(corners=[[1.0, 0.5], [0.4, 0.9]])
    marked = in_zones(MASK, 0.01, [zone])
    assert (~marked).sum() == 60 * 40
    assert not marked[50:90, 40:100].any()


def test_only_included_polygons_are_painted_less_what_is_excluded():
    triangle = ZoneConfig(kind="include", corners=[[0.0, 0.0], [2.0, 0.0], [0.0, 2.0]])
    assert in_zones(MASK, 0.01, [triangle]).mean() == pytest.approx(0.5, abs=0.01)
    hole = ZoneConfig(corners=[[0.0, 0.0], [0.5, 0.5]])
    both = in_zones(MASK, 0.01, [triangle, hole])
    assert both.mean() == pytest.approx(0.5 - 1.0 / 16.0, abs=0.01)


def test_strokes_keep_out_of_a_zone():
    zone = ZoneConfig(corners=[[0.5, 0.0], [2.0, 2.0]])
    strokes = plan_strokes(
        MASK, 0.01, SpraySettings(TipConfig(), RasterConfig(zones=[zone]))
    )
    assert strokes and max(s.start_T[0] for s in strokes) < 0.5


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"zones": [ZoneConfig(kind="maybe", corners=[[0, 0], [1, 1]])]}, "kind"),
        ({"zones": [ZoneConfig(corners=[[0, 0]])]}, "two or more pairs x, y"),
        (
            {"zones": [ZoneConfig(), ZoneConfig()]},
            r"raster\.zones\[0\]\.corners must be two or more",
        ),
        (
            {"zones": [ZoneConfig(corners=[[0.5, 0.2], [0.5, 0.9]])]},
            r"raster\.zones\[0\]\.corners: area must be > 0 m²",
        ),
        ({"cut_in_standoff": 0.02}, "cut_in_standoff"),
    ],
)
def test_what_cannot_be_is_refused(change, message):
    with pytest.raises(ValueError, match=message):
        validate(RasterConfig(**change), "raster")


def test_a_zone_beyond_the_tile_names_axis_value_and_bound():
    word = "raster.zones=[{corners: [[0.1, 0.1], [0.5, 25.0]]}]"
    with pytest.raises(
        InputError, match=r"zones\[0\]\.corners: y must be 0 to 2 m, got 25\.0"
    ):
        load_scenario("blank", [word])


def test_the_default_tip_is_a_515():
    tip, default = airless_tip(515), TipConfig()
    assert (tip.fan_width, tip.fan_thickness) == pytest.approx((0.25, 0.05))
    assert tip.flow == pytest.approx(default.flow)


def test_flow_is_that_of_water_through_the_orifice():
    """Cd A sqrt(2 Δp / rho) for 0.017 and 0.013 inch: 1.17 and 0.68 l/min."""
    for number, litres in ((517, 1.17), (413, 0.68)):
        area = np.pi / 4.0 * (number % 100 * 2.54e-5) ** 2
        flow = 0.8 * area * np.sqrt(2.0 * 1.38e7 / 1000.0)
        assert airless_tip(number).flow == pytest.approx(flow, rel=0.005)
        assert flow * 6e4 == pytest.approx(litres, rel=0.01)


@pytest.mark.parametrize("number", [115, 514, 15, 915])
def test_unknown_tips_are_refused(number):
    with pytest.raises(ValueError, match="tip must be"):
        airless_tip(number)
