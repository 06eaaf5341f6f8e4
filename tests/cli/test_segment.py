"""`painter segment` from the words on the command line to the files."""

import json

import numpy as np
import pytest
from PIL import Image
from pydrake.math import RigidTransform, RotationMatrix

from painter.cli.main import run
from perception.io.segmentations import load_segmentation
from perception.synthetic.patch_wall import Patch, synthetic_wall

# As a camera sees it, 0.8 m ahead: T x = C x, T y = -C y, T z = -C z.
X_CT = RigidTransform(RotationMatrix(np.diag([1.0, -1.0, -1.0])), [-1.0, 1.0, 0.8])
BOX = Patch(0.2, 0.3, 0.7, 1.2, 0.1)


@pytest.fixture
def cloud(tmp_path):
    """A wall with a box low on the left, 1 cm apart, as an NPY file."""
    rng = np.random.default_rng(0)
    points = synthetic_wall([BOX], spacing=0.01, margin=0.0, X_WT=X_CT, rng=rng)
    np.save(tmp_path / "wall.npy", points.T)
    return tmp_path / "wall.npy"


def test_folder_holds_the_segmentation(cloud, tmp_path, capsys):
    out = tmp_path / "out"
    assert run(["segment", str(cloud), "--out", str(out), "--cell", "0.02"]) == 0
    assert sorted(path.name for path in out.iterdir()) == [
        "segmentation.json",
        "segmentation.npz",
        "segmentation.png",
        "wall_mask.png",
    ]
    result = load_segmentation(out / "segmentation.npz")
    assert result.wall_mask.shape == (100, 100)
    figures = json.loads((out / "segmentation.json").read_text())
    assert figures["wall_distance_m"] == pytest.approx(0.8, abs=1e-3)
    assert figures["wall_area_m2"] == pytest.approx(4.0 - 0.45, abs=0.05)
    assert figures["regions"][1]["median_depth_m"] == pytest.approx(0.1, abs=2e-3)
    picture = np.asarray(Image.open(out / "wall_mask.png"))
    # The box is low on the left: x 0.2 to 0.7 m, 0.3 to 1.2 m above the lower edge.
    assert (picture[45:80, 15:30] == 0).all()
    assert (picture[:35, 15:30] == 255).all()
    assert "wall_distance_m" in capsys.readouterr().out


def test_json_is_alone_on_stdout(cloud, tmp_path, capsys):
    words = ["segment", str(cloud), "--out", str(tmp_path / "out"), "--json"]
    assert run([*words, "--cell", "0.02"]) == 0
    assert json.loads(capsys.readouterr().out)["points"] == 40000


def test_units_and_up_are_taken(cloud, tmp_path):
    # The same cloud in mm and turned upside down: the box comes out high on the right.
    np.save(cloud, np.load(cloud) * 1000.0)
    words = ["segment", str(cloud), "--out", str(tmp_path / "out"), "--unit", "mm"]
    assert run([*words, "--up", "y", "--cell", "0.02", "--tile", "2x2"]) == 0
    mask = load_segmentation(tmp_path / "out" / "segmentation.npz").wall_mask
    assert not mask[45:80, 70:85].any()
    assert mask[:35, 15:85].all()


def test_same_words_same_files(cloud, tmp_path):
    for name in ("a", "b"):
        words = ["segment", str(cloud), "--out", str(tmp_path / name)]
        assert run([*words, "--cell", "0.02", "--seed", "3"]) == 0
    for name in ("segmentation.json", "wall_mask.png"):
        one, other = ((tmp_path / folder / name).read_bytes() for folder in "ab")
        assert one == other


def test_depth_image_is_taken(tmp_path):
    depth = np.full((120, 160), 700, dtype=np.uint16)
    Image.fromarray(depth).save(tmp_path / "depth.png")
    camera = {"width": 160, "height": 120, "fx": 80, "fy": 80, "cx": 80, "cy": 60}
    (tmp_path / "camera.json").write_text(json.dumps(camera))
    words = ["segment", str(tmp_path / "depth.png"), "--out", str(tmp_path / "out")]
    words += ["--intrinsics", str(tmp_path / "camera.json"), "--tile", "1x0.8"]
    assert run([*words, "--cell", "0.02"]) == 0
    result = load_segmentation(tmp_path / "out" / "segmentation.npz")
    assert result.wall_mask.mean() > 0.95


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--tile", "2"], "--tile must be WxH"),
        (["--tile", "2x-1"], "--tile must be > 0"),
        (["--tile", "0.001x1"], "smaller than a cell"),
        (["--tile", "900x900"], "more than 4e+06 cells"),
        (["--cell", "0.001", "--fine"], "than 400000 cells; take a smaller tile or"),
        (["--cell", "0"], "--cell must be > 0"),
        (["--distance", "-1"], "--distance must be > 0"),
        (["--up", "w"], "--up must be x, -x, ... -z or X,Y,Z, got 'w'"),
        (["--up", "0,0,0"], "--up must be"),
        (["--viewpoint", "1,2"], "--viewpoint must be X,Y,Z in m, got '1,2'"),
        (["--viewpoint", "1,2,nan"], "--viewpoint must be"),
        (["--set-back", "-1"], "--set-back must be >= 0 m"),
        (["--max-range", "0"], "--max-range must be > 0 m"),
        (["--inlier-distance", "nan"], "--inlier-distance must be > 0 m"),
        (["--unit", "mile"], "'mile' is not one of"),
        (["--set", "segmentation.nonsense=1"], "nonsense"),
        (["--intrinsics", "camera.json"], "is no depth PNG and takes no intrinsics"),
    ],
)
def test_wrong_use_is_one_line_and_exit_2(cloud, tmp_path, capsys, words, message):
    assert run(["segment", str(cloud), "--out", str(tmp_path / "out"), *words]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("array", "code", "message"),
    [
        (np.zeros((0, 3)), 2, "no points"),
        (np.full((500, 3), np.nan), 2, "none of the 500 points is finite"),
        (np.ones((50, 3)), 1, "50 finite points"),
        (np.outer(np.arange(500.0), [1, 2, 3]), 1, "no plane is a wall: there is none"),
    ],
)
def test_unusable_clouds_leave_no_folder(tmp_path, capsys, array, code, message):
    np.save(tmp_path / "cloud.npy", array)
    words = ["segment", str(tmp_path / "cloud.npy"), "--out", str(tmp_path / "out")]
    assert run(words) == code
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["cloud.npy"]


