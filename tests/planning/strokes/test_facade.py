"""Stations cover a wall once, each in reach, with film even across the joints."""

import numpy as np
import pytest

from painter.errors import ReachError
from painter.planning.arm.placement import propose_distance
from painter.planning.arm.reach_map import TileReach
from painter.planning.config import (
    MotionConfig,
    RasterConfig,
    TileConfig,
    TipConfig,
    ZoneConfig,
)
from painter.planning.film.deposition import mean_film, predicted_film
from painter.planning.strokes.facade import plan_base_positions
from painter.planning.strokes.spray_settings import SpraySettings

TIP, RASTER, TILE = TipConfig(), RasterConfig(), TileConfig()
SPRAY = SpraySettings(TIP, RASTER)


def base_positions_of(width, height):
    return plan_base_positions(width, height, SPRAY, tile=TILE)


def film_on(base_positions, x, y, *, shift=(0.0, 0.0)):
    """Predicted film over the nominal one; every second position is off by shift."""
    strokes = []
    for number, base_position in enumerate(base_positions):
        off = np.array(shift) * (number % 2)
        strokes += [
            s.replace(start_T=s.start_T + off, end_T=s.end_T + off)
            for s in base_position.strokes_on_wall
        ]
    pitch = SPRAY.nominal_pitch(x[-1] + x[0])
    nominal = mean_film(TIP, speed=RASTER.speed, pitch=pitch)
    return predicted_film(strokes, x, y, tip=TIP) / nominal


@pytest.mark.parametrize("size", [(2.0, 2.0), (5.0, 2.0), (10.0, 6.0), (1.2, 3.1)])
def test_stations_cover_the_wall_with_tiles_that_fit(size):
    base_positions = base_positions_of(*size)
    for base_position in base_positions:
        assert base_position.width <= TILE.width + 1e-9
        assert base_position.height <= TILE.height + 1e-9
        assert base_position.base_x == pytest.approx(
            base_position.left + base_position.width / 2.0
        )
    assert min(s.left for s in base_positions) == pytest.approx(0.0, abs=1e-9)
    assert max(s.left + s.width for s in base_positions) == pytest.approx(size[0])
    assert min(s.bottom for s in base_positions) == 0.0
    assert max(s.bottom + s.height for s in base_positions) == pytest.approx(size[1])


@pytest.mark.parametrize("shift", [(0.0, 0.0), (0.005, 0.0), (0.0, 0.005)])
def test_film_across_joints_is_within_a_tenth_of_nominal(shift):
    base_positions = base_positions_of(4.0, 3.6)  # Two by two, or more.
    assert len(base_positions) >= 4
    x = np.arange(0.005, 4.0, 0.01)
    y = np.arange(0.005, 3.6, 0.01)
    film = film_on(base_positions, x, y, shift=shift)
    inside = film[15:-15, 15:-15]  # The wall's own edges are no joints.
    assert inside.min() >= 0.9
    assert inside.max() <= 1.1


DOOR = ZoneConfig(corners=[[3.0, 0.0], [4.0, 2.1]])


def test_openings_stay_clean_and_their_surroundings_are_painted():
    base_positions = plan_base_positions(6.0, 3.6, SPRAY, tile=TILE, zones=[DOOR])
    x = np.arange(0.005, 6.0, 0.01)
    y = np.arange(0.005, 3.6, 0.01)
    film = film_on(base_positions, x, y)
    half_fan = 13  # Cells; so far a line beside the door reaches over its edge.
    assert film[:200, 300 + half_fan : 400 - half_fan].max() == 0.0
    assert film[15:200, 15 : 300 - half_fan].min() >= 0.9
    assert film[15:200, 400 + half_fan : -15].min() >= 0.9
    assert film[225:-15, 15:-15].min() >= 0.9  # Over the door, too.


def test_no_base_position_stands_before_an_opening_alone():
    whole = base_positions_of(6.0, 2.0)
    # All that one base position would paint is a gate.
    gate = ZoneConfig(
        corners=[
            [whole[1].left, 0.0],
            [whole[1].left + whole[1].width, 2.0],
        ]
    )
    dut = plan_base_positions(6.0, 2.0, SPRAY, tile=TILE, zones=[gate])
    assert [s.left for s in dut] == [s.left for s in whole if s is not whole[1]]


def test_only_what_is_included_gets_strokes():
    zone = ZoneConfig(kind="include", corners=[[0.5, 0.5], [1.5, 1.5]])
    (dut,) = plan_base_positions(6.0, 2.0, SPRAY, tile=TILE, zones=[zone])
    ends = np.array([[s.start_T, s.end_T] for s in dut.strokes_on_wall])
    assert ends[..., 0].min() > 0.45 and ends[..., 0].max() < 1.55
    assert ends[..., 1].min() == pytest.approx(0.5, abs=0.02)
    assert ends[..., 1].max() == pytest.approx(1.5, abs=0.02)


def test_a_base_position_is_a_program_that_the_arm_can_do(robot, make_wall):
    base_position = base_positions_of(4.0, 3.6)[0]
    shift = np.array([(TILE.width - base_position.width) / 2.0, 0.0])
    strokes = [
        s.replace(start_T=s.start_T + shift, end_T=s.end_T + shift)
        for s in base_position.strokes
    ]
    home = np.deg2rad(MotionConfig().home_deg)
    dut = robot.planner(tip=TIP, raster=RASTER).program(strokes, make_wall(), home)
    assert sum(s.length for s in dut.strokes) == pytest.approx(
        sum(s.length for s in strokes), rel=0.01
    )


def test_base_positions_have_one_coat():
    raster = RasterConfig(coats=2)
    with pytest.raises(ValueError, match=r"raster\.coats must be 1 .* got 2"):
        plan_base_positions(5.0, 2.0, SpraySettings(TIP, raster), tile=TILE)


def test_a_tile_lower_than_two_overlaps_is_refused():
    with pytest.raises(ValueError, match="two overlaps"):
        plan_base_positions(4.0, 4.0, SPRAY, tile=TileConfig(height=0.3))


def reach_with(share):
    flags = np.arange(10) < 10 * share
    every = np.ones((1, 10), dtype=bool)
    return TileReach(
        x=np.arange(10.0),
        y=np.zeros(1),
        on_tile=every,
        to_see=every,
        sprayed=flags[None],
        camera_at=every,
        seen=every,
    )


def test_distance_is_in_the_middle_of_the_range_that_reaches_most():
    shares = {0.8: 0.5, 0.9: 1.0, 1.0: 1.0, 1.1: 1.0, 1.2: 0.9, 1.3: 1.0}
    dut = propose_distance(lambda d: reach_with(shares[d]), list(shares))
    assert (dut.distance, dut.nearest, dut.farthest) == (1.0, 0.9, 1.1)
    assert dut.spray_share == 1.0


def test_a_tile_that_nothing_reaches_is_an_error():
    with pytest.raises(ReachError, match="reaches no point of the tile"):
        propose_distance(lambda d: reach_with(0.0), [1.0, 2.0])
