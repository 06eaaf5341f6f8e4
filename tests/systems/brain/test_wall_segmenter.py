"""The wall segmenter as a stage, on the wall that the finder found."""

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.analysis import Simulator

from painter.systems.brain.wall_segmenter import WallSegmenter
from painter.systems.values import StageRequest, StageResult
from perception.config import SegmentationConfig
from perception.synthetic.patch_wall import Patch, synthetic_truth, synthetic_wall
from perception.values import SurfaceMap, TileSize, Wall, WallSegmentation

# A plumb wall across W x: T x = -W y, T y = W z, T z = -W x.
PLUMB = RotationMatrix(np.array([[0.0, 0.0, -1], [-1, 0, 0], [0, 1, 0]]))
X_WT = RigidTransform(PLUMB, [1.0, 0.3, 0.2])
BOX = Patch(0.4, 0.4, 0.8, 0.9, 0.1)
REQUEST = StageRequest(number=2, stage="wall_segmenter")
FOUND = StageResult(
    number=1, value=Wall(X_WT=X_WT, rms=0.001, inlier_count=1, inlier_share=1.0)
)


def make_segmenter(**changes):
    """A segmenter of a 2 x 2 m tile with cells as coarse as the test's clouds."""
    options = {
        "tile": TileSize(2.0, 2.0),
        "config": SegmentationConfig(cell=0.02),
        "seed": 1,
        "period": 0.1,
    }
    return WallSegmenter(**{**options, **changes})


def surface_map(points):
    """A map of points that were measured ten times each."""
    count = points.shape[1]
    return SurfaceMap.empty().replace(
        p_WQs=points,
        counts=np.full(count, 10),
        variances=np.full(count, 0.0015**2, dtype=np.float32),
    )


def answer(wall, request=REQUEST):
    """The result after one look at a request."""
    rng = np.random.default_rng(0)
    points = synthetic_wall([BOX], spacing=0.01, X_WT=X_WT, rng=rng)
    dut = make_segmenter()
    simulator = Simulator(dut)
    context = simulator.get_mutable_context()
    dut.GetInputPort("request").FixValue(context, Value(request))
    dut.GetInputPort("wall").FixValue(context, Value(wall))
    dut.GetInputPort("surface_map").FixValue(context, Value(surface_map(points)))
    simulator.AdvanceTo(0.05)
    return dut.GetOutputPort("result").Eval(context)


def test_wall_is_parted_on_its_tile():
    result = answer(FOUND)
    assert result.number == 2
    assert isinstance(result.value, WallSegmentation)
    np.testing.assert_allclose(
        result.value.X_WT.GetAsMatrix4(), X_WT.GetAsMatrix4(), atol=1e-3
    )
    truth = synthetic_truth([BOX], cell=0.02)
    assert (result.value.wall_mask == truth).mean() > 0.995


def test_without_a_wall_the_reason_is_named():
    result = answer(StageResult())
    assert result.value is None
    assert "wall holds NoneType, expected Wall" in result.error


def test_other_type_on_a_port_is_named():
    result = answer(REQUEST)
    assert result.error.startswith("PortTypeError: ")
    assert "wall carries StageRequest, expected StageResult" in result.error


def test_the_period_must_be_positive():
    with pytest.raises(ValueError, match=r"period must be > 0, got 0"):
        make_segmenter(period=0.0)
