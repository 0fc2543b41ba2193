"""The running mean of the maps against the mean computed anew."""

from __future__ import annotations

import copy
import pickle
from collections import deque

import numpy as np
import pytest
from scipy.ndimage import binary_dilation

from haptic_env.grid import Grid
from observer.maps import occupancy
from observer.maps.contact_model import ContactModel
from observer.maps.occupancy import Maps

MODEL = ContactModel(prior=0.2)
PROBABILITY = MODEL.evidence(0.004).probability
GRID = Grid.around(np.zeros(3), np.full(3, 0.032), 0.004)
COME_TO = np.arange(np.prod(GRID.shape)) < 200  # the hand stays on one side


def _expected(maps, weights):
    mean = weights @ PROBABILITY[maps.common.astype(int) + maps.own[:, maps.slot] + 128]
    told = binary_dilation(maps.seen.reshape(GRID.shape), np.ones((3, 3, 3)))
    assert maps.seen.sum() < told.sum() < told.size
    return np.where(told, mean.reshape(GRID.shape), 0.5)


def _change(maps, rng):
    """Write at random: into what all have in common, into some of the particles' own."""
    cells = np.flatnonzero(COME_TO & (rng.random(maps.common.size) < 0.2))
    maps.own[:, maps.make_room(cells)] += rng.integers(1, 5, len(cells)).astype(np.int8)
    own = rng.permutation(cells)[: len(cells) // 2]
    maps.own[0, maps.slot[own]] += 1
    maps.touched[own] = True
    swept = COME_TO & (rng.random(maps.common.size) < 0.1) & (maps.slot < 0)
    maps.common[swept] -= 3
    maps.seen |= swept
    maps.stale |= swept


@pytest.mark.parametrize("asked", [1, 3])
def test_the_running_mean_is_the_mean(asked):
    """Whether it is asked for after every change or after several, with weights that change now and then."""
    rng = np.random.default_rng(asked)
    maps, weights = Maps(5, GRID, PROBABILITY), np.full(5, 0.2)
    for turn in range(9):
        maps.before_change()
        _change(maps, rng)
        if turn % 4 == 3:
            weights = rng.dirichlet(np.ones(5))
            maps.weights_changed()
        snapshot = maps.snapshot(weights)
        if turn % asked == 0:
            np.testing.assert_allclose(snapshot.value(), _expected(maps, weights), rtol=1e-12)
    np.testing.assert_allclose(maps.snapshot(weights).value(), _expected(maps, weights), rtol=1e-12)


def test_a_held_snapshot_never_changes():
    rng = np.random.default_rng(0)
    maps, weights = Maps(3, GRID, PROBABILITY), np.full(3, 1 / 3)
    _change(maps, rng)
    held, before = maps.snapshot(weights), _expected(maps, weights)
    maps.before_change()
    _change(maps, rng)
    np.testing.assert_allclose(held.value(), before, rtol=1e-12)
    assert not held.value().flags.writeable
    sent = pickle.loads(pickle.dumps(maps.snapshot(weights))).value()
    np.testing.assert_allclose(sent, _expected(maps, weights), rtol=1e-12)
    assert (maps.snapshot(weights).value() != before).any()


def test_snapshots_of_many_times_are_each_of_their_own():
    """Asked for in any order, after all; some of them were dropped before."""
    rng = np.random.default_rng(2)
    maps, weights = Maps(4, GRID, PROBABILITY), np.full(4, 0.25)
    held = []
    for turn in range(12):
        maps.before_change()
        _change(maps, rng)
        if turn % 3 == 2:
            weights = rng.dirichlet(np.ones(4))
            maps.weights_changed()
        snapshot = maps.snapshot(weights)
        if turn % 4 != 1:
            held += [(snapshot, _expected(maps, weights)), (maps.snapshot(weights), _expected(maps, weights))]
    for each in rng.permutation(len(held)):
        snapshot, expected = held[each]
        np.testing.assert_allclose(snapshot.value(), expected, rtol=1e-12)


@pytest.mark.parametrize("held", [1, 2, 5])
@pytest.mark.parametrize("asked", [1, 3, 100])
def test_a_mean_that_was_put_off_is_that_of_its_time(monkeypatch, held, asked):
    """Weights change all the time; some snapshots are let go of, some are asked for late, some never."""
    monkeypatch.setattr(occupancy, "WORTH_A_COPY", 0)
    rng = np.random.default_rng(held)
    maps, kept = Maps(4, GRID, PROBABILITY), deque(maxlen=held)
    for turn in range(40):
        maps.before_change()
        _change(maps, rng)
        weights = rng.dirichlet(np.ones(4))
        maps.weights_changed()
        kept.append((maps.snapshot(weights), _expected(maps, weights)))
        if turn % asked == asked - 1:
            for snapshot, expected in rng.permutation(np.array(kept, dtype=object)):
                np.testing.assert_allclose(snapshot.value(), expected, rtol=1e-12)
        if turn % 7 == 3:
            maps = copy.deepcopy(maps)
    np.testing.assert_allclose(maps.snapshot(weights).value(), _expected(maps, weights), rtol=1e-12)


@pytest.mark.parametrize(("held", "stay", "expected"), [(1, False, 0), (1, True, 18), (2, False, 18)])
def test_no_mean_is_computed_that_nobody_can_ask_for(monkeypatch, held, stay, expected):
    """Of who holds the last one alone, which is let go of when the next one comes, none; of who holds two, each. Where
    weights stay it is cheap, and computed at once."""
    monkeypatch.setattr(occupancy, "WORTH_A_COPY", 0)
    computed = []
    real = occupancy.mean_probability
    monkeypatch.setattr(occupancy, "mean_probability", lambda *told: computed.append(1) or real(*told))
    rng = np.random.default_rng(3)
    maps, weights, kept = Maps(4, GRID, PROBABILITY), np.full(4, 0.25), deque(maxlen=held)
    for _ in range(20):
        maps.before_change()
        _change(maps, rng)
        weights = weights if stay else rng.dirichlet(np.ones(4))
        maps.weights_changed()
        kept.append(maps.snapshot(weights))
    assert len(computed) == expected


def test_room_is_made_once_and_keeps_what_was_there():
    maps, rng = Maps(2, GRID, PROBABILITY), np.random.default_rng(1)
    told = {}
    for _ in range(12):
        cells = rng.integers(0, maps.common.size, 40)
        before = maps.common.astype(int) + maps.own[:, maps.slot]
        maps.make_room(cells)
        np.testing.assert_array_equal(maps.common + maps.own[:, maps.slot], before)
        maps.common[(rng.random(maps.common.size) < 0.1) & (maps.slot < 0)] -= 1
        assert len(np.unique(maps.cells)) == len(maps.cells)
        np.testing.assert_array_equal(maps.slot[maps.cells], np.arange(len(maps.cells)))
        for cell in cells:
            told.setdefault(cell, rng.integers(-9, 9, 2))
            maps.own[:, maps.slot[cell]] = told[cell]
    for cell, values in told.items():
        np.testing.assert_array_equal(maps.own[:, maps.slot[cell]], values)
    assert np.count_nonzero(maps.slot >= 0) == len(told)


def test_copied_maps_are_copies():
    rng = np.random.default_rng(0)
    maps = Maps(6, GRID, PROBABILITY)
    _change(maps, rng)
    maps.own[:, : len(maps.cells)] = rng.integers(-127, 128, (6, len(maps.cells)))
    before = maps.own.copy()
    maps.copy(np.array([1, 1, 4]), np.array([0, 3, 5]))
    np.testing.assert_array_equal(maps.own, before[[1, 1, 2, 1, 4, 4]])
    maps.own[0] = 0
    np.testing.assert_array_equal(maps.own[1], before[1])
    maps.copy(np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64))
    np.testing.assert_array_equal(maps.own[2], before[2])
