"""The running mean of the maps against the mean computed anew."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from haptic_env.grid import Grid
from observer.contact_model import ContactModel
from observer.occupancy import Maps

MODEL = ContactModel(prior=0.2)
PROBABILITY = MODEL.evidence(0.004).probability
GRID = Grid.around(np.zeros(3), np.full(3, 0.02), 0.004)


def _expected(maps, weights):
    mean = np.tensordot(weights, PROBABILITY[maps.log_odds.astype(int) + 128], axes=1)
    known = (maps.log_odds != 0).any(axis=0) | maps.seen.reshape(GRID.shape)
    return np.where(known, mean, 0.5)


def _change(maps, rng):
    """Write at random into some cells of some maps."""
    cells = rng.random(maps.written.size) < 0.2
    maps.log_odds.reshape(len(maps.log_odds), -1)[:, cells] += rng.integers(1, 5, cells.sum()).astype(np.int8)
    maps.written[cells] = True


@pytest.mark.parametrize("asked", [1, 3])
def test_the_running_mean_is_the_mean(asked):
    """Whether it is asked for after every change or after several, with weights that change now and then."""
    rng = np.random.default_rng(asked)
    maps, weights = Maps(5, GRID, PROBABILITY), np.full(5, 0.2)
    for turn in range(9):
        maps.before_change()
        maps.see(rng.random(maps.written.size) < 0.1)
        _change(maps, rng)
        if turn % 4 == 3:
            weights = rng.dirichlet(np.ones(5))
        maps.after_change(weights_changed=turn % 4 == 3)
        snapshot = maps.snapshot(weights)
        if turn % asked == 0:
            np.testing.assert_allclose(snapshot.value(), _expected(maps, weights), rtol=1e-12)
    np.testing.assert_allclose(maps.snapshot(weights).value(), _expected(maps, weights), rtol=1e-12)


def test_a_held_snapshot_never_changes():
    rng = np.random.default_rng(0)
    maps, weights = Maps(3, GRID, PROBABILITY), np.full(3, 1 / 3)
    _change(maps, rng)
    maps.after_change(weights_changed=False)
    held, before = maps.snapshot(weights), _expected(maps, weights)
    maps.before_change()
    _change(maps, rng)
    maps.after_change(weights_changed=False)
    np.testing.assert_allclose(held.value(), before, rtol=1e-12)
    assert not held.value().flags.writeable
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(maps.snapshot(weights))).value(), _expected(maps, weights))
    assert (maps.snapshot(weights).value() != before).any()
