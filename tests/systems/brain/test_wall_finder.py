"""The wall finder as a stage: asked, it answers with a wall or a reason."""

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.analysis import Simulator

from painter.systems.brain.wall_finder import WallFinder
from painter.systems.values import StageRequest, StageResult
from perception.config import SegmentationConfig
from perception.synthetic.patch_wall import synthetic_wall
from perception.values import SurfaceMap, TileSize, Wall

# A plumb wall across W x: T x = -W y, T y = W z, T z = -W x.
PLUMB = RotationMatrix(np.array([[0.0, 0.0, -1], [-1, 0, 0], [0, 1, 0]]))
X_WT_EXPECTED = RigidTransform(PLUMB, [1.0, 0.3, 0.2])


def make_map(p_WQs):
    """A surface map of bare points."""
    return SurfaceMap.empty().replace(p_WQs=p_WQs)


def wall_map(offset=0.0, X_WT=X_WT_EXPECTED):
    """A wall `offset` m in front of the expected one."""
    X_WT = X_WT @ RigidTransform([0.0, 0.0, offset])
    rng = np.random.default_rng(0)
    return make_map(synthetic_wall([], spacing=0.02, X_WT=X_WT, rng=rng))


def make_finder(**changes):
    """A finder for a 2 x 2 m tile."""
    options = {
        "X_WT_expected": X_WT_EXPECTED,
        "tile": TileSize(2.0, 2.0),
        "config": SegmentationConfig(),
        "seed": 1,
        "period": 0.1,
    }
    return WallFinder(**{**options, **changes})


def answer(request, surface_map, **changes):
    """The result after one look at a request."""
    dut = make_finder(**changes)
    simulator = Simulator(dut)
    context = simulator.get_mutable_context()
    dut.GetInputPort("request").FixValue(context, Value(request))
    dut.GetInputPort("surface_map").FixValue(context, Value(surface_map))
    simulator.AdvanceTo(0.05)
    return dut.GetOutputPort("result").Eval(context)


def test_wall_is_found_where_it_stands():
    result = answer(StageRequest(number=4, stage="wall_finder"), wall_map(0.05))
    assert isinstance(result, StageResult)
    assert result.number == 4
    assert result.error is None
    assert isinstance(result.value, Wall)
    np.testing.assert_allclose(
        result.value.X_WT.translation(), [0.95, 0.3, 0.2], atol=1e-3
    )


def test_a_tilted_mount_is_warned_of_and_the_wall_found():
    request = StageRequest(number=1, stage="wall_finder")
    tilted = wall_map().replace(mount_tilt=np.deg2rad(0.3))
    result = answer(request, tilted)
    assert isinstance(result.value, Wall)
    assert "tilted by 0.30 deg from its model (limit 0.1 deg)" in result.warning
    assert answer(request, tilted, mount_limit_deg=0.35).warning is None
    assert answer(request, wall_map()).warning is None


def test_failure_is_a_result_with_its_reason():
    result = answer(
        StageRequest(number=1, stage="wall_finder"), make_map(np.zeros((3, 5)))
    )
    assert result.value is None
    assert "NoWallError: the cloud has 5 finite points" in result.error


def test_floor_is_no_wall_even_where_a_wall_is_expected():
    level = RigidTransform([0.3, -0.2, 1.0])
    result = answer(
        StageRequest(number=1, stage="wall_finder"),
        wall_map(X_WT=level),
        X_WT_expected=level,
    )
    assert result.value is None
    assert "level, as floors are" in result.error


def test_requests_to_others_are_not_answered():
    result = answer(StageRequest(number=1, stage="wall_segmenter"), wall_map())
    assert result.number == 0


def test_the_period_must_be_positive():
    with pytest.raises(ValueError, match=r"period must be > 0, got -1"):
        make_finder(period=-1.0)
