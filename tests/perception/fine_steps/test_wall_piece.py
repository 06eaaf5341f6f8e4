"""Pieces of a wall on made-up blocks: planes, bulges, waves, doors, patches beside."""

import numpy as np
import pytest

from perception.fine_steps.wall_piece import (
    Blocks,
    extend_piece,
    fit_piece,
    plane_heights,
    surface_normals,
)

CELL, COUNT = 0.04, 50  # Blocks of 2 x 2 m.
AXIS = (np.arange(COUNT) + 0.5) * CELL
X, Y = np.meshgrid(AXIS, AXIS)
EVERYWHERE = np.ones(X.shape, dtype=bool)
SLOPED = 0.01 + 0.02 * X - 0.03 * Y
LEFT = X < 0.8


def blocks_of(depth, patches=None):
    """Blocks without noise, of one patch if not told otherwise."""
    return Blocks(
        depth=depth,
        patches=np.zeros(depth.shape, np.int64) if patches is None else patches,
        y=AXIS,
        x=AXIS,
        within=np.array([AXIS[[0, -1]], AXIS[[0, -1]]]),
        cell=CELL,
        noise=0.0,
        rng=np.random.default_rng(1),
    )


@pytest.mark.parametrize(
    "height",
    [SLOPED, 0.03 * ((X - 1.0) ** 2 + (Y - 1.0) ** 2), 0.05 * (X - 1.0) * (Y - 1.0)],
    ids=["plane", "bulge", "twist"],
)
def test_a_quadratic_wall_is_fitted_through_a_door(height):
    # The penalty is on third differences: quadratics are free of it, and a door 20 mm
    # deeper has no weight at the end.
    door = (X > 1.2) & (X < 1.7) & (Y < 1.2)
    piece = fit_piece(blocks_of(height - 0.02 * door), EVERYWHERE)
    np.testing.assert_allclose(piece.height, height, atol=1e-4)


def test_a_long_wave_is_followed():
    # Cubic splines with knots h apart are off by up to (2 pi h / L)^4 / 384 of a wave
    # of length L: 0.16 mm of 10 mm at h = 0.25 m and L = 1 m. The penalty and the ends
    # add to it, but no more than the wall may scatter, 1.2 mm.
    wave = 0.01 * np.sin(2.0 * np.pi * X)
    piece = fit_piece(blocks_of(wave), EVERYWHERE)
    assert np.sqrt(np.mean((piece.height - wave) ** 2)) < 1.2e-3


def test_a_plate_is_bridged():
    plate = (np.abs(X - 1.0) < 0.1) & (np.abs(Y - 1.0) < 0.1)
    piece = fit_piece(blocks_of(SLOPED + 0.012 * plate), EVERYWHERE)
    np.testing.assert_allclose(piece.height, SLOPED, atol=1e-4)


def parted(*sides, depth=SLOPED):
    """Blocks in patches: the wall on the left is 0, then the sides by number."""
    patches = np.where(LEFT, 0, -1)
    for number, side in enumerate(sides, start=1):
        patches[side] = number
    return blocks_of(np.where(patches >= 0, depth, np.nan), patches)


def test_only_the_patches_that_continue_the_surface_join():
    level = (X > 1.0) & (Y < 1.0)
    deeper = (X > 1.0) & (Y > 1.2)
    blocks = parted(level, deeper, depth=SLOPED - 0.02 * deeper)
    piece = extend_piece(fit_piece(blocks, LEFT), blocks)
    np.testing.assert_array_equal(piece.cells, LEFT | level)
    np.testing.assert_allclose(piece.height[~deeper], SLOPED[~deeper], atol=1e-4)
    again = extend_piece(piece, blocks)
    np.testing.assert_array_equal(again.cells, piece.cells)


def test_a_single_block_does_not_join():
    # 0.04 x 0.04 m are 0.0016 m², under the 0.002 m² of a patch.
    single = np.zeros_like(LEFT)
    single[10, 40] = True
    blocks = parted(single)
    piece = extend_piece(fit_piece(blocks, LEFT), blocks)
    np.testing.assert_array_equal(piece.cells, LEFT)


@pytest.mark.parametrize(("start", "joins"), [(0.9, False), (1.5, True)])
def test_a_surface_may_be_farther_off_where_it_is_extrapolated(start, joins):
    # 12 mm off; 3 mm and 2 % of the distance are allowed, 12 mm at 0.45 m. A strip
    # 0.2 m wide lies nearer than that from 0.1 m on, and farther from 0.7 m on.
    strip = (start < X) & (start + 0.2 > X)
    blocks = parted(strip, depth=0.012 * strip)
    piece = extend_piece(fit_piece(blocks, LEFT), blocks)
    assert piece.cells[strip].all() == piece.cells[strip].any() == joins


def test_the_plane_is_that_of_the_most_blocks():
    door = X > 1.4  # 3 of 10.
    heights = plane_heights(blocks_of(SLOPED - 0.02 * door), EVERYWHERE)
    np.testing.assert_allclose(heights, SLOPED, atol=1e-6)


def test_a_plane_too_steep_for_a_wall_gives_the_median():
    # A slope of 2 is turned by 63 deg, one of 1.5 by 56 deg; 60 deg is the bound.
    steep = plane_heights(blocks_of(2.0 * X), EVERYWHERE)
    np.testing.assert_allclose(steep, np.median(2.0 * X))
    slanted = plane_heights(blocks_of(1.5 * X), EVERYWHERE)
    np.testing.assert_allclose(slanted, 1.5 * X, atol=1e-6)


def test_normals_point_out_of_the_wall():
    normals = surface_normals(SLOPED, CELL)
    expected = np.array([-0.02, 0.03, 1.0]) / np.sqrt(1.0 + 0.02**2 + 0.03**2)
    np.testing.assert_allclose(normals, np.broadcast_to(expected, (*X.shape, 3)))
