"""Clouds are read whole, or refused with the reason."""

import json

import numpy as np
import open3d as o3d
import pytest
from PIL import Image

from perception.errors import CloudReadError
from perception.io.clouds import read_cloud
from perception.io.depth_images import read_depth

POINTS = np.random.default_rng(0).uniform(-2.0, 2.0, (3, 200)).astype(np.float32)
CAMERA = {"width": 4, "height": 3, "fx": 2.0, "fy": 4.0, "cx": 1.0, "cy": 2.0}


def write_open3d(path, **options):
    """Writes POINTS as PLY or PCD."""
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(POINTS.T.astype(float)))
    assert o3d.io.write_point_cloud(path, cloud, **options)


WRITERS = {
    "binary.ply": lambda path: write_open3d(path),
    "text.ply": lambda path: write_open3d(path, write_ascii=True),
    "binary.pcd": lambda path: write_open3d(path),
    "compressed.pcd": lambda path: write_open3d(path, compressed=True),
    "text.pcd": lambda path: write_open3d(path, write_ascii=True),
    "text.xyz": lambda path: np.savetxt(path, POINTS.T, header="x y z"),
    "rows.npy": lambda path: np.save(path, POINTS.T),
    "columns.npy": lambda path: np.save(path, POINTS),
    "lone.npz": lambda path: np.savez(path, anything=POINTS.T),
    "named.npz": lambda path: np.savez_compressed(path, a=[1], points=POINTS.T),
}


@pytest.fixture(params=WRITERS)
def cloud_file(request, tmp_path):
    """A file of POINTS in each form."""
    path = tmp_path / request.param
    WRITERS[request.param](path)
    return path


def test_every_form_gives_the_same_points(cloud_file):
    points = read_cloud(cloud_file).p_WQs
    assert points.shape == (3, 200)
    assert points.dtype == np.float64
    # Open3D writes six digits as text.
    np.testing.assert_allclose(points, POINTS, atol=1e-5)


@pytest.mark.parametrize("share", [0.01, 0.5, 0.97])
def test_truncated_file_is_refused(cloud_file, share, capfd):
    if cloud_file.suffix == ".xyz":
        pytest.skip("a list of lines does not say how many there are")
    data = cloud_file.read_bytes()
    cloud_file.write_bytes(data[: int(share * len(data))])
    with pytest.raises(CloudReadError, match=cloud_file.name) as error:
        read_cloud(cloud_file)
    assert "\n" not in str(error.value)
    assert capfd.readouterr() == ("", "")  # Open3D prints its own warnings.


def test_truncation_names_both_numbers(tmp_path):
    path = tmp_path / "cloud.ply"
    write_open3d(path)
    path.write_bytes(path.read_bytes()[:-25])
    # 200 points of three doubles are 4800 bytes.
    with pytest.raises(CloudReadError, match="200 points take 4800 bytes, .* has 4775"):
        read_cloud(path)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("missing.ply", None, "no such file"),
        ("empty.pcd", b"", "the file is empty"),
        ("cloud.las", b"LASF", "unknown cloud format '.las'"),
        ("bad.ply", b"plx\n", "begins with 'ply'"),
        ("endless.ply", b"ply\nformat ascii 1.0\n", "no line 'end_header'"),
        (
            "flat.ply",
            b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\n"
            b"property float y\nend_header\n0 0\n",
            "points have no z",
        ),
        (
            "none.ply",
            b"ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\n"
            b"property float y\nproperty float z\nend_header\n",
            "no points",
        ),
        ("short.ply", b"ply\nformat\nend_header\n", "header: a line is too short"),
        ("bare.pcd", b"FIELDS x y z\nDATA ascii\n", "'SIZE' is missing or unknown"),
        ("words.xyz", b"one two three\n", "expected lines of x, y and z"),
        ("two.xyz", b"1 2\n3 4\n", "expected lines of x, y and z"),
        ("junk.npy", b"\x93NUMPY junk", "cannot read the array"),
        ("junk.npz", b"PK\x03\x04 junk", "cannot read the array"),
    ],
)
def test_unusable_files_are_refused(tmp_path, name, content, message):
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(CloudReadError, match=message):
        read_cloud(path)


@pytest.mark.parametrize(
    ("array", "message"),
    [
        (np.zeros((5, 2)), r"\(N, 3\) or \(3, N\), got float64 of shape \(5, 2\)"),
        (np.zeros((3, 4, 5)), "shape"),
        (np.zeros((0, 3)), "no points"),
        (np.full((9, 3), np.nan), "none of the 9 points is finite"),
        (np.array([["a", "b", "c"]]), "expected numbers"),
    ],
)
def test_unusable_arrays_are_refused(tmp_path, array, message):
    np.save(tmp_path / "cloud.npy", array)
    with pytest.raises(CloudReadError, match=message):
        read_cloud(tmp_path / "cloud.npy")


