"""The moments that are kept are those of the whole covariance, by plain NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from observer.gaussian import mixture
from observer.pose.angle_noise import AngleNoise
from observer.pose.filter_bank import FilterBank
from observer.pose.interacting_models import LEAST, JumpMarkovModel
from observer.pose.joint_pairs import JointPairs
from observer.pose.lagged_moments import PRESENT, LaggedMoments, no_covariance, spread_out
from observer.pose.plain_loops import WIDE
from observer.pose.smooth_motion import KinematicPose, SmoothMotion
from tests.observer.hands import pointer

STEP, JOINTS = 0.01, 3


class Whole:
    """An interacting multiple model filter with the whole covariance (C, M, S, S), as the textbook has it."""

    def __init__(self, model, level, means, covariances):
        self.model, self.level, self.means, self.covariances = model, level, means, covariances

    def turn(self, felt, variance):
        switching, transition, noise = self.model
        count, levels, size = self.means.shape
        move = np.zeros((size, size))
        move[:PRESENT, :PRESENT] = transition
        move[range(PRESENT, size), [0, *range(PRESENT, size - 1)]] = 1.0
        log_density = np.empty(count)
        for c in range(count):
            after = self.level[c] @ switching
            share = self.level[c][:, None] * switching / after
            means, covariances = mixture(
                share.T, *(np.stack([each[c]] * levels) for each in (self.means, self.covariances))
            )
            log = np.empty(levels)
            for m in range(levels):
                mean, covariance = move @ means[m], move @ covariances[m] @ move.T
                covariance[:PRESENT, :PRESENT] += noise[m]
                total = covariance[0, 0] + variance[c]
                residual = felt[c] - mean[0]
                self.means[c, m] = mean + covariance[0] * residual / total
                self.covariances[c, m] = covariance - np.outer(covariance[0], covariance[0]) / total
                log[m] = np.log(after[m]) - 0.5 * (residual**2 / total + np.log(2.0 * np.pi * total))
            log_density[c] = np.logaddexp.reduce(log)
            floor = np.maximum(np.exp(log - log_density[c]), LEAST)
            self.level[c] = floor / floor.sum()
        return log_density


def kept_of(covariance, apart: int):
    """Which of a covariance (…, S, S) is kept: rows (…, 3, S) and bands (…, 1 + A, T)."""
    lag = covariance.shape[-1] - PRESENT
    bands = np.zeros((*covariance.shape[:-2], 1 + apart, lag))
    for a in range(1 + apart):
        past = np.arange(PRESENT, PRESENT + lag - a)
        bands[..., a, : lag - a] = covariance[..., past, past + a]
    return covariance[..., :PRESENT, :], bands


def side_by_side(target, values) -> None:
    """Fill `target` (B, M, …, K·W) with `values` (C, M, …, K): those of W directions by each other, then the next K."""
    levels = values.shape[1]
    every = np.zeros((len(target) * WIDE, levels, *values.shape[2:]))
    every[: len(values)] = values
    blocks = np.moveaxis(every.reshape(len(target), WIDE, levels, *values.shape[2:]), 1, -1)
    target[:] = blocks.reshape(target.shape)


@pytest.mark.parametrize(("lag", "apart"), [(1, 0), (2, 1), (6, 1), (6, 3), (6, 5)])
def test_a_filter_of_few_covariances_is_the_one_of_all(lag, apart):
    smooth, pairs, rng = SmoothMotion(), JointPairs(JOINTS, 0.8, 0.4), np.random.default_rng(0)
    levels, size, count = len(smooth.speeds), PRESENT + lag, pairs.count
    noise = np.square(smooth.speeds)[:, None, None] * smooth.noise(STEP)
    model = JumpMarkovModel(smooth.switching(STEP), smooth.transition(STEP), noise)
    means = rng.standard_normal((count, levels, size))
    root = rng.standard_normal((count, levels, size, size))
    whole = Whole(model, rng.dirichlet(np.ones(levels), count), means, root @ np.swapaxes(root, 2, 3))
    bank = FilterBank.at_rest(model, np.zeros(count), 1.0, np.ones((levels, 2)), lag, apart)
    side_by_side(bank.level, whole.level)
    for target, values in zip(bank.moments, (means, *kept_of(whole.covariances, apart)), strict=True):
        side_by_side(target, values)
    for step in range(12):
        felt, variance = rng.standard_normal(count), np.full(count, 1e8 if step == 5 else 0.01)
        if step % 3 == 1:
            bank.expect()
        if step == 7:
            bank.widen(np.arange(count))
            whole.covariances[:, :, 0, 0] += np.arange(count)[:, None]
        log_density, of_directions = bank.step(felt, variance)
        np.testing.assert_allclose(log_density, whole.turn(felt, variance), atol=1e-9)
        np.testing.assert_allclose(bank.level.swapaxes(1, 2).reshape(-1, levels)[:count], whole.level, atol=1e-11)
    mean, covariance = mixture(whole.level, whole.means, whole.covariances)
    expected = mean, *kept_of(covariance, apart)
    for found, again, of in zip(of_directions, bank.over_levels(), expected, strict=True):
        np.testing.assert_allclose(found, of, atol=1e-10)
        np.testing.assert_array_equal(found, again)


@pytest.mark.parametrize("count", [1, 15, 16, 17, 64])
def test_what_is_expected_beforehand_changes_no_bit(count):
    smooth, rng = SmoothMotion(), np.random.default_rng(0)
    noise = np.square(smooth.speeds)[:, None, None] * smooth.noise(STEP)
    model = JumpMarkovModel(smooth.switching(STEP), smooth.transition(STEP), noise)
    present = np.ones((len(smooth.speeds), 2))
    one, other = (FilterBank.at_rest(model, np.zeros(count), 0.01, present, 4, 1) for _ in range(2))
    for step in range(20):
        felt, variance = rng.standard_normal(count), rng.uniform(0.01, 0.1, count)
        if rng.random() < 0.7:
            other.expect()
            other.expect()
        if step % 4 == 3:  # what was expected was of what is no longer believed
            for each in (one, other):
                each.widen(np.full(count, 0.5))
        (density, moments), (same_density, same) = (each.step(felt, variance) for each in (one, other))
        np.testing.assert_array_equal(density, same_density)
        for found, again in zip((one.level, *one.moments, *moments), (other.level, *other.moments, *same), strict=True):
            np.testing.assert_array_equal(found, again)


def test_joints_are_the_mixture_of_what_their_partners_say():
    rng, lag, apart = np.random.default_rng(0), 5, 2
    pairs = JointPairs(4, 0.8, 0.4)
    pairs.learn(rng.standard_normal(pairs.count))
    size = PRESENT + lag
    mean, root = rng.standard_normal((pairs.count, size)), rng.standard_normal((pairs.count, size, size))
    covariance = root @ np.swapaxes(root, 1, 2)
    of_directions = LaggedMoments(mean, *(each.copy() for each in kept_of(covariance, apart)))
    joints = pairs.of_joints(of_directions)
    plus, minus = (np.zeros((4, 4), dtype=int) for _ in range(2))
    for k, (i, j) in enumerate(zip(*np.triu_indices(4, 1), strict=True)):
        plus[i, j] = plus[j, i] = 4 + k
        minus[i, j] = minus[j, i] = 4 + 6 + k
    for j in range(4):
        means = [
            mean[j] if h == j else (mean[plus[j, h]] + np.sign(h - j) * mean[minus[j, h]]) / 2**0.5 for h in range(4)
        ]
        spread = [
            covariance[j] if h == j else 0.5 * (covariance[plus[j, h]] + covariance[minus[j, h]]) for h in range(4)
        ]
        expected, mixed = mixture(pairs.weights()[j][None], np.array(means)[None], np.array(spread)[None])
        for found, of in zip(joints, (expected[0], *kept_of(mixed[0], apart)), strict=True):
            np.testing.assert_allclose(found[j], of, atol=1e-12)


def test_joints_as_one_gaussian():
    rng, count, lag, apart = np.random.default_rng(0), 2, 4, 1
    size = PRESENT + lag
    root = rng.standard_normal((count, size, size))
    covariance, mean = root @ np.swapaxes(root, 1, 2), rng.standard_normal((count, size))
    lasting = rng.random((1 + lag, count))
    found, whole = np.empty(size * count), no_covariance(count, lag, apart)
    spread_out(LaggedMoments(mean, *kept_of(covariance, apart)), lasting, found, whole)
    np.testing.assert_array_equal(found.reshape(size, count).T, mean)
    assert not whole[0::count, 1::count].any()  # joints are independent
    for j in range(count):
        own = whole[j::count, j::count]
        np.testing.assert_array_equal(own, own.T)
        ago = np.array([0, -1, -1, *range(1, 1 + lag)])
        for i in range(size):
            for k in range(size):
                if min(ago[i], ago[k]) > 0 and abs(ago[i] - ago[k]) > apart:
                    assert np.isnan(own[i, k])
                    continue
                common = lasting[abs(ago[i] - ago[k]), j] if min(ago[i], ago[k]) >= 0 else 0.0
                assert own[i, k] == pytest.approx(covariance[j, i, k] + common)


@pytest.mark.parametrize("told", [{}, {"bias_deg": 2.0, "drift_deg": 1.0}])
def test_what_is_kept_does_not_depend_on_how_much_is(told):
    hand, rng = pointer(), np.random.default_rng(1)
    make = lambda apart: KinematicPose(  # noqa: E731
        hand, sigma=0.05, control_hz=50.0, lag=7, apart=apart, noise=AngleNoise(hand.joints, 0.02, **told)
    )
    every, few = make(None), make(1)
    for _ in range(12):
        felt = hand.rest_pose + 0.05 * rng.standard_normal(hand.joints)
        for each in (every, few):
            each.step(np.zeros(hand.joints), felt, np.zeros(len(hand.patches), dtype=bool))
    np.testing.assert_array_equal(few.mean, every.mean)
    kept = np.isfinite(few.covariance)
    assert not kept.all()
    assert np.isfinite(every.covariance).all()
    np.testing.assert_array_equal(few.covariance[kept], every.covariance[kept])
    assert np.linalg.eigvalsh(every.covariance).min() > -1e-9
    for ago in range(7):
        assert np.isfinite(few.covariance[few.lagged(ago), few.lagged(ago + 1)]).all()
        assert np.isfinite(few.covariance[few.lagged(ago), few.lagged(0)]).all()
