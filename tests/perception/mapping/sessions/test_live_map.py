import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix

from perception.config import MapConfig
from perception.depth_camera.depth import CameraIntrinsics, depth_points, usable_pixels
from perception.mapping.config import PoseGraphConfig
from perception.mapping.fusion.voxel_map import VoxelMap
from perception.mapping.sessions.live_map import LiveMap

CAMERA = CameraIntrinsics(fx=130.0, fy=130.0, cx=119.5, cy=71.5, width=240, height=144)
SIZE = (2.0, 2.0)
CONFIG = MapConfig(voxel_size=0.02, min_count=1)
# T's z comes out of the wall, which lies in W's x = 1 and not quite where expected.
X_WT = RigidTransform(
    RotationMatrix([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
    [1.0, 1.0, 0.0],
)
X_WS = X_WT @ RigidTransform(RollPitchYaw(0.01, -0.015, 0.0), [0.0, 0.0, 0.004])
LOOKING = RotationMatrix(np.diag([1.0, -1.0, -1.0]))
MOUNT = RigidTransform(RollPitchYaw(np.deg2rad([0.2, -0.2, 0.0])), [0.002, 0.0, 0.0])


def depth_of_wall(X_WC):
    """The wall S's z = 0 through the pinhole, to the mm: no noise but the rounding."""
    X_SC = X_WS.inverse() @ X_WC
    u = (np.arange(CAMERA.width) - CAMERA.cx) / CAMERA.fx
    v = (np.arange(CAMERA.height) - CAMERA.cy)[:, None] / CAMERA.fy
    along = X_SC.rotation().matrix()[2]
    depth = -X_SC.translation()[2] / (along[0] * u + along[1] * v + along[2])
    return np.rint(1000.0 * depth).astype(np.uint16)


def places():
    """Two rows along the wall, 0.7 m before it."""
    across = np.linspace(0.4, 1.6, 9)
    p_TCs = [(x, y, 0.7) for y in (0.6, 1.4) for x in across]
    return [X_WT @ RigidTransform(LOOKING, p) for p in p_TCs]


def scanned(mount):
    dut = LiveMap.empty(X_WT, SIZE, CONFIG, CAMERA, PoseGraphConfig())
    for time, X_WN in enumerate(places()):
        dut = dut.fused(float(time), depth_of_wall(X_WN @ mount), X_WN)
    return dut


def wall_in_S(surface):
    """Tilts against the true wall, deg, its height there and the spread, m."""
    x, y, z = X_WS.inverse() @ surface.p_WQs
    terms = np.stack([x - 1.0, y - 1.0, np.ones_like(x)], axis=1)
    slope_x, slope_y, height = np.linalg.lstsq(terms, z, rcond=None)[0]
    away = z - terms @ [slope_x, slope_y, height]
    return np.degrees([slope_x, slope_y]), height, away.std()


@pytest.fixture(scope="module")
def tilted():
    return scanned(MOUNT)


def test_a_good_arm_is_believed_to_the_bit():
    dut = scanned(RigidTransform())
    voxels = VoxelMap.empty(X_WT, *SIZE, CONFIG)
    for X_WC in places():
        depth_mm = depth_of_wall(X_WC)
        usable = usable_pixels(depth_mm, CONFIG)
        p_CQs = depth_points(depth_mm, usable, CAMERA, CONFIG.stride)
        voxels = voxels.fuse(X_WC @ p_CQs, X_WC.translation())
    assert dut.moved_by < 3e-4  # What rounding to mm and its planes come to.
    np.testing.assert_array_equal(dut.surface_map.p_WQs, voxels.surface_map.p_WQs)
    np.testing.assert_array_equal(dut.surface_map.counts, voxels.surface_map.counts)


def test_a_mounts_tilt_is_found_and_undone(tilted):
    by_arm = wall_in_S(tilted.voxels.surface_map)
    tilt, _, spread = wall_in_S(tilted.surface_map)
    # Where a patch is tilted by 0.28 deg, 0.3 m from its middle it is 1.5 mm off.
    assert by_arm[2] > 3e-4
    assert spread < 0.6 * by_arm[2]
    assert np.abs(tilt).max() < 0.02
    assert np.degrees(tilted.surface_map.mount_tilt) == pytest.approx(0.283, abs=0.03)
    found = RollPitchYaw(tilted.solution.mount.rotation()).vector()
    np.testing.assert_allclose(np.degrees(found), [0.2, -0.2, 0.0], atol=0.03)


def test_what_a_bare_wall_cannot_show_stays_as_the_arm_has_it(tilted):
    # The mount is 2 mm beside its place as well: nothing tells.
    assert np.linalg.norm(tilted.solution.mount.translation()) < 1e-4
    turned = tilted.solution.estimate.mount_observed[2, 2]
    assert turned < 0.01


def test_a_restart_keeps_what_was_learned(tilted):
    dut = tilted.restarted(X_WS)
    assert dut.surface_map.frames == 0
    assert dut.X_NC.IsExactlyEqualTo(tilted.solution.mount)
    for time, X_WN in enumerate(places()):
        dut = dut.fused(100.0 + time, depth_of_wall(X_WN @ MOUNT), X_WN)
    assert not dut.is_moved  # So nothing is fused twice.
    assert np.abs(wall_in_S(dut.surface_map)[0]).max() < 0.02
    good = scanned(RigidTransform()).restarted(X_WS)
    assert good.X_NC.IsExactlyIdentity()


def test_few_pictures_become_keyframes(tilted):
    # 0.15 m apart and the next one at 0.3 m: every second one, and each row's first.
    assert len(tilted.graph.keyframes) == 10
    assert len(tilted.pictures) == 18


def test_a_picture_of_another_size_is_refused(tilted):
    with pytest.raises(ValueError, match="must be"):
        tilted.fused(0.0, np.full((10, 10), 700, np.uint16), X_WT)


def test_pictures_without_depth_are_no_surface_and_no_error():
    dut = LiveMap.empty(X_WT, SIZE, CONFIG, CAMERA, PoseGraphConfig())
    nothing = np.zeros((CAMERA.height, CAMERA.width), np.uint16)
    for time, X_WN in enumerate(places()[:3]):
        dut = dut.fused(float(time), nothing, X_WN)
    assert dut.surface_map.p_WQs.shape == (3, 0)
    assert dut.surface_map.mount_tilt == 0.0
    assert not dut.is_moved


def test_one_view_tells_nothing_of_the_mount():
    X_WN = places()[0]
    dut = LiveMap.empty(X_WT, SIZE, CONFIG, CAMERA, PoseGraphConfig())
    dut = dut.fused(0.0, depth_of_wall(X_WN @ MOUNT), X_WN)
    assert not dut.is_moved
    assert dut.surface_map.mount_tilt == pytest.approx(0.0, abs=1e-6)
