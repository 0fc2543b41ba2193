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
    ],
)
def test_impossible_grids_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        Grid.around(*arguments)
