"""Segmentations survive a file; masks are pictures as seen from the robot."""

import numpy as np
import pytest
from PIL import Image
from pydrake.math import RigidTransform, RollPitchYaw

from perception.errors import CloudReadError
from perception.io.segmentations import (
    load_segmentation,
    save_segmentation,
    save_wall_mask,
)
from perception.values import Opening, WallSegmentation


def make_segmentation():
    """Two rows of three cells, all different."""
    return WallSegmentation(
        labels=np.array([[1, 1, 2], [0, 1, 3]], dtype=np.uint16),
        depth=np.array([[0.0, 0.001, -0.1], [np.nan, 0.0, 0.2]], dtype=np.float32),
        wall_mask=np.array([[True, True, False], [False, True, False]]),
        X_WT=RigidTransform(RollPitchYaw(0.1, -0.2, 2.0), [1.0, 2.0, 3.0]),
        cell=0.01,
    )


def test_segmentation_comes_back_as_it_was(tmp_path):
    saved = make_segmentation()
    save_segmentation(tmp_path / "segmentation.npz", saved)
    loaded = load_segmentation(tmp_path / "segmentation.npz")
    for name in ("labels", "depth", "wall_mask"):
        np.testing.assert_array_equal(getattr(loaded, name), getattr(saved, name))
        assert getattr(loaded, name).dtype == getattr(saved, name).dtype
    assert loaded.X_WT.IsExactlyEqualTo(saved.X_WT)
    assert loaded.cell == 0.01


def test_what_fine_steps_add_comes_back_too(tmp_path):
    extras = {
        "surface": np.full((2, 3), 0.001, dtype=np.float32),
        "normals": np.tile(np.float32([0.0, 0.0, 1.0]), (2, 3, 1)),
        "confidence": np.full((2, 3), 0.9, dtype=np.float32),
        "reason": np.array([[0, 0, 1], [3, 0, 1]], dtype=np.uint8),
    }
    save_segmentation(tmp_path / "s.npz", make_segmentation().replace(**extras))
    loaded = load_segmentation(tmp_path / "s.npz")
    for name, grid in extras.items():
        np.testing.assert_array_equal(getattr(loaded, name), grid)
        assert getattr(loaded, name).dtype == grid.dtype


def test_openings_come_back_with_their_corners(tmp_path):
    box = np.array([[0.1, 0.5, 0.5, 0.1], [0.2, 0.2, 0.9, 0.9]])
    triangle = np.array([[1.0, 1.2, 1.1], [0.0, 0.0, 0.3]])
    openings = (
        Opening("rectangle", box, area=0.28, depth=-0.1, glass_share=0.6),
        Opening("contour", triangle, area=0.03, depth=np.nan, glass_share=1.0),
    )
    save_segmentation(
        tmp_path / "s.npz", make_segmentation().replace(openings=openings)
    )
    loaded = load_segmentation(tmp_path / "s.npz").openings
    assert [opening.kind for opening in loaded] == ["rectangle", "contour"]
    for one, other in zip(loaded, openings, strict=True):
        np.testing.assert_array_equal(one.p_TVs, other.p_TVs)
        np.testing.assert_array_equal(
            [one.area, one.depth, one.glass_share],
            [other.area, other.depth, other.glass_share],
        )


def test_openings_that_do_not_belong_together_are_refused(tmp_path):
    path = tmp_path / "s.npz"
    save_segmentation(path, make_segmentation())
    with np.load(path) as file:
        content = dict(file)
    np.savez(path, **content, opening_kind=np.array(["rectangle"]))
    with pytest.raises(CloudReadError, match="opening_area is missing"):
        load_segmentation(path)


def test_file_has_the_names_and_types_of_the_design(tmp_path):
    save_segmentation(tmp_path / "segmentation.npz", make_segmentation())
    with np.load(tmp_path / "segmentation.npz") as file:
        found = {name: (file[name].dtype.name, file[name].shape) for name in file}
    assert found == {
        "labels": ("uint16", (2, 3)),
        "depth": ("float32", (2, 3)),
        "wall_mask": ("bool", (2, 3)),
        "X_WT": ("float64", (4, 4)),
        "cell": ("float64", ()),
    }


def test_mask_has_its_top_row_first(tmp_path):
    save_wall_mask(tmp_path / "wall_mask.png", make_segmentation().wall_mask)
    picture = np.asarray(Image.open(tmp_path / "wall_mask.png"))
    np.testing.assert_array_equal(picture, [[0, 255, 0], [255, 255, 0]])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"labels": None}, "labels is missing"),
        ({"depth": np.zeros((3, 2))}, r"depth has shape \(3, 2\)"),
        ({"X_WT": np.zeros((4, 4))}, "X_WT is not a rigid transform"),
        ({"X_WT": np.diag([1.0, 1.0, -1.0, 1.0])}, "X_WT is not a rigid transform"),
        ({"cell": 0.0}, "cell must be > 0 m, got 0.0"),
    ],
)
def test_wrong_content_is_refused(tmp_path, changes, message):
    path = tmp_path / "segmentation.npz"
    save_segmentation(path, make_segmentation())
    with np.load(path) as file:
        content = {**file, **changes}
    np.savez(path, **{name: x for name, x in content.items() if x is not None})
    with pytest.raises(CloudReadError, match=message):
        load_segmentation(path)


def test_missing_damaged_and_foreign_files_are_refused(tmp_path):
    path = tmp_path / "segmentation.npz"
    with pytest.raises(CloudReadError, match="no such file"):
        load_segmentation(path)
    save_segmentation(path, make_segmentation())
    path.write_bytes(path.read_bytes()[:200])
    with pytest.raises(CloudReadError, match="not a segmentation"):
        load_segmentation(path)
    np.save(tmp_path / "lone.npy", np.zeros(3))
    with pytest.raises(CloudReadError, match="labels is missing"):
        load_segmentation(tmp_path / "lone.npy")
