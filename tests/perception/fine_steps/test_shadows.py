"""What a scan has left in shadow, on hand-made walls."""

import numpy as np
import pytest

from perception.fine_steps.shadows import find_relief
from perception.values import TileSize

CELL = 0.01


def scanned(*, hidden, top=0.1, offset=0.0):
    """Points 5 mm apart on a 1 x 1 m wall; nothing where `hidden(x, y)`.

    A box `top` high stands at x 0.4 to 0.6, y 0.4 to 0.6.
    """
    x, y = np.meshgrid(np.arange(0.0025, 1.0, 0.005), np.arange(0.0025, 1.0, 0.005))
    box = (abs(x - 0.5) < 0.1) & (abs(y - 0.5) < 0.1)
    z = np.where(box, top, 0.0) + offset
    seen = ~hidden(x, y) | box
    return np.stack([x[seen], y[seen], z[seen]])


def relief_of(p_TQs, p_TCs=None):
    p_TCs = np.zeros((3, 0)) if p_TCs is None else p_TCs
    return find_relief(p_TQs, p_TCs, TileSize(1.0, 1.0), cell=CELL)


@pytest.mark.parametrize("offset", [-0.01, 0.0, 0.01])
def test_wall_beside_a_box_is_hidden_as_far_as_an_edge_may_not_err(offset):
    beside = scanned(
        hidden=lambda x, y: (x > 0.34) & (x < 0.4) & (abs(y - 0.5) < 0.1), offset=offset
    )
    dut = relief_of(beside)
    rows, columns = np.nonzero(dut.hidden)
    # Six columns are in shadow; two of them are near enough to wall that was seen, and
    # so are two rows at either end.
    assert (columns.min(), columns.max()) == (36, 39)
    assert (rows.min(), rows.max()) == (42, 57)
    assert dut.height[50, 50] == pytest.approx(0.1)
    assert dut.height[50, 37] == 0.0


def test_slivers_beside_a_box_are_not_worth_a_look():
    sliver = scanned(hidden=lambda x, y: (x > 0.38) & (x < 0.4) & (abs(y - 0.5) < 0.1))
    assert not relief_of(sliver).hidden.any()


def test_holes_far_from_all_that_is_raised_are_no_shadows():
    pane = scanned(hidden=lambda x, y: (x < 0.15) & (y < 0.3))
    assert not relief_of(pane).hidden.any()


def test_a_map_of_nothing_hides_nothing():
    dut = relief_of(np.zeros((3, 0)))
    assert not dut.hidden.any()
    assert not dut.height.any()


def test_a_hole_that_pictures_should_have_shown_is_no_shadow():
    pane = scanned(hidden=lambda x, y: (x > 0.32) & (x < 0.38) & (abs(y - 0.5) < 0.1))
    from_the_right = np.array([np.linspace(0.5, 1.4, 10), [0.5] * 10, [0.7] * 10])
    from_the_left = from_the_right - [[0.5], [0.0], [0.0]]
    assert relief_of(pane, from_the_right).hidden.any()
    assert not relief_of(pane, from_the_left).hidden.any()
