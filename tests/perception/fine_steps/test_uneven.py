"""Masks and openings on walls that bend, wave, carry mouldings, or mirror the room."""

import numpy as np
import pytest
from pydrake.math import RigidTransform

from perception.config import SegmentationConfig
from perception.fine_steps.unseen import Reason
from perception.segmentation import segment_wall
from perception.synthetic.patch_wall import Patch, synthetic_truth, synthetic_wall
from perception.values import SurfaceMap, TileSize

TILE = TileSize(2.0, 2.0)
WINDOW = Patch(0.3, 1.2, 0.8, 1.8, -0.12)
BOX = Patch(1.5, 0.5, 1.7, 0.8, 0.03)
PLATE = Patch(0.3, 0.3, 0.5, 0.5, 0.012)
X, Y = np.meshgrid(*[(np.arange(200) + 0.5) * 0.01] * 2)


def cloud(patches=(WINDOW, BOX, PLATE), bend=None):
    rng = np.random.default_rng(0)
    points = synthetic_wall(patches, tile=TILE, spacing=0.006, noise=0.0007, rng=rng)
    if bend is not None:
        points[2] += bend(points[0], points[1])
    return points


def segment(points, config=None):
    return segment_wall(
        SurfaceMap.of_points(points),
        RigidTransform(),
        TILE,
        config=config or SegmentationConfig(),
        seed=1,
    )


def iou(mask, truth):
    return np.count_nonzero(mask & truth) / np.count_nonzero(mask | truth)


@pytest.mark.parametrize(
    "bend",
    [
        lambda x, y: 0.364 * np.maximum(0.0, x - 1.2),  # 20 deg, towards the robot.
        lambda x, y: -0.577 * np.maximum(0.0, x - 1.2),  # 30 deg, away from it.
        lambda x, y: 0.466 * np.maximum(0.0, 0.9 * x + 0.3 * y - 1.5),
        lambda x, y: 0.10 * (x - 1.0) * (y - 1.0),
        lambda x, y: 0.01 * np.sin(2.0 * np.pi * x / 0.7),
        lambda x, y: 0.03 * np.exp(-0.5 * ((y - 1.0) / 0.3) ** 2),
    ],
    ids=["corner in", "corner out", "slanting corner", "twist", "waves", "moulding"],
)
def test_openings_and_low_steps_are_found_on_walls_that_are_no_planes(bend):
    result = segment(cloud(bend=bend))
    truth = synthetic_truth((WINDOW, BOX, PLATE), tile=TILE)
    assert iou(result.wall_mask, truth) > 0.99
    (window,) = result.openings
    assert window.kind == "rectangle"
    assert window.depth == pytest.approx(-0.12, abs=0.003)


def test_wall_at_right_angles_is_an_obstacle():
    result = segment(cloud(bend=lambda x, y: np.maximum(0.0, 40.0 * (x - 1.5))))
    truth = synthetic_truth((WINDOW, BOX, PLATE), tile=TILE) & (X < 1.5)
    assert iou(result.wall_mask, truth) > 0.99
    assert (result.reason[:, 152:] == Reason.RAISED).mean() > 0.99


@pytest.mark.parametrize(
    "strip",
    [
        lambda y: np.where(np.abs(y - 1.23) < 0.03, 0.02, 0.0),
        lambda y: 0.02 * np.sqrt(np.maximum(0.0, 1.0 - ((y - 1.23) / 0.03) ** 2)),
    ],
    ids=["square", "round"],
)
def test_sharp_moulding_is_an_obstacle(strip):
    mask = segment(cloud((), lambda x, y: strip(y))).wall_mask
    # A cell of the border either way: 2 of 6 rows.
    assert not mask[121:125].any()
    assert mask[:119].all() and mask[127:].all()


def test_split_of_a_twisted_tile_into_two_planes_does_not_split_the_wall():
    # Within 3 cm of one plane lies a half along a diagonal.
    bend = lambda x, y: 0.13 * (x - 1.0) * (y - 1.0)  # noqa: E731
    assert segment(cloud((), bend)).wall_mask.mean() > 0.995


def mirroring_window(seed=0):
    """A framed pane: a third mirrors what is before it, a third lets through."""
    rng = np.random.default_rng(seed)
    points = cloud((WINDOW,))
    x, y, _ = points
    pane = (x > 0.36) & (x < 0.74) & (y > 1.26) & (y < 1.74)
    fate = rng.random(x.size)
    # The mirror image of the robot's stand 0.4 to 1.2 m before the pane lies as far
    # behind it.
    points[2, pane & (fate < 0.33)] -= rng.uniform(0.4, 1.2)
    through = pane & (fate >= 0.33) & (fate < 0.66)
    points[2, through] -= rng.uniform(1.0, 3.0, np.count_nonzero(through))
    return points[:, ~(pane & (fate >= 0.66))]


def test_mirror_image_behind_a_pane_is_glass():
    result = segment(mirroring_window())
    assert iou(result.wall_mask, synthetic_truth((WINDOW,), tile=TILE)) > 0.99
    (window,) = result.openings
    assert window.kind == "rectangle"
    assert (result.reason[128:172, 38:72] == Reason.GLASS).mean() > 0.98
    # The frame, 6 cm wide, is no glass: 0.38 x 0.48 m of 0.5 x 0.6 m are.
    assert window.glass_share == pytest.approx(0.61, abs=0.05)


@pytest.mark.parametrize(
    ("width", "height", "cell"),
    [
        (1.5, 1.0, 0.005),
        (1.0, 0.5, 0.02),
        pytest.param(4.0, 3.0, 0.005, marks=pytest.mark.slow),
    ],
)
def test_tiles_and_cells_of_any_size(width, height, cell):
    tile = TileSize(width, height)
    rng = np.random.default_rng(0)
    patch = Patch(0.2, 0.1, 0.6, 0.4, 0.05)
    points = synthetic_wall(
        (patch,), tile=tile, spacing=max(0.007, cell / 2), noise=0.0007, rng=rng
    )
    result = segment_wall(
        SurfaceMap.of_points(points),
        RigidTransform(),
        tile,
        config=SegmentationConfig(cell=cell),
        seed=1,
    )
    truth = synthetic_truth((patch,), tile=tile, cell=cell)
    assert result.wall_mask.shape == (round(height / cell), round(width / cell))
    assert iou(result.wall_mask, truth) > 0.99
