import itertools

import pytest

from perception.config import StereoConfig
from perception.depth_camera.depth import CameraIntrinsics
from perception.synthetic.sequences import SequenceConfig, WallKind, render_sequence

# Half the pixels each way: the same field of view in a quarter of the time.
STEREO = StereoConfig(width=424, height=240, fattening=5)
INTRINSICS = CameraIntrinsics.from_stereo(STEREO)


def sequence(wall, count, **errors):
    """The first frames of a scan, with their true poses."""
    config = SequenceConfig(wall=wall, rate=2.5, stereo=STEREO, **errors)
    return list(itertools.islice(render_sequence(config, 7), count))


@pytest.fixture(scope="session")
def intrinsics():
    return INTRINSICS


@pytest.fixture(scope="session")
def blank_scan():
    return sequence(WallKind.BLANK, 24, mount_error=0.003, mount_error_deg=0.3)


@pytest.fixture(scope="session")
def textured_scan():
    return sequence(WallKind.TEXTURED, 16)
