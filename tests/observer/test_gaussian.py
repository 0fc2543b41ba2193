"""Small Gaussians against NumPy's linear algebra."""

from __future__ import annotations

import numpy as np
import pytest

from observer.gaussian import carried_on, conditional, lower_factor, shifted, solve

J = 3


@pytest.fixture
def gaussian():
    """Mean and covariance of nine numbers: three angles now and at two earlier times."""
    rng = np.random.default_rng(0)
    root = 0.1 * rng.standard_normal((3 * J, 3 * J))
    return rng.standard_normal(3 * J), root @ root.T


def test_what_follows_is_the_conditional_distribution(gaussian):
    mean, covariance = gaussian
    now_mean, follow, before_mean, rest = conditional(mean, covariance, 2 * J, J, J)
    before, now = slice(2 * J, 3 * J), slice(J, 2 * J)
    expected = covariance[now, before] @ np.linalg.inv(covariance[before, before])
    np.testing.assert_allclose(follow, expected, rtol=1e-6)
    np.testing.assert_allclose(rest, covariance[now, now] - expected @ covariance[before, now], atol=1e-9)
    np.testing.assert_array_equal(now_mean, mean[now])
    np.testing.assert_array_equal(before_mean, mean[before])


def test_a_shift_of_the_past_moves_the_present_as_far_as_they_are_correlated(gaussian):
    mean, covariance = gaussian
    shift = np.array([0.1, -0.2, 0.05])
    angles, std, lagged, lagged_std, block = shifted(mean, covariance, J, shift)
    past = slice(J, 2 * J)
    expected = mean[:J] + covariance[:J, past] @ np.linalg.solve(covariance[past, past], shift)
    np.testing.assert_allclose(angles, expected, rtol=1e-6)
    np.testing.assert_array_equal(lagged, mean[past] + shift)
    np.testing.assert_allclose(np.concatenate([std, lagged_std]) ** 2, np.diag(covariance)[: 2 * J])
    np.testing.assert_array_equal(block, covariance[past, past])


def test_points_that_are_carried_on_keep_their_place_in_the_spread(gaussian):
    mean, covariance = gaussian
    before, now, rng = slice(2 * J, 3 * J), slice(J, 2 * J), np.random.default_rng(1)
    wide = 2.0 * lower_factor(covariance[before, before])
    normals = rng.standard_normal((5, J))
    follow = conditional(mean, covariance, before.start, now.start, J)[1]
    centres, factor = carried_on(
        covariance, before.start, now.start, follow, mean[before], wide, mean[before] + normals @ wide.T
    )
    narrow = np.linalg.cholesky(covariance[before, before])
    np.testing.assert_allclose(centres, normals @ narrow.T @ follow.T, rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(factor, np.linalg.cholesky(covariance[now, now]), rtol=1e-9)


@pytest.mark.parametrize("variance", [0.0, 1e-10, 0.01, 4.0])
def test_what_moves_together_is_solved_as_well(variance):
    """Two angles that are one: the best guess of either is the other."""
    covariance = np.full((2, 2), variance)
    share = covariance.copy()
    solve(covariance, np.empty_like(covariance), share)
    found = covariance @ share
    np.testing.assert_allclose(found, covariance, rtol=1e-3, atol=1e-11)
