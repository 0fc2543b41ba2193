"""The voxel grid."""

from __future__ import annotations

import numpy as np
import pytest

from haptic_env.grid import Grid


def test_grid_is_centred_and_covers_its_extent():
    grid = Grid.around((0.01, 0.02, 0.03), (0.1, 0.08, 0.06), 0.004)
    assert grid.shape == (25, 20, 15)
    np.testing.assert_allclose(grid.centre, (0.01, 0.02, 0.03))
    np.testing.assert_allclose(grid.extent, (0.1, 0.08, 0.06))
    np.testing.assert_allclose(grid.centres().reshape(-1, 3).mean(axis=0), grid.centre)


def test_index_inverts_centres():
    grid = Grid.around((0.0, 0.0, 0.0), (0.05, 0.04, 0.03), 0.005)
    cells, inside = grid.index(grid.centres())
    np.testing.assert_array_equal(cells, np.moveaxis(np.indices(grid.shape), 0, -1))
    assert inside.all()


def test_points_outside_are_known_as_such():
    grid = Grid((0.0, 0.0, 0.0), 0.01, (2, 3, 4))
    cells, inside = grid.index([[-1e-9, 0, 0], [0.0, 0.0, 0.0], [0.02, 0, 0], [0.0199, 0.0299, 0.0399]])
    np.testing.assert_array_equal(inside, [False, True, False, True])
    np.testing.assert_array_equal(cells[3], [1, 2, 3])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (((0, 0, 0), (0.1, 0.1, 0.1), 0.0), "grid resolution must be .* got 0.0"),
        (((0, 0, 0), (0.1, 0.1, 0.1), np.nan), "grid resolution must be .* got nan"),
        (((0, 0, 0), (0.1, 0.0, 0.1), 0.004), "grid extent must be positive"),
        (((0, 0), (0.1, 0.1, 0.1), 0.004), "grid centre must be"),
        (((1e17, 0, 0), (0.1, 0.1, 0.1), 0.004), r"grid centre must lie in \[-100, 100\] m, got .*1e\+17"),
        (((0, 0, 0), (0.1, 1e300, 0.1), 0.004), r"grid extent must lie in .* m, got .*1e\+300"),
        (((0, 0, 0), (0.1, 0.1, 0.1), 1e-300), r"grid resolution must be .* in \[1e-05, 1\] m, got 1e-300"),
        (((0, 0, 0), (2.0, 2.0, 2.0), 0.004), "a grid of 500 × 500 × 500 voxels .* too large .* 16777216 are possible"),
    ],
)
def test_impossible_grids_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        Grid.around(*arguments)


@pytest.mark.parametrize(
    ("origin", "resolution", "shape", "message"),
    [
        ((np.nan, 0, 0), 0.004, (9, 9, 9), "grid origin must be finite .*nan at index 0"),
        ((0, 0, 101.0), 0.004, (9, 9, 9), r"grid origin must lie in \[-100, 100\] m"),
        ((0, 0), 0.004, (9, 9, 9), r"grid origin must be .* got shape \(2,\)"),
        ((0, 0, 0), -0.004, (9, 9, 9), "grid resolution must be .* got -0.004"),
        ((0, 0, 0), "0.004", (9, 9, 9), "grid resolution must be .* got '0.004'"),
        ((0, 0, 0), 0.004, (-9, 9, 9), "grid shape must be an integer of at least 1, got -9"),
        ((0, 0, 0), 0.004, (0, 9, 9), "grid shape must be an integer of at least 1, got 0"),
        ((0, 0, 0), 0.004, (9.5, 9, 9), "grid shape must be an integer of at least 1, got 9.5"),
        ((0, 0, 0), 0.004, (9, 9), r"grid shape must be three counts, got \(9, 9\)"),
        ((0, 0, 0), 0.004, 9, "grid shape must be three counts, got 9"),
        ((0, 0, 0), 0.004, (2**30, 2**30, 2**30), "a grid of 1073741824 × .* too large"),
    ],
)
def test_impossible_grids_are_refused_however_they_are_made(origin, resolution, shape, message):
    with pytest.raises(ValueError, match=message):
        Grid(origin, resolution, shape)


def test_the_same_grid_is_equal_whatever_it_was_made_of():
    plain = Grid((0.0, 0.5, 0.0), 0.004, (2, 3, 4))
    other = Grid(np.array([0, 0.5, 0]), np.float64(0.004), np.array([2, 3, 4]))
    assert (other, hash(other)) == (plain, hash(plain))


def test_points_far_away_are_outside_and_their_indices_numbers():
    grid = Grid((0.0, 0.0, 0.0), 1e-5, (2, 3, 4))
    cells, inside = grid.index([[1e300, 0, 0], [0, -1e300, 0]])
    assert not inside.any()
    assert cells[0, 0] > 0 > cells[1, 1]


@pytest.mark.parametrize("points", [[np.nan, 0, 0], [[0, 0, np.inf]], 3.0, [0.0, 0.0], "here", [1j, 0, 0]])
def test_points_that_are_none_are_refused(points):
    with pytest.raises(ValueError, match="points must be"):
        Grid((0.0, 0.0, 0.0), 0.01, (2, 3, 4)).index(points)
