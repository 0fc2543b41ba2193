"""Systematic resampling: how many copies, and copies that are copies."""

from __future__ import annotations

import numpy as np
import pytest

from observer import HapticSLAM, resampling
from tests.observer.hands import pointer


def _weights(seed: int, count: int) -> np.ndarray:
    return np.random.default_rng(seed).dirichlet(np.full(count, 0.3))


@pytest.mark.parametrize("count", [1, 2, 7, 200])
@pytest.mark.parametrize("seed", range(5))
def test_copies_are_never_a_whole_one_from_their_share(seed, count):
    weights = _weights(seed, count)
    for uniform in [0.0, *np.random.default_rng(seed).random(50)]:
        copies = resampling.systematic_counts(weights, uniform)
        assert copies.sum() == count
        assert (np.abs(copies - count * weights) < 1 + 1e-9).all()


@pytest.mark.parametrize("count", [1, 2, 7, 200])
def test_all_are_dealt_out_whatever_the_rounding(count):
    for uniform in (0.0, np.nextafter(0.0, 1.0), np.nextafter(1.0, 0.0)):
        for weights in (_weights(0, count), np.full(count, 1 / count), np.eye(count)[0]):
            copies = resampling.systematic_counts(weights, uniform)
            assert copies.sum() == count
            assert (copies >= 0).all()


def test_expected_copies_are_the_weights():
    weights, rng, draws = _weights(0, 20), np.random.default_rng(1), 20_000
    copies = np.array([resampling.systematic_counts(weights, rng.random()) for _ in range(draws)])
    share = (20 * weights) % 1
    error = np.sqrt(share * (1 - share) / draws)  # of a number that is either whole neighbour of its mean
    assert (np.abs(copies.mean(axis=0) - 20 * weights) < 4 * error + 1 / draws).all()


def test_expected_copies_are_exactly_the_weights():
    """Averaged over a fine lattice of the one number that chance has."""
    weights, fine = _weights(3, 11), 4000
    copies = [resampling.systematic_counts(weights, (i + 0.5) / fine) for i in range(fine)]
    np.testing.assert_allclose(np.mean(copies, axis=0), 11 * weights, atol=2 / fine)


@pytest.mark.parametrize("survivor", [0, 3, 6])
def test_a_single_survivor_takes_every_place(survivor):
    weights = np.zeros(7)
    weights[survivor] = 1.0
    for uniform in (0.0, 0.5, 0.999):
        copies = resampling.systematic_counts(weights, uniform)
        np.testing.assert_array_equal(copies, 7 * weights)
        source, target = resampling.in_place(copies)
        assert (source == survivor).all()
        assert set(target) == set(range(7)) - {survivor}


def test_equal_weights_copy_nothing():
    for uniform in np.linspace(0.01, 0.99, 50):
        copies = resampling.systematic_counts(np.full(200, 1 / 200), uniform)
        np.testing.assert_array_equal(copies, 1)


@pytest.mark.parametrize("seed", range(10))
def test_survivors_stay_and_the_dead_are_overwritten(seed):
    copies = resampling.systematic_counts(_weights(seed, 50), 0.3)
    source, target = resampling.in_place(copies)
    assert len(source) == len(target) == len(set(target))
    np.testing.assert_array_equal(np.sort(target), np.flatnonzero(copies == 0))
    assert not set(source) & set(target)
    held = np.arange(50)
    held[target] = source
    np.testing.assert_array_equal(np.bincount(held, minlength=50), copies)


def test_effective_sample_size():
    assert resampling.effective_sample_size(np.full(40, 1 / 40)) == pytest.approx(40)
    assert resampling.effective_sample_size(np.eye(40)[3]) == pytest.approx(1)
    weights = _weights(0, 40)
    assert resampling.effective_sample_size(weights) == pytest.approx(1 / sum(w * w for w in weights))


def test_a_copy_of_a_particle_owns_its_map():
    """Resample the observer's particles, then change one map: no other follows."""
    slam = HapticSLAM(pointer(), 1.0, particles=8)
    slam.reset(seed=0)
    state = slam._state
    state.maps.make_room(np.arange(20))
    state.maps.own[:] = np.arange(8, dtype=np.int8)[:, None]
    state.poses[:] = np.arange(8)[:, None]
    state.weigh(np.log([1e-9, 1e-9, 0.5, 1e-9, 1e-9, 0.5, 1e-9, 1e-9]))
    assert state.resample()
    held = state.maps.own[:, :20]
    assert held[2].max() == 2, "survivors stay where they are"
    assert held[5].max() == 5
    assert sorted(held[:, 0]) == [2] * 4 + [5] * 4
    np.testing.assert_array_equal(held[:, 0], state.poses[:, 0])
    np.testing.assert_allclose(state.log_weights, -np.log(8))
    for n in range(8):
        before = held.copy()
        held[n] += 1
        changed = (held != before).any(axis=1)
        np.testing.assert_array_equal(changed, np.arange(8) == n)


def test_particles_of_like_weight_are_left_alone():
    slam = HapticSLAM(pointer(), 1.0, particles=8)
    slam.reset(seed=0)
    state = slam._state
    state.log_weights[:] = np.log([0.2, 0.1, 0.1, 0.1, 0.15, 0.15, 0.1, 0.1])
    assert not state.resample()
