"""The wall of a recording, with nobody to say where it is."""

import os
from pathlib import Path

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix

from perception.config import SegmentationConfig
from perception.errors import GridSizeError, NoWallError
from perception.io.clouds import read_cloud
from perception.io.depth_images import read_depth
from perception.paper_steps.planes import fit_plane
from perception.recorded.segment_recorded import segment_recorded
from perception.recorded.wall_choice import contrast
from perception.synthetic.patch_wall import synthetic_wall

DATA = Path(os.environ.get("PAINTER_DATA", "../shared/data")) / "real"
UP_Z = np.array([0.0, 0.0, 1.0])
# A wall across x, 1.5 m before the sensor at the origin, its tile from z = -1 to 1.
X_WALL = RigidTransform(
    RotationMatrix(np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])),
    [1.5, 1.0, -1.0],
)


def segment(points, *, tile=(2.0, 2.0), **options):
    """Segments a recording with the default thresholds."""
    config = options.pop("config", SegmentationConfig())
    return segment_recorded(points, tile=tile, config=config, seed=1, **options).stages


def wall(patches=()):
    """The wall, without a margin."""
    rng = np.random.default_rng(0)
    return synthetic_wall(patches, spacing=0.02, margin=0.0, X_WT=X_WALL, rng=rng)


def floor():
    """A floor 1 m below the sensor, three times as large as the wall."""
    rng = np.random.default_rng(1)
    return rng.uniform([[-4.0], [-2.0], [-1.002]], [[1.4], [2.0], [-0.998]], (3, 30000))


def test_tile_is_centred_upright_and_faces_the_sensor():
    stages = segment(wall(), up_W=UP_Z, config=SegmentationConfig(cell=0.04))
    # The middle of 10000 points between their 1st and 99th percentiles.
    np.testing.assert_allclose(
        stages.segmentation.X_WT.GetAsMatrix4(), X_WALL.GetAsMatrix4(), atol=0.01
    )
    assert stages.segmentation.wall_mask.mean() > 0.97


@pytest.mark.parametrize(
    ("fine", "cell"), [(True, (64.0 / 400_000) ** 0.5), (False, 0.01)]
)
def test_cells_grow_where_a_wall_is_too_large_for_them(fine, cell):
    # Points 1 cm apart, so that 400 000 cells are too few for 64 m² and 4 million not.
    x, y = np.meshgrid(np.arange(-4.0, 4.0, 0.01), np.arange(-4.0, 4.0, 0.01))
    points = np.stack([x.ravel(), y.ravel(), np.ones(x.size)])
    found = segment(points, tile=(8.0, 8.0), fit_cell=True, fine=fine)
    assert found.segmentation.cell == pytest.approx(cell, rel=1e-3)


@pytest.mark.parametrize(
    ("fine", "cell", "most", "enough"),
    [(True, 0.003, 400_000, 0.0032), (False, 0.0009, 4_000_000, 0.001)],
)
def test_a_grid_of_too_many_cells_is_refused(fine, cell, most, enough):
    message = f"2 x 2 m with cells of {cell:g} m has more than {most} cells; "
    with pytest.raises(GridSizeError, match=f"{message}.*of {enough:g} m"):
        segment(wall(), config=SegmentationConfig(cell=cell), fine=fine)


def test_without_a_direction_up_is_the_pictures():
    # The same wall in a camera's frame: x right, y down, z ahead.
    R_CW = RotationMatrix(np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]]))
    stages = segment(R_CW @ wall(), config=SegmentationConfig(cell=0.04))
    np.testing.assert_allclose(
        stages.segmentation.X_WT.rotation().matrix(),
        np.diag([1.0, -1.0, -1.0]),
        atol=1e-3,
    )


