"""The voxels about a bone, against all voxels of the grid."""

from __future__ import annotations

import numpy as np
import pytest

from haptic_env.grid import Grid
from observer.maps import capsules, free_space
from tests.observer.hands import many_patches

RESOLUTION = 0.004
AXES = {"z": (0, 0, 1), "-z": (0, 0, -1), "x": (1, 0, 0), "nearly z": (1e-6, 0, 1), "askew": (1, -2, 0.5)}
PLACES = {"inside": (0.0113, 0.0007, -0.0098), "half outside": (0.0453, -0.0309, 0.0412), "outside": (0.5, 0.0, 0.0)}


def _found(grid, at, axis, length, reach):
    """Cells, heights along the bone and squared distances, as the kernel has them."""
    count = int(np.prod(grid.shape)) + 1
    room = free_space.CapsuleVoxels(np.full(count, -1), *np.full((2, count), np.nan), np.full(count, -1))
    number = free_space.capsule_voxels(capsules.lattice_of(grid), tuple(at), tuple(axis), length, reach, room)
    assert (room.cell[number:] == -1).all()
    return room.cell[:number], room.along[:number], room.square[:number]


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("direction", AXES)
@pytest.mark.parametrize(("length", "reach"), [(0.0, 0.009), (0.03, 0.001), (0.04, 0.012)])
def test_they_are_those_within_reach(place, direction, length, reach):
    grid = Grid.around(np.zeros(3), (0.1, 0.08, 0.09), RESOLUTION)
    at, axis = np.array(PLACES[place]), np.array(AXES[direction]) / np.linalg.norm(AXES[direction])
    cell, along, square = _found(grid, at, axis, length, reach)
    way = grid.centres().reshape(-1, 3) - at
    height = way @ axis
    distance = np.linalg.norm(way - height.clip(0.0, length)[:, None] * axis, axis=1)
    np.testing.assert_array_equal(cell, np.flatnonzero(distance < reach))
    np.testing.assert_allclose(along, height[cell], atol=1e-12)
    np.testing.assert_allclose(np.sqrt(square), distance[cell], atol=1e-9)


def test_there_is_room_for_them():
    """Wherever the bone lies between the voxels: more than there ever are."""
    rng, hand = np.random.default_rng(0), many_patches()
    body = capsules.body_of(hand.patches, RESOLUTION)
    grid = Grid.around(np.zeros(3), np.full(3, 0.3), RESOLUTION)
    for _ in range(200):
        link, reach = rng.integers(len(body.radius)), rng.uniform(0.0, 0.03)
        axis = rng.standard_normal(3)
        axis /= np.linalg.norm(axis)
        cell, _, _ = _found(grid, rng.uniform(-0.01, 0.01, 3), axis, body.layout.length[link], reach)
        assert len(cell) < free_space.most_voxels(body, capsules.lattice_of(grid), link, reach)
