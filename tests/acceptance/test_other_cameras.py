"""Other cameras, and one turned by 90 deg, see all of the tile and find the wall."""

import numpy as np
import pytest

from benchmarks.support.scanned_scenes import scan_and_segment
from painter.config import load_scenario
from painter.run.figures.mask_figures import mask_iou
from painter.scene import SurfaceKind
from tests.cameras import CAMERAS, write_cell

pytestmark = [pytest.mark.slow, pytest.mark.timeout(1800)]


@pytest.mark.parametrize(
    ("camera", "mount"), [("D415", "level"), ("D455", "level"), ("D435", "C x up")]
)
def test_tile_is_seen_whole_and_segmented(tmp_path, camera, mount):
    cell = write_cell(tmp_path, mount)
    overrides = [*CAMERAS[camera], f"directives={cell}"]
    dut = scan_and_segment(load_scenario("cubes", overrides))
    assert (np.asarray(dut.segmentation.labels) > 0).all()
    assert mask_iou(dut.segmentation.wall_mask, dut.kind == SurfaceKind.WALL) >= 0.97
