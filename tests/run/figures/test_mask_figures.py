"""Figures of the mask, against masks whose overlap and distance are counted by hand."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw

from painter.run.figures.mask_figures import (
    boundary,
    edge_errors,
    mask_figures,
    mask_iou,
    tile_figures,
)


def mask_with_hole(rows, columns, shape=(20, 20)):
    mask = np.ones(shape, dtype=bool)
    mask[rows, columns] = False
    return mask


def test_iou_is_common_over_joint_area():
    left, right = np.zeros((2, 10), bool), np.zeros((2, 10), bool)
    left[:, :6], right[:, 4:] = True, True
    assert mask_iou(left, right) == pytest.approx(4 / 20)


def test_equal_and_empty_masks_agree():
    empty = np.zeros((3, 3), bool)
    assert mask_iou(empty, empty) == 1.0
    assert mask_iou(~empty, ~empty) == 1.0


def test_grids_of_different_shape_are_refused():
    with pytest.raises(ValueError, match=r"\(3, 3\).*\(3, 4\)"):
        mask_iou(np.ones((3, 3), bool), np.ones((3, 4), bool))


def test_border_of_the_grid_is_no_boundary():
    assert not boundary(np.ones((5, 5), bool)).any()


def test_boundary_is_the_ring_of_wall_around_a_hole():
    edge = boundary(mask_with_hole(slice(5, 8), slice(5, 9)))
    # Two rows of 4 and two columns of 3; corners touch the hole at a point only.
    assert np.count_nonzero(edge) == 2 * 4 + 2 * 3


def test_edge_error_of_a_hole_one_cell_too_large_is_one_cell():
    truth = mask_with_hole(slice(5, 15), slice(5, 15))
    dut = mask_with_hole(slice(4, 16), slice(4, 16))
    errors = edge_errors(dut, truth, 0.01)
    # Every cell of the larger ring has its neighbour in the true ring, but for the 8
    # at the corners, which are sqrt(2) away.
    assert np.count_nonzero(np.isclose(errors, 0.01)) == errors.size - 8
    assert errors.max() == pytest.approx(np.sqrt(2) * 0.01)
    assert mask_figures(dut, truth, 0.01)["mask_edge_error_median_m"] == 0.01


def test_blank_wall_has_no_edge_error():
    blank = np.ones((4, 4), bool)
    figures = mask_figures(blank, blank, 0.01)
    assert figures["mask_iou"] == 1.0
    assert figures["mask_edge_error_median_m"] is None
    assert figures["mask_edge_error_p95_m"] is None


def test_tile_offset_is_expressed_along_the_wall():
    X_ST = RigidTransform(RollPitchYaw(0.0, np.deg2rad(2.0), 0.0), [0.03, -0.01, 0.005])
    figures = tile_figures(X_ST)
    assert figures["tile_offset_m"] == pytest.approx([0.03, -0.01])
    assert figures["wall_distance_error_m"] == pytest.approx(0.005)
    assert figures["wall_tilt_error_deg"] == pytest.approx(2.0)