def test_some_points_may_be_missing(tmp_path):
    points = POINTS.copy()
    points[:, :50] = np.nan
    np.save(tmp_path / "cloud.npy", points)
    assert np.isnan(read_cloud(tmp_path / "cloud.npy").p_WQs).sum() == 150


def write_depth(folder, depth, camera=CAMERA):
    """Writes a depth image and its camera; returns both paths."""
    Image.fromarray(np.asarray(depth)).save(folder / "depth.png")
    (folder / "camera.json").write_text(json.dumps(camera))
    return folder / "depth.png", folder / "camera.json"


def test_depth_follows_the_pinhole_model(tmp_path):
    depth = np.zeros((3, 4), dtype=np.uint16)
    depth[2, 1] = 500  # At the principal point.
    depth[0, 3] = 2000
    points = read_depth(*write_depth(tmp_path, depth))
    # x = (3 - 1) / 2 z and y = (0 - 2) / 4 z at z = 2 m; rows come in order.
    np.testing.assert_allclose(points, [[2.0, 0.0], [-1.0, 0.0], [2.0, 0.5]])


def test_depth_scale_is_used(tmp_path):
    depth = np.full((3, 4), 100, dtype=np.uint16)
    camera = CAMERA | {"depth_scale_m_per_unit": 0.01}
    np.testing.assert_allclose(
        read_depth(*write_depth(tmp_path, depth, camera))[2], 1.0
    )


def test_distortion_is_taken_off(tmp_path):
    # A point at x = 0.3, y = -0.2 (z = 1) seen through a lens with k1 and p1 alone.
    k1, p1, x, y = 0.1, 0.002, 0.3, -0.2
    r2 = x * x + y * y
    seen_x = x * (1 + k1 * r2) + 2 * p1 * x * y
    seen_y = y * (1 + k1 * r2) + p1 * (r2 + 2 * y * y)
    camera = CAMERA | {"fx": 1.0, "fy": 1.0, "cx": -seen_x, "cy": -seen_y}
    camera["distortion_k1k2p1p2k3"] = [k1, 0.0, p1, 0.0, 0.0]
    depth = np.zeros((3, 4), dtype=np.uint16)
    depth[0, 0] = 1000
    points = read_depth(*write_depth(tmp_path, depth, camera))
    np.testing.assert_allclose(points[:, 0], [x, y, 1.0], atol=1e-9)


@pytest.mark.parametrize(
    ("depth", "camera", "message"),
    [
        (np.zeros((3, 4), np.uint16), CAMERA, "no points"),
        (
            np.zeros((3, 4), np.uint16),
            CAMERA | {"distortion_k1k2p1p2k3": [0.1, 0, 0, 0, 0]},
            "no points",
        ),
        (np.zeros((3, 4), np.uint8), CAMERA, "expected 16-bit"),
        (np.ones((4, 3), np.uint16), CAMERA, "image is 3 x 4 px, .* is for 4 x 3 px"),
        (
            np.ones((3, 4), np.uint16),
            CAMERA | {"fx": -1.0},
            "fx must be > 0 px, got -1.0",
        ),
        (
            np.ones((3, 4), np.uint16),
            {"width": 4},
            "height must be > 0 px, got None",
        ),
        (np.ones((3, 4), np.uint16), [1, 2], "expected a JSON object"),
        (
            np.ones((3, 4), np.uint16),
            CAMERA | {"distortion_k1k2p1p2k3": [0.1]},
            "must be 5 numbers",
        ),
        (
            np.ones((3, 4), np.uint16),
            CAMERA | {"distortion_k1k2p1p2k3": 0.1},
            "not a camera",
        ),
        (np.ones((3, 4), np.uint16), CAMERA | {"cx": "1"}, "cx must be finite px"),
        (np.ones((3, 4), np.uint16), CAMERA | {"fy": 10**400}, "not a camera"),
    ],
)
def test_unusable_depth_images_are_refused(tmp_path, depth, camera, message):
    with pytest.raises(CloudReadError, match=message):
        read_depth(*write_depth(tmp_path, depth, camera))


def test_missing_or_damaged_depth_files_are_refused(tmp_path):
    image, camera = write_depth(tmp_path, np.ones((3, 4), np.uint16))
    with pytest.raises(CloudReadError, match=r"other\.json: no such file"):
        read_depth(image, tmp_path / "other.json")
    image.write_bytes(image.read_bytes()[:40])
    with pytest.raises(CloudReadError, match=r"depth\.png: cannot read the image"):
        read_depth(image, camera)
    camera.write_text("{")
    with pytest.raises(CloudReadError, match=r"camera\.json: not a camera"):
        read_depth(image, camera)
