"""Fine steps, uneven walls, confidence and reasons on made-up walls."""

import numpy as np
import pytest
from pydrake.math import RigidTransform

from perception.config import SegmentationConfig
from perception.errors import AmbiguousWallError, NoWallError, ObliqueWallError
from perception.fine_steps.unseen import Reason
from perception.paper_steps.planes import Plane
from perception.paper_steps.wall import choose_plane
from perception.segmentation import segment_wall
from perception.synthetic.patch_wall import Patch, synthetic_truth, synthetic_wall
from perception.values import SurfaceMap, TileSize

TILE = TileSize(1.0, 1.0)
PLATE = Patch(0.2, 0.2, 0.4, 0.4, 0.010)
RECESS = Patch(0.6, 0.6, 0.8, 0.8, -0.020)


def cloud(patches, *, noise=0.0007, bend=None, seed=0):
    rng = np.random.default_rng(seed)
    points = synthetic_wall(patches, tile=TILE, spacing=0.005, noise=noise, rng=rng)
    if bend is not None:
        points[2] += bend(points[0], points[1])
    return points


def segment(points, **options):
    config = options.pop("config", None) or SegmentationConfig()
    return segment_wall(
        SurfaceMap.of_points(points),
        RigidTransform(),
        TILE,
        config=config,
        seed=1,
        **options,
    )


def iou(mask, truth):
    return np.count_nonzero(mask & truth) / np.count_nonzero(mask | truth)


@pytest.mark.parametrize(
    "bend",
    [
        None,
        lambda x, y: 0.04 * (x - 0.5) * (y - 0.5),
        lambda x, y: 0.05 * ((x - 0.5) ** 2 + (y - 0.5) ** 2),
    ],
    ids=["flat", "twisted", "bulged"],
)
def test_steps_of_1_cm_are_found_also_on_uneven_walls(bend):
    result = segment(cloud([PLATE, RECESS], bend=bend))
    truth = synthetic_truth([PLATE, RECESS], tile=TILE)
    assert iou(result.wall_mask, truth) > 0.995
    assert (result.reason[22:38, 22:38] == Reason.RAISED).all()
    assert (result.reason[62:78, 62:78] == Reason.RECESSED).all()
    (opening,) = result.openings
    np.testing.assert_allclose(
        opening.p_TVs, [[0.6, 0.8, 0.8, 0.6], [0.6, 0.6, 0.8, 0.8]], atol=0.011
    )


def test_bare_wall_has_no_false_steps_and_full_confidence():
    result = segment(cloud([]))
    assert result.wall_mask.all()
    assert (result.reason == Reason.WALL).all()
    assert np.median(result.confidence) > 0.99
    np.testing.assert_allclose(result.normals[..., 2], 1.0, atol=1e-4)


def test_a_step_within_the_noise_is_no_step():
    # 10 mm against 4 mm: 2.5 standard deviations a point, but many points agree.
    found = segment(cloud([PLATE], noise=0.004))
    truth = synthetic_truth([PLATE], tile=TILE)
    assert iou(found.wall_mask, truth) > 0.98
    # 4 mm against 4 mm does not reach the least step, and nothing false comes up.
    low = Patch(0.2, 0.2, 0.4, 0.4, 0.004)
    assert segment(cloud([low], noise=0.004)).wall_mask.mean() > 0.999


def test_least_step_is_a_setting():
    config = SegmentationConfig(min_step=0.03)
    assert segment(cloud([PLATE, RECESS]), config=config).wall_mask.all()


def test_confidence_is_lowest_where_a_step_is_close_to_its_bound():
    near = Patch(0.2, 0.2, 0.4, 0.4, 0.0055)
    result = segment(cloud([near, RECESS]))
    assert result.confidence[22:38, 22:38].mean() < 0.8
    assert result.confidence[62:78, 62:78].mean() > 0.99


def test_larger_panel_of_a_door_does_not_become_the_wall():
    # The door has more points, but the wall is where it is expected.
    door = Patch(-0.2, -0.2, 0.65, 1.2, -0.14)
    result = segment(cloud([door]))
    assert iou(result.wall_mask, synthetic_truth([door], tile=TILE)) > 0.98


@pytest.mark.parametrize("count", [900, 700])
def test_two_equally_good_walls_are_refused(count):
    normal = np.array([0.0, 0.0, 1.0])
    planes = [
        Plane(normal=normal, offset=0.05, rms=0.001, count=1000),
        Plane(normal=normal, offset=-0.05, rms=0.001, count=count),
    ]
    options = {"tile": TILE, "total": 2000, "config": SegmentationConfig()}
    if count == 700:
        assert choose_plane(planes, RigidTransform(), **options) == 0
        return
    with pytest.raises(AmbiguousWallError, match=r"0\.100 m apart"):
        choose_plane(planes, RigidTransform(), **options)


def test_oblique_wall_and_floor_are_refused():
    turned = RigidTransform([0.5, 0.5, 0.0])
    turn = RigidTransform(
        np.array(
            [
                [np.cos(0.3), 0.0, np.sin(0.3), 0.0],
                [0.0, 1.0, 0.0, 0.0],
                [-np.sin(0.3), 0.0, np.cos(0.3), 0.0],
            ]
        )
    )
    points = turned @ turn @ turned.inverse() @ cloud([])
    with pytest.raises(ObliqueWallError, match=r"turned 17\.2 deg"):
        segment(points)
    with pytest.raises(NoWallError, match="level, as floors are"):
        segment(cloud([]), up_W=np.array([0.0, 0.0, 1.0]))


@pytest.mark.parametrize("cell", [0.005, 0.02, 0.04])
def test_cells_of_any_size(cell):
    config = SegmentationConfig(cell=cell)
    result = segment(cloud([PLATE, RECESS]), config=config)
    truth = synthetic_truth([PLATE, RECESS], tile=TILE, cell=cell)
    assert result.wall_mask.shape == result.normals.shape[:2] == truth.shape
    assert iou(result.wall_mask, truth) > 0.98