def test_floor_is_a_wall_only_if_nobody_says_what_is_up():
    points = np.concatenate([wall(), floor()], axis=1)
    # A grid as coarse as the floor's points.
    config = SegmentationConfig(cell=0.05)
    lying = segment(points, config=config).segmentation.X_WT.GetAsMatrix4()
    standing = segment(points, config=config, up_W=UP_Z).segmentation.X_WT
    np.testing.assert_allclose(np.abs(lying[:3, 2]), [0.0, 0.0, 1.0], atol=1e-2)
    np.testing.assert_allclose(
        standing.GetAsMatrix4()[:3, 2], [-1.0, 0.0, 0.0], atol=1e-2
    )


def test_expected_distance_chooses_between_walls():
    far = RigidTransform([1.0, 0.0, 0.0]) @ wall()
    points = np.concatenate([wall()[:, ::2], far], axis=1)
    config = SegmentationConfig(cell=0.05)
    near = segment(points, up_W=UP_Z, distance=1.45, config=config)
    assert near.segmentation.X_WT.translation()[0] == pytest.approx(1.5, abs=0.005)
    with pytest.raises(NoWallError, match=r"is 2\.500 m away, not 4 \+- 0\.15"):
        segment(points, up_W=UP_Z, distance=4.0, config=config)


def test_slab_through_a_cloud_of_points_is_no_wall():
    points = np.random.default_rng(3).uniform(-0.3, 0.3, (3, 20000))
    with pytest.raises(NoWallError, match="times as dense as beside it"):
        segment(points)


def test_only_a_floor_is_no_wall():
    with pytest.raises(
        NoWallError, match="100% of the points leans 90 deg, a wall at most 20"
    ):
        segment(floor(), up_W=UP_Z)


def test_contrast_is_a_ratio_of_densities():
    z = np.concatenate([np.zeros(300), np.full(60, 0.05), np.full(40, -0.05)])
    points = np.stack([np.linspace(0, 1, 400), np.linspace(0, 1, 400) ** 2, z])
    plane = fit_plane(points[:, :300])
    # 300 within 3 cm; 100 in the two slabs beside it, so 50 in each on average.
    assert contrast(plane, points, threshold=0.03) == pytest.approx(6.0)
    assert contrast(plane, points[:, :300], threshold=0.03) == np.inf


needs_data = pytest.mark.skipif(
    not DATA.is_dir(), reason=f"no recordings in {DATA}; set PAINTER_DATA"
)


@needs_data
@pytest.mark.parametrize(
    ("name", "distance", "normal"),
    [
        # Distance and normal from the recordings' README and expected.json.
        ("02_protruding_wall", 1.8396, [0.6268, 0.7791, 0.0086]),
        ("03_wall_between_two_windows", 0.9971, [0.8269, 0.5623, 0.0079]),
        ("05_wall_and_door", 1.5099, [0.5786, 0.8155, 0.0095]),
        ("09_plain_wall", 1.4292, [0.6538, 0.7565, 0.0122]),
        ("10_wall_with_small_columns", 1.1340, [0.6867, 0.7269, 0.0120]),
    ],
)
def test_walls_of_another_painting_robot_are_found(name, distance, normal):
    points = read_cloud(DATA / "painting_robot_wall_scans" / f"{name}.pcd").p_WQs
    # Scan lines are 2 to 5 cm apart; z points down.
    config = SegmentationConfig(cell=0.05)
    stages = segment(points, tile=(4.0, 4.0), up_W=-UP_Z, config=config)
    plane = stages.found.planes[stages.wall_plane - 1]
    # The scans are noisy by 12 mm and the swaying one by 5 cm and more.
    assert abs(plane.offset) == pytest.approx(distance, abs=0.02)
    assert abs(plane.normal @ normal) > np.cos(np.radians(1.5))


@needs_data
def test_plants_are_no_wall(tmp_path):
    camera = tmp_path / "camera.json"
    camera.write_text(
        '{"width": 1280, "height": 720, "fx": 910, "fy": 910, "cx": 640, "cy": 360}'
    )
    points = read_depth(DATA / "d435i_no_wall" / "plants_day_depth.png", camera)
    with pytest.raises(NoWallError, match="no plane is a wall"):
        segment(points[:, ::10])
