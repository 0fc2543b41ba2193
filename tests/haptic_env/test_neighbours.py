"""Patches that share an edge, against walks over the skin."""

from __future__ import annotations

import numpy as np
import pytest

from haptic_env import hands
from haptic_env.neighbours import neighbours


@pytest.mark.parametrize("name", hands.HANDS)
@pytest.mark.parametrize(("along", "around"), [(2, 4), (1, 1), (1, 3), (4, 2), (6, 5)])
def test_neighbours_are_those_that_a_walk_along_or_around_meets(name, along, around):
    patches = hands.make(name, patches_along=along, patches_around=around).patches
    met = np.zeros((len(patches), len(patches)), dtype=bool)
    turns = 2 * np.pi * (np.arange(60 * around) + 0.5) / (60 * around)
    for index, link in enumerate(patches.links):
        rise = link.length * (np.arange(60) + 0.5) / 60
        polar = 0.5 * np.pi * (np.arange(60) + 0.5)[::-1] / 60 if link.tip else np.zeros(0)
        height = np.concatenate([rise, link.length + link.radius * np.cos(polar)])
        out = np.concatenate([np.full(60, link.radius), link.radius * np.sin(polar)])
        across = [out[:, None] * np.cos(turns), out[:, None] * np.sin(turns)]
        skin = np.stack([*across, np.tile(height[:, None], (1, len(turns)))], axis=-1).reshape(-1, 3)
        held = patches.locate(np.full(len(skin), index), skin).reshape(len(height), len(turns))
        for here, there in ((held[:-1], held[1:]), (held, np.roll(held, 1, axis=1))):
            met[here, there] = met[there, here] = True
    np.fill_diagonal(met, False)
    np.testing.assert_array_equal(neighbours(patches), met)
