"""Memory that fades, against an observer that forgets nothing. T steps, C names."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest
from scipy.special import log_softmax

from haptic_env import hands
from observer import PoseOnly, ShapePosterior
from observer.shape.fading import faded
from observer.shape.null_model import log_shares, shares
from tests.observer.conftest import Exploration

T, C, STEP = 40, 3, 0.1
SECONDS = STEP * np.arange(T)
IDEAL = log_softmax(np.cumsum(np.random.default_rng(1).normal(0.0, 0.7, (2, T, C)), axis=1), axis=-1)
STEP_SECONDS = 1.0 / 50.0
TOLD = {"plain": {}, "none": {"none": 0.2, "alike": 0.0}}


def test_a_memory_that_does_not_fade_is_the_ideal_bit_for_bit():
    assert faded(IDEAL, SECONDS, np.inf).tobytes() == IDEAL.tobytes()
    np.testing.assert_allclose(faded(IDEAL, SECONDS, 1e8), IDEAL, atol=1e-5)


def test_what_is_left_of_evidence_is_the_exponential_of_its_age():
    memory = 0.7
    changes = np.diff(IDEAL, axis=1, prepend=-np.log(C))
    for now in (0, 1, T - 1):
        age = SECONDS[now] - SECONDS[: now + 1]
        evidence = (np.exp(-age / memory)[:, None] * changes[:, : now + 1]).sum(axis=1)
        np.testing.assert_allclose(faded(IDEAL, SECONDS, memory)[:, now], log_softmax(evidence, axis=-1), atol=1e-12)


def test_the_shortest_memory_leaves_only_what_was_just_felt():
    just_felt = log_softmax(np.diff(IDEAL, axis=1), axis=-1)
    np.testing.assert_allclose(faded(IDEAL, SECONDS, 1e-6)[:, 1:], just_felt, atol=1e-12)


def test_a_hand_that_feels_nothing_any_more_goes_back_to_the_prior():
    prior = np.log([0.5, 0.3, 0.2])
    rests = np.where(np.arange(T)[:, None] < 5, IDEAL[0], IDEAL[0, 4])
    told = faded(rests, SECONDS, 0.3, prior)
    np.testing.assert_allclose(told[-1], prior, atol=1e-3)
    assert (np.abs(told[5:] - prior).max(axis=1)[:-1] > np.abs(told[5:] - prior).max(axis=1)[1:]).all()


def test_what_is_missing_stays_so_and_what_is_impossible_too():
    courses = np.stack([IDEAL[0], np.full((T, C), np.nan), IDEAL[0]])
    courses[2] = log_softmax(np.where(np.arange(C) == 1, -np.inf, IDEAL[0]), axis=-1)
    told = faded(courses, SECONDS, 0.5)
    assert np.isnan(told[1]).all()
    assert (told[2, :, 1] == -np.inf).all()
    np.testing.assert_allclose(np.exp(told[[0, 2]]).sum(axis=-1), 1.0)
    alone = log_softmax(IDEAL[0][:, [0, 2]], axis=-1)
    np.testing.assert_allclose(told[2][:, [0, 2]], faded(alone, SECONDS, 0.5), atol=1e-12)


def test_a_name_once_as_good_as_impossible_comes_back():
    lost = np.array([[0.5, 0.5], [1.0, 0.0], [1.0, 0.0]])
    with np.errstate(divide="ignore"):
        told = faded(np.log(lost), [0.0, 1.0, 200.0], 10.0)
    assert np.exp(told[1, 1]) == 0.0
    assert np.exp(told[2, 1]) == pytest.approx(0.5, abs=1e-3)


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"memory_seconds": 0.0}, "memory_seconds must be"),
        ({"memory_seconds": -1.0}, r"got -1.0; or inf"),
        ({"memory_seconds": float("nan")}, "got nan"),
        ({"seconds": SECONDS[:-1]}, r"of shape \(..., 39, names\)"),
        ({"seconds": SECONDS[::-1]}, "ascending"),
        ({"log_posterior": "x"}, "must be numbers"),
        ({"prior": [0.0]}, "prior"),
    ],
)
def test_what_does_not_fit_is_refused(changed, told):
    with pytest.raises(ValueError, match=told):
        faded(**{"log_posterior": IDEAL, "seconds": SECONDS, "memory_seconds": 1.0, **changed})


@lru_cache
def _beliefs():
    trial = Exploration("cube", 120, sigma_deg=3.0)
    return trial.beliefs(PoseOnly(trial.hand, 3.0))


def _courses(**keywords) -> tuple[np.ndarray, np.ndarray]:
    """Posterior (T, C) and its log, after each belief."""
    posterior = ShapePosterior(hands.make("two_finger"), ["cube", "sphere", "cylinder"], **keywords)
    posterior.reset(seed=0)
    told = [(posterior.update(belief), posterior.log_posterior) for belief in _beliefs()]
    return tuple(np.array(each) for each in zip(*told, strict=True))


@pytest.mark.parametrize("kind", TOLD)
def test_the_live_posterior_is_the_same_equation(kind):
    posterior, log = _courses(**TOLD[kind])
    assert posterior[-1].max() > 0.8  # there is something to forget
    np.testing.assert_allclose(np.log(posterior), log, atol=1e-9)
    forgetful, its_log = _courses(memory_seconds=0.5, **TOLD[kind])
    np.testing.assert_allclose(np.log(forgetful), its_log, atol=1e-12)
    expected = faded(log, STEP_SECONDS * np.arange(len(log)), 0.5, log[0])
    np.testing.assert_allclose(its_log, expected, atol=1e-9)
    assert np.abs(forgetful - posterior).max() > 0.1


def test_a_live_posterior_that_does_not_forget_has_the_same_bits():
    for mine, other in zip(_courses(), _courses(memory_seconds=np.inf), strict=True):
        assert mine.tobytes() == other.tobytes()


@pytest.mark.parametrize("least", [0.0, 0.9])
def test_logs_of_shares_are_those_of_the_shares(least):
    rng = np.random.default_rng(2)
    for log in (rng.normal(0, 5, 4), rng.normal(-100, 300, 4)):
        for told in ((log,), (log[:3], log[3], 0.3, 0.03, least)):
            with np.errstate(divide="ignore"):
                plain = np.log(shares(*told))
            seen = plain > -700
            np.testing.assert_allclose(log_shares(*told)[seen], plain[seen], atol=1e-9)
            assert np.isfinite(log_shares(*told)).all()