def test_missing_file_is_exit_2(tmp_path, capsys):
    words = ["segment", str(tmp_path / "no.ply"), "--out", str(tmp_path / "out")]
    assert run(words) == 2
    assert "no.ply: no such file" in capsys.readouterr().err


def test_viewpoint_turns_the_wall_round(cloud, tmp_path):
    words = ["segment", str(cloud), "--out", str(tmp_path / "out"), "--cell", "0.02"]
    assert run([*words, "--viewpoint", "0,0,5"]) == 0
    figures = json.loads((tmp_path / "out" / "segmentation.json").read_text())
    assert figures["seen_from"] == "given"
    np.testing.assert_allclose(figures["wall_normal"], [0.0, 0.0, 1.0], atol=1e-3)
    # From behind, the box low on the left is a recess low on the right.
    mask = load_segmentation(tmp_path / "out" / "segmentation.npz").wall_mask
    assert not mask[20:55, 70:85].any()


def test_folder_of_depth_images_is_fused_with_the_camera_beside_it(tmp_path):
    for number, depth in enumerate((700, 700, 3000)):
        image = np.full((120, 160), depth, dtype=np.uint16)
        Image.fromarray(image).save(tmp_path / f"depth_{number}.png")
    camera = {"width": 160, "height": 120, "fx": 80, "fy": 80, "cx": 80, "cy": 60}
    (tmp_path / "intrinsics.json").write_text(json.dumps(camera))
    assert run(["segment", str(tmp_path), "--out", str(tmp_path / "out")]) == 0
    figures = json.loads((tmp_path / "out" / "segmentation.json").read_text())
    assert figures["wall_distance_m"] == pytest.approx(0.7)
    # 159 x 119 pixels of 0.7 / 80 m.
    assert figures["wall_area_m2"] == pytest.approx(1.39 * 1.04, rel=0.03)


def test_fine_steps_find_what_the_planes_cannot_part(tmp_path):
    # A plate 12 mm high is within the planes' 3 cm, and a window on a bulged wall.
    window = Patch(0.2, 1.2, 0.7, 1.8, -0.10)
    plate = Patch(1.2, 0.4, 1.4, 0.6, 0.012)
    rng = np.random.default_rng(0)
    patches = [window, plate]
    points = synthetic_wall(patches, spacing=0.01, margin=0.0, noise=0.0007, rng=rng)
    points[2] += 0.02 * (points[0] - 1.0) ** 2
    np.save(tmp_path / "wall.npy", (X_CT @ points).T)
    words = ["segment", str(tmp_path / "wall.npy"), "--cell", "0.02", "--tile", "2x2"]
    words += ["--inlier-distance", "0.03"]
    assert run([*words, "--out", str(tmp_path / "plain")]) == 0
    assert run([*words, "--out", str(tmp_path / "fine"), "--fine"]) == 0
    plain = load_segmentation(tmp_path / "plain" / "segmentation.npz")
    fine = load_segmentation(tmp_path / "fine" / "segmentation.npz")
    on_plate = (slice(22, 28), slice(62, 68))
    assert plain.wall_mask[on_plate].all()
    assert not fine.wall_mask[on_plate].any()
    (opening,) = fine.openings
    np.testing.assert_allclose(
        opening.p_TVs, [[0.2, 0.7, 0.7, 0.2], [1.2, 1.2, 1.8, 1.8]], atol=0.025
    )
    figures = json.loads((tmp_path / "fine" / "segmentation.json").read_text())
    assert figures["not_painted_m2"]["raised"] == pytest.approx(0.04, abs=0.008)
    assert figures["openings"][0]["depth_m"] == pytest.approx(-0.10, abs=0.005)
