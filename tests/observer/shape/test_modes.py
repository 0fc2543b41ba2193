"""Draws about modes are as probable as the compiled mixture says."""

from __future__ import annotations

import numpy as np
from scipy import stats
from scipy.spatial.transform import Rotation
from scipy.special import logsumexp

from observer.shape.modes import log_mixture
from observer.shape.turns import angle, product

DRAWS, MODES = 30, 3
PLACE = np.array([0, 2, 4])  # size, and two of place; the third is known


def _random(count: int, rng: np.random.Generator) -> np.ndarray:
    turns = Rotation.from_rotvec(0.5 * rng.standard_normal((count, 3)))
    return np.concatenate([rng.uniform(-1, 1, (count, 5)), turns.as_quat()], axis=1)


def test_the_mixture_is_that_of_its_parts():
    rng = np.random.default_rng(0)
    units, modes = _random(DRAWS, rng), _random(MODES, rng)
    root = rng.standard_normal((MODES, 6, 6))
    covariance = 0.1 * root @ root.transpose(0, 2, 1) + 0.05 * np.eye(6)
    log_share, floor, said = np.log(rng.uniform(0.05, 0.3, (MODES, 2))), np.log(0.02), np.empty(DRAWS)
    log_mixture(units, modes, np.linalg.cholesky(covariance), PLACE, log_share, floor, said)
    parts = [np.full(DRAWS, floor)]
    for m in range(MODES):
        turn = (Rotation.from_quat(units[:, 5:]) * Rotation.from_quat(modes[m, 5:]).inv()).as_rotvec()
        off = np.concatenate([(units - modes[m])[:, PLACE], turn], axis=1)
        much = np.linalg.norm(turn, axis=1)
        of_turns = (1.0 - np.cos(much)) / (4.0 * np.pi**2 * much**2)  # share of all turns in a unit of volume
        parts.append(log_share[m, 0] + stats.multivariate_normal(np.zeros(6), covariance[m]).logpdf(off))
        parts[-1] = parts[-1] - np.log(of_turns)
        place = stats.multivariate_normal(np.zeros(3), covariance[m, :3, :3])
        parts.append(log_share[m, 1] + place.logpdf(off[:, :3]))
    np.testing.assert_allclose(said, logsumexp(parts, axis=0), rtol=1e-9)


def test_quaternions_are_multiplied_and_measured():
    rng = np.random.default_rng(0)
    second, first = Rotation.random(20, rng=rng), Rotation.random(20, rng=rng)
    both = product(second.as_quat(), first.as_quat())
    assert (Rotation.from_quat(both) * (second * first).inv()).magnitude().max() < 1e-9
    np.testing.assert_allclose(angle(both[:, 3]), (second * first).magnitude(), atol=1e-7)
