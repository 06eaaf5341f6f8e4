"""The made-up wall has the things that it says, where it says."""

import numpy as np
import pytest

from perception.synthetic.furnished_wall import STAND_OFF, Thing, furnished_wall


@pytest.fixture(scope="module")
def wall():
    return furnished_wall(100_000, seed=1)


def test_cloud_has_the_points_asked_for_as_float32(wall):
    assert wall.p_CQs.shape == (3, 100_000)
    np.testing.assert_array_equal(wall.p_CQs, wall.p_CQs.astype(np.float32))


def test_same_seed_same_cloud():
    one, other = (furnished_wall(5_000, seed=3) for _ in range(2))
    np.testing.assert_array_equal(one.p_CQs, other.p_CQs)
    assert not np.array_equal(one.p_CQs, furnished_wall(5_000, seed=4).p_CQs)


def test_areas_of_things_are_those_of_their_shapes(wall):
    # Widths and heights from the docstrings, m; a boundary is known to half a cell.
    areas = {
        Thing.WINDOW: 0.60 * 0.70,
        Thing.BOX: 0.20 * 0.20 + 0.15 * 0.12,
        Thing.BOTTLE: 0.08 * 0.19 + 0.03 * 0.08,
        Thing.STICK: 0.03 * 1.2,
    }
    for thing, area in areas.items():
        cells = np.count_nonzero(wall.things == thing)
        assert cells * wall.cell**2 == pytest.approx(area, rel=0.12)


def test_wall_lies_at_the_stand_off(wall):
    x, y, z = wall.p_CQs
    border = (np.abs(x) > 1.02) & (np.abs(y) > 1.02)
    depths = z[border]
    near = depths[np.abs(depths - STAND_OFF) < 0.02]
    # 2 mm of noise over n points: the mean is known to 2 mm / sqrt(n).
    assert near.mean() == pytest.approx(STAND_OFF, abs=4 * 0.002 / near.size**0.5)


def test_boxes_stand_before_the_wall(wall):
    rows, columns = np.nonzero(wall.things == Thing.BOX)
    p_TQs = wall.X_CT.inverse() @ wall.p_CQs
    cells = np.floor(p_TQs[:2] / wall.cell).astype(int)
    middle = (cells[0] == columns[len(columns) // 4]) & (
        cells[1] == rows[len(rows) // 4]
    )
    assert np.median(p_TQs[2, middle]) == pytest.approx(0.10, abs=0.01) or (
        np.median(p_TQs[2, middle]) == pytest.approx(0.06, abs=0.01)
    )


def test_figures_of_known_masks(wall):
    assert wall.iou(wall.mask) == 1.0
    everything = np.ones_like(wall.mask)
    assert wall.iou(everything) == pytest.approx(wall.mask.mean())
    assert wall.recall(everything, Thing.STICK) == 0.0
    assert wall.recall(wall.mask, Thing.STICK) == 1.0
