"""PLY files that are written here."""

import numpy as np
import open3d as o3d
import pytest

from perception.io.clouds import read_fields
from perception.io.ply import write_ply

FIELDS = {
    "x": np.array([1.0, 0.1, -3.0]),
    "y": np.array([2.0, 0.2, -1.0]),
    "z": np.array([3.0, 0.3, -2.0]),
    "variance": np.array([1e-6, 0.1, 3.0], np.float32),
    "red": np.array([0, 128, 255], np.uint8),
    "count": np.array([1, -2, 3_000_000], np.int32),
}


def test_fields_read_back_with_their_types(tmp_path):
    write_ply(tmp_path / "cloud.ply", FIELDS, comment="three points")
    read = read_fields(tmp_path / "cloud.ply")
    for name, values in FIELDS.items():
        np.testing.assert_array_equal(read[name].ravel(), values)
        assert read[name].dtype == values.dtype


def test_open3d_reads_the_same(tmp_path):
    write_ply(tmp_path / "cloud.ply", FIELDS, comment="three points")
    cloud = o3d.t.io.read_point_cloud(str(tmp_path / "cloud.ply"))
    positions = np.stack([FIELDS[name] for name in "xyz"], axis=1)
    np.testing.assert_array_equal(cloud.point.positions.numpy(), positions)
    np.testing.assert_array_equal(cloud.point["count"].numpy()[:, 0], FIELDS["count"])


def test_no_points_are_a_file_too(tmp_path):
    empty = {name: values[:0] for name, values in FIELDS.items()}
    write_ply(tmp_path / "cloud.ply", empty, comment="none")
    assert read_fields(tmp_path / "cloud.ply").shape == (0,)


@pytest.mark.parametrize("dtype", [np.int64, np.complex128])
def test_types_that_ply_lacks_are_refused(tmp_path, dtype):
    fields = FIELDS | {"count": np.zeros(3, dtype)}
    with pytest.raises(KeyError):
        write_ply(tmp_path / "cloud.ply", fields, comment="three points")
